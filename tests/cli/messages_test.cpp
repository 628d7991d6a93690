// Warnings at the command line: flags, causes, places.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/option.h"
#include "job/check_result.h"
#include "job/root_causes.h"
#include "kiln/error.h"
#include "kiln/mesh.h"
#include "kiln/message.h"
#include "kiln/option_error.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

TEST(Flags, StandForTheLibrarysOptions) {
  constexpr std::pair<const char*, const char*> kFlags[] = {
      {"match.max_distance", "--max-distance"},
      {"bake.match.max_distance", "--max-distance"},
      {"max_distance", "--max-distance"},
      {"match.views.count", "--views"},
      {"match.views.size", "--view-size"},
      {"match.uv.max_overlap", "--force-uv"},
      {"match.saved", "--load-match"},
      {"part_names.low", "--low-names"},
      {"save_match()", "--save-match"},
      {"unwrap()", "`kiln bake --unwrap`"},
      {"simplify()", "`kiln bake` without LOW"},
      // Options of other commands go by the name itself.
      {"outer_only", "--outer"},
      {"outer_gap", "--outer-gap"},
      {"keep_topology", "--topology"},
      {"memory_limit", "--memory-limit"}};
  for (const auto& [name, flag] : kFlags) EXPECT_EQ(option_as_flag(name, {}), flag);
  EXPECT_EQ(option_as_flag("match.fallback", "ray"), "--fallback ray");
}

TEST(Keywords, StandForTheLibrarysOptions) {
  EXPECT_EQ(option_as_keyword("match.max_distance", "2%"), "max_distance=\"2%\"");
  EXPECT_EQ(option_as_keyword("match.views.count", "9"), "views=9");
  EXPECT_EQ(option_as_keyword("match.uv.max_overlap", {}), "force_uv");
  EXPECT_EQ(option_as_keyword("unwrap()", {}), "kiln.unwrap()");
  EXPECT_EQ(option_as_keyword("save_match()", {}), "kiln.Match.save()");
  EXPECT_EQ(option_as_keyword("bounds", {}), "bounds");
}

TEST(Members, StandForFlags) {
  EXPECT_EQ(option_as_member("max_distance", "2%"), "job.bake.match.max_distance = 2%");
  EXPECT_EQ(option_as_member("match.max_distance", {}), "job.bake.match.max_distance");
  EXPECT_EQ(option_as_member("memory_limit", {}), "memory_limit");
}

TEST(Messages, SpellOptionsAlone) {
  const Message message =
      "'`match.cage` --cage' lacks " + option("match.cage", "0.1") + ", or `x`.";
  EXPECT_EQ(message.text(), "'`match.cage` --cage' lacks `match.cage` 0.1, or `x`.");
  EXPECT_EQ(message.text(option_as_flag), "'`match.cage` --cage' lacks --cage 0.1, or `x`.");
  EXPECT_EQ(message.text(option_as_keyword), "'`match.cage` --cage' lacks cage=0.1, or `x`.");
  EXPECT_FALSE(Message("`match.cage`").has_options());
}

TEST(Messages, AreListsOfPieces) {
  Message message;
  EXPECT_TRUE(message.empty());
  message += Message("a") + "b" + option("cage") + option("samples", "4") + "" + "c";
  ASSERT_EQ(message.pieces().size(), 4U);
  EXPECT_EQ(message.pieces()[0], (MessagePiece{.text = "ab"}));
  EXPECT_EQ(message.pieces()[1], (MessagePiece{.option = "cage"}));
  EXPECT_EQ(message.pieces()[2], (MessagePiece{.option = "samples", .value = "4"}));
  EXPECT_EQ(message.pieces()[3], (MessagePiece{.text = "c"}));
  message += message;
  EXPECT_EQ(message.text(), "ab`cage``samples` 4cab`cage``samples` 4c");
}

TEST(Messages, ErrorsTellTheirOption) {
  EXPECT_EQ(Error(ErrorCode::usage, "One `match.cage` in a text.").option(), "");
  const Error error(ErrorCode::usage, option("match.cage") + " is 0: give more, or " +
                                          option("match.fallback", "ray") + ".");
  const Error copy = error;
  EXPECT_EQ(copy.option(), "match.cage");
  EXPECT_STREQ(copy.what(), "`match.cage` is 0: give more, or `match.fallback` ray.");
  const std::vector<MessagePiece> remedies = remedies_of(copy.message());
  ASSERT_EQ(remedies.size(), 1U);
  EXPECT_EQ(remedies[0], (MessagePiece{.option = "match.fallback", .value = "ray"}));
}

TEST(Terminal, IsGivenNoControlCharacters) {
  EXPECT_EQ(printable("m\x1b[31mX\x7f\tand\nso on, \xc3\xa9\xe2\x82\xac"),
            "m\\x1b[31mX\\x7f\tand\nso on, \xc3\xa9\xe2\x82\xac");
  // C1, as two bytes and as one, which is no UTF-8.
  EXPECT_EQ(printable("\xc2\x9b\x9b"), "\\xc2\\x9b\\x9b");
  EXPECT_EQ(printable("\xc2\xa0"), "\xc2\xa0");
  // A character that turns the direction of writing: "a" U+202E "gnp.exe".
  EXPECT_EQ(printable("a\xe2\x80\xaegnp.exe"), "a\\xe2\\x80\\xaegnp.exe");
}

TEST(Terminal, LinesAreCutBetweenCharacters) {
  EXPECT_EQ(first_columns("a\xc3\xa9\xe2\x82\xac.", 3), "a\xc3\xa9\xe2\x82\xac");
  EXPECT_EQ(first_columns("ab", 3), "ab");
  EXPECT_EQ(first_columns("ab", 0), "");
}

std::vector<std::string> codes(const std::vector<Warning>& warnings) {
  std::vector<std::string> result;
  for (const Warning& warning : warnings) result.push_back(warning.code);
  return result;
}

std::vector<std::string> roots(const std::vector<std::string>& all, std::size_t of_high) {
  std::vector<Warning> warnings;
  for (const std::string& code : all) warnings.push_back({code, "", 1});
  return codes(root_causes(warnings, of_high));
}

using Codes = std::vector<std::string>;

TEST(Causes, LeaveOutWhatFollows) {
  EXPECT_EQ(roots({"missing-uvs", "uv-degenerate", "no-texels"}, 0), Codes{"missing-uvs"});
  EXPECT_EQ(roots({"short-rays", "many-misses"}, 0), Codes{"short-rays"});
  // A goal that was not reached is told beside its likely cause.
  EXPECT_EQ(roots({"short-rays", "many-misses", "error-not-reached"}, 0),
            (Codes{"short-rays", "error-not-reached"}));
  EXPECT_EQ(roots({"many-misses", "uv-overlap"}, 0), (Codes{"many-misses", "uv-overlap"}));
  EXPECT_EQ(roots({"uv-degenerate", "many-misses"}, 0), (Codes{"uv-degenerate", "many-misses"}));
  EXPECT_EQ(roots({}, 0), Codes{});
}

TEST(Causes, TellTheMeshesApart) {
  const Codes high = {"degenerate-triangles", "source-skipped", "low-degenerate"};
  EXPECT_EQ(roots(high, 1), (Codes{"degenerate-triangles", "low-degenerate"}));
  EXPECT_EQ(roots(high, 0), (Codes{"degenerate-triangles", "source-skipped"}));
}

/// A square of side 2 from (10, 20, 30), which fills the unit square of UV space.
Mesh square() {
  Mesh mesh;
  mesh.origin = {10, 20, 30};
  mesh.positions = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

TEST(MissedPatch, IsTheLargest) {
  // 8 x 4 texels, rows from the top: a patch of 2, one of 3 that bends, one that touches it by a corner.
  const std::vector<std::uint8_t> coverage = {2, 2, 1, 1, 1, 1, 1, 1,  //
                                              1, 1, 1, 1, 2, 1, 1, 1,  //
                                              0, 3, 1, 1, 2, 2, 1, 1,  //
                                              1, 1, 1, 1, 1, 1, 2, 1};
  const auto patch = largest_missed_patch(coverage, 8, 4, square());
  ASSERT_TRUE(patch.has_value());
  EXPECT_EQ(patch->texels, 3U);
  EXPECT_EQ(patch->column, 4U);
  EXPECT_EQ(patch->row, 2U);
  EXPECT_FLOAT_EQ(patch->uv.x, 4.5F / 8);
  EXPECT_FLOAT_EQ(patch->uv.y, 1 - 2.5F / 4);
  const std::array<double, 3> expected = {10 + 2 * 4.5 / 8, 20 + 2 * (1 - 2.5 / 4), 30};
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(patch->position[k], expected[k], 1e-6) << k;
  const std::string text = describe(patch);
  for (const char* word :
       {"3 texels", "column 4", "row 2", "(0.5625, 0.375)", "(11.125, 20.75, 30)"}) {
    EXPECT_NE(text.find(word), std::string::npos) << text;
  }
}

TEST(MissedPatch, DoesNotReachAroundTheEdge) {
  // The end of a row and the start of the next are no neighbours.
  const std::vector<std::uint8_t> coverage = {1, 1, 2, 2, 1, 1};
  const auto patch = largest_missed_patch(coverage, 3, 2, square());
  ASSERT_TRUE(patch.has_value());
  EXPECT_EQ(patch->texels, 1U);
  EXPECT_EQ(patch->column, 2U);
  EXPECT_EQ(patch->row, 0U);
}

TEST(MissedPatch, IsNoneWhereNothingIsMissedAsAWhole) {
  const std::vector<std::uint8_t> coverage = {0, 1, 3, 1};
  EXPECT_FALSE(largest_missed_patch(coverage, 2, 2, square()).has_value());
  EXPECT_NE(describe(std::optional<MissedPatch>()).find("No texel"), std::string::npos);
}

/// A name of a file may hold a line break, and a log's next line would be the name's.
TEST(Terminal, FurtherLinesOfAMessageAreIndented) {
  std::FILE* const to = std::tmpfile();
  ASSERT_NE(to, nullptr);
  print_line(to, "kiln: 'a\nkiln: all is well.obj' is missing");
  print_text(to, "[[bake]]\nlow = 'x'");
  std::rewind(to);
  std::string written(200, '\0');
  written.resize(std::fread(written.data(), 1, written.size(), to));
  std::fclose(to);
  EXPECT_EQ(written, "kiln: 'a\n  kiln: all is well.obj' is missing\n[[bake]]\nlow = 'x'\n");
}

}  // namespace
}  // namespace kiln::cli
