// Rows of figures as text.
#include "lab/table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace kiln::cli {
namespace {

TEST(Table, WritesFiguresOfEveryKindAsCsv) {
  Json rows = Json::array();
  rows.push_back(fields("name whole real truth none",
                        {"", std::uint64_t{18446744073709551615U}, 1.0 / 3, true, Json()}));
  rows.push_back(fields("name whole real truth none", {"b", -7, 1e-12, false, ""}));
  rows.push_back(fields("name whole real truth none", {"c", 0, 2.0, false, std::nan("")}));
  EXPECT_EQ(csv(rows),
            "name,whole,real,truth,none\n"
            ",18446744073709551615,0.333333333,1,\n"
            "b,-7,1e-12,0,\n"
            "c,0,2,0,\n");
}

TEST(Table, NamesCsvColumnsByThePathInTheReport) {
  Json rows = Json::array();
  rows.push_back({{"name", "a"}, {"runs", Json::array({1, 2})}, {"seconds", {{"total", 3}}}});
  rows.push_back({{"name", "b"}, {"seconds", {{"build", 1}, {"total", 2}}}});
  EXPECT_EQ(csv(rows),
            "name,seconds.total,seconds.build\n"
            "a,3,\n"
            "b,2,1\n");
}

TEST(Table, KeepsNamesOfFilesWithinTheirCell) {
  EXPECT_EQ(csv(Json::array({fields("name", {"a,\"b\"\nc"})})), "name\n\"a,\"\"b\"\"\nc\"\n");
  EXPECT_EQ(markdown_text("<img src=x>![a](b)|\x1b[2J\n&amp;"),
            "\\<img src=x\\>\\!\\[a\\](b)\\|\\\\x1b\\[2J \\&amp;");
  EXPECT_EQ(fixed_text(3e38, 2), "3e+38");
  EXPECT_EQ(fixed_text(2.5, 0), "2");
}

TEST(Table, AlignsMarkdown) {
  Json rows = Json::array();
  rows.push_back({{"way", "rays²"}, {"share", {{"of", 0.125}}}, {"best", true}});
  rows.push_back({{"way", "views"}, {"share", Json()}, {"best", false}});
  const std::vector<Column> columns = {{"way", "way"}, {"share, %", "share.of", 1, 100, "best"}};
  EXPECT_EQ(table_lines(columns, rows),
            (std::vector<std::string>{"| way   | share, % |",  //
                                      "| ----- | -------: |", "| rays² |   12.5 * |",
                                      "| views |          |"}));
}

TEST(Table, RefusesAnotherNumberOfValues) {
  EXPECT_THROW(fields("a b", {1}), std::logic_error);
  EXPECT_THROW(fields("a b", {1, 2, 3}), std::logic_error);
}

TEST(Table, MakesObjectsOfKeysAndValues) {
  EXPECT_EQ(fields("a b c", {1, "x", Json::array({2})}).dump(), R"({"a":1,"b":"x","c":[2]})");
  EXPECT_EQ(fields("pair", {Json::array({"a", "b"})}).dump(), R"({"pair":["a","b"]})");
}

}  // namespace
}  // namespace kiln::cli
