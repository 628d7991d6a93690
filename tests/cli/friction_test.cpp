// Stumbling blocks: flags of other bakers, flags that serve nothing, misses without a place, maps of
// another mesh of the same name.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "cli/call.h"
#include "cli/command_scene.h"
#include "kiln/bake.h"
#include "support/pictures.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using test::call_kiln;
using test::expect_exit;
using test::make_scene;
using test::ProcessResult;
using Words = std::vector<std::string>;

/// `kiln bake` of the scene, without a run.
ProcessResult bake(const fs::path& scene, const Words& more) {
  Words words = {"bake", scene / "high.obj", scene / "low.obj", "--out", scene / "out", "--size",
                 "64"};
  words.insert(words.end(), more.begin(), more.end());
  return call_kiln(words);
}

void expect_refused(const ProcessResult& result, const Words& words) {
  expect_exit(result, 2, words);
  EXPECT_EQ(result.errors.find("did you mean"), std::string::npos) << result.errors;
}

/// Charts, ratings and galleries are run by a program of its own, which some builds leave out.
TEST(Friction, SaysWhereTheLabIsLookedForWhereItIsMissing) {
  const fs::path folder = test::scratch_folder();
  const fs::path alone = folder / "kiln";
  fs::copy_file(test::kiln_command(), alone);
  for (const Words& words : {Words{"chart", "a.obj"}, Words{"help", "chart"}}) {
    Words command = {alone};
    command.insert(command.end(), words.begin(), words.end());
    const ProcessResult result = test::run_process(command);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.errors.find("chart needs the program kiln-lab"), std::string::npos)
        << result.errors;
    EXPECT_NE(result.errors.find((folder / "kiln-lab").string()), std::string::npos)
        << result.errors;
    EXPECT_NE(result.errors.find("Install it beside kiln."), std::string::npos) << result.errors;
  }
}

TEST(Friction, AnswersFlagsOfOtherBakers) {
  for (const auto& [flag, remedy] : std::vector<std::pair<std::string, std::string>>{
           {"--udim", "--sets udim"},
           {"--udim=1001", "--sets udim"},
           {"--skew", "Add edges to LOW"},
           {"--explode", "--match-by name"},
           {"--bevel", "Bevel the edges of HIGH"},
           {"--denoise", "--samples"},
           {"--tile-size", "Leave the tile size out"},
           {"--margin", "--gutter"},
           {"--padding", "--gutter"},
           {"--extrusion", "--cage"},
           {"--max-ray-distance", "--max-distance"},
           {"--flip-green", "--flip-y"},
           {"--resolution", "--size"},
           {"--antialiasing", "--samples"},
           {"--ao", "a map: --maps ao"},
           {"--attenuation", "--ao-falloff"},
           {"--curvature", "a map: --maps curvature"},
           {"--height-map", "a map: --maps height"},
           {"--slope", "a map: --maps slope"},
           {"--color", "a map: --maps color"},
           {"--albedo", "--maps color"},
           {"--vertex-color", "a map: --maps vertex_color"},
           {"--displacement", "a map: --maps displacement"},
           {"--roughness", "--transfer mtl:roughness"},
           {"--ao-samples", "--ao-rays N"},
           {"--max-occluder-distance", "--ao-distance D"},
           {"--selected-to-active", "kiln bake HIGH LOW"},
           {"--max-frontal-ray-distance", "--max-distance"},
           {"--discard-back-faces-hits", "--two-sided"},
           {"--closest-hit-if-ray-fails", "--fallback closest"},
           {"--swizzle", "--flip-y"},
           {"--ao-spread", "--ao-rays N"},
           {"--ao-bias", "Leave the bias out"},
           {"--apply-diffusion", "--gutter inf"},
           {"--tangent-space", "MikkTSpace"},
           {"--bake-type", "--maps normal,ao"},
           {"--bits", "png16"},
           {"--average-normals", "--direction averaged"},
           {"--self-occlusion", "--part-occlusion own"},
           {"--world-space-normal", "--maps normal_object"},
           {"--normal-orientation", "--flip-y"},
           {"--paint-offset", "--cage-mesh FILE"},
           {"--overwrite", "--force"},
           {"-s", "--size N"},
           {"--ratio", "--faces N"},
           {"--miss", "--fallback closest,fill"},
           {"--closest", "a match: --match closest"}}) {
    const ProcessResult result = call_kiln({"bake", "a", "b", "--out", "c", flag});
    expect_refused(result, {"'" + flag.substr(0, flag.find('=')) + "'", remedy});
  }
}

TEST(Friction, SaysWhereDataOfChartsAre) {
  const ProcessResult result = call_kiln({"chart", "a", "b", "--out", "c", "--json", "d"});
  expect_refused(result, {"'--json'", "chart.json"});
}

/// No answer says that a map is missing which is there, or is about another map.
TEST(Friction, MapsByTheirNamesAreAnsweredAsMaps) {
  std::size_t answered = 0;
  for (const MapInfo& map : maps()) {
    std::string flag = "--" + std::string(map.kind.name);
    std::replace(flag.begin(), flag.end(), '_', '-');
    const ProcessResult result = call_kiln({"bake", "a", "b", "--out", "c", flag});
    if (result.errors.find("has no option") == std::string::npos) continue;  // a flag of its own
    expect_refused(result, {"--maps " + std::string(map.kind.name)});
    ++answered;
  }
  EXPECT_GT(answered, maps().size() / 2);
}

/// A path that names nothing would leave its flag to all maps and matches in silence.
TEST(Friction, OptionsOfMapsAndMatchesAreThere) {
  // BakeOptions has these, too; other flags fill them.
  std::string members = " bake.match.parts bake.match.cage_mesh bake.color bake.opacity";
  const ProcessResult help = call_kiln({"bake", "--help-json"});
  for (const nlohmann::json& row : nlohmann::json::parse(help.output)) {
    members += " " + row.at("member").get<std::string>();
  }
  const auto check = [&](std::string_view name, std::string_view options) {
    std::istringstream paths{std::string(options)};
    for (std::string path; paths >> path;) {
      EXPECT_TRUE(std::regex_search(members, std::regex(" bake\\." + path + "\\b")))
          << name << ": " << path;
    }
  };
  for (const MapInfo& map : maps()) check(map.kind.name, map.options);
  for (const MatchInfo& match : matches()) check(match.method.name, match.options);
}

TEST(Friction, SuggestsNoFlagThatIsNothingLikeIt) {
  const ProcessResult odd = call_kiln({"bake", "a", "b", "--out", "c", "--wax"});
  expect_refused(odd, {"'--wax'"});
  const ProcessResult typo = call_kiln({"bake", "a", "b", "--out", "c", "--sise", "64"});
  EXPECT_NE(typo.errors.find("did you mean --size?"), std::string::npos) << typo.errors;
}

TEST(Friction, NamesTheValueThatWasMeant) {
  for (const auto& [given, words] : std::vector<std::pair<Words, Words>>{
           {{"--maps", "cavity"}, {"'cavity'", "did you mean curvature?", "convexity"}},
           {{"--maps", "ambient-occlusion"}, {"did you mean ao?"}},
           {{"--maps", "world_normal"}, {"did you mean normal_object?"}},
           {{"--format", "pgn16"}, {"did you mean png16?", "png8"}},
           {{"--fallback", "none"}, {"did you mean mark?"}},
           {{"--maps", "shadow", "--light", "sun"}, {"--light 'sun'", "X,Y,Z"}},
           {{"--maps", ""}, {"--maps", "the value is empty", "curvature"}},
           {{"--match", "clsest"}, {"did you mean closest?"}},
           {{"--ao-rays", "many"}, {"--ao-rays is 'many'", "1 to 4096"}},
           {{"--ao-rays"}, {"--ao-rays has no value"}},
           {{"--out", "again"}, {"--out was given 2 times"}},
           {{"--maps", "normal", "ao"}, {"'ao' is one word too many", "normal,ao"}}}) {
    Words all = {"bake", "a", "b", "--out", "c"};
    all.insert(all.end(), given.begin(), given.end());
    expect_exit(call_kiln(all), 2, words);
  }
  expect_refused(call_kiln({"bake", "a", "b", "c"}), {"'c' is one word too many", "--out"});
  expect_refused(call_kiln({"bake", "--out", "c", "--", "-a", "b", "--quiet"}),
                 {"'--quiet' is one word too many", "all words after '--' are files"});
}

TEST(Friction, KnowsFlagsOfEveryCommandByOtherNames) {
  for (const auto& [given, ours] : std::vector<std::pair<Words, std::string>>{
           {{"render", "a", "--normal-map", "b"}, "--normal"},
           {{"render", "a", "--resolution", "512"}, "--size"},
           {{"render", "a", "--camera", "0,0"}, "--view"},
           {{"simplify", "a", "-o", "b.obj"}, "--out"},
           {{"simplify", "a", "--preserve-uvs", "--quiet"}, "--keep-uvs"},
           {{"volume", "a", "--threshold", "4"}, "--iso"},
           {{"diff", "a", "b", "--tolerance", "1"}, "--max-error"},
           {{"render", "a", "--azimuth", "30"}, "--view"},
           {{"simplify", "a", "--otu", "b.obj"}, "--out"},
           {{"bake", "a", "b", "--output-dir", "c"}, "--out"}}) {
    expect_exit(call_kiln(given), 2, {"has no option '" + given[given.size() - 2], ours + "?"});
  }
}

TEST(Friction, SaysWhatIsMissingAndWhichCommandWasMeant) {
  expect_refused(call_kiln({}), {"give a command", "kiln bake HIGH LOW --out DIR", "simplify"});
  expect_refused(call_kiln({"bake"}), {"HIGH is required: The high poly"});
  expect_refused(call_kiln({"bake", "a", "b"}), {"--out is required: Folder for the maps"});
  expect_exit(call_kiln({"bkae", "a"}), 2, {"no command 'bkae'", "did you mean kiln bake?"});
  expect_exit(call_kiln({"decimate", "a"}), 2, {"did you mean kiln simplify?"});
  expect_refused(call_kiln({"wax"}), {"no command 'wax'", "devices"});
  expect_exit(call_kiln({"version"}), 0, {});
  expect_refused(bake(make_scene(), {"--cage", "cage.obj"}), {"'cage.obj'", "--cage-mesh FILE"});
}

/// Names of other programs mean one map or match each, and none that is there.
TEST(Friction, OtherNamesAreOfOneRow) {
  std::vector<std::string> names;
  const auto take = [&](std::string_view name, std::string_view other_names) {
    names.emplace_back(name);
    std::istringstream words{std::string(other_names)};
    for (std::string word; words >> word;) names.push_back(word);
  };
  for (const MapInfo& map : maps()) take(map.kind.name, map.other_names);
  for (const MatchInfo& match : matches()) {
    // Two maps are called like the match that they look into.
    if (std::find(names.begin(), names.end(), match.method.name) == names.end()) {
      take(match.method.name, match.other_names);
    }
  }
  EXPECT_GT(names.size(), maps().size() + 20);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
}

/// Programs read the table of options that help is made of.
TEST(Friction, ListsOptionsForPrograms) {
  const ProcessResult listed = call_kiln({"bake", "--help-json"});
  ASSERT_EQ(listed.exit_code, 0) << listed.errors;
  const nlohmann::json rows = nlohmann::json::parse(listed.output);
  const std::string help = call_kiln({"bake", "--help"}).output;
  std::vector<std::string> names;
  for (const auto& row : rows) {
    names.push_back(row["name"]);
    EXPECT_NE(help.find(row["help"].get<std::string>()), std::string::npos) << row;
    EXPECT_FALSE(row["member"].get<std::string>().empty()) << row;
  }
  const auto row = [&](const char* name) {
    return rows.at(
        static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin()));
  };
  EXPECT_EQ(row("samples")["member"], "bake.samples");
  EXPECT_EQ(row("samples")["range"], nlohmann::json::array({1, 16}));
  EXPECT_EQ(row("samples")["default"], BakeOptions().samples);
  EXPECT_EQ(row("gutter")["unit"], "texels");
  EXPECT_EQ(row("view-criterion")["choices"], (Words{"angle", "depth", "distance"}));
  EXPECT_EQ(row("view-criterion")["matches"], Words{"views"});
  EXPECT_EQ(row("id-by")["maps"], Words{"id"});
  EXPECT_TRUE(row("samples")["maps"].is_null());
  EXPECT_EQ(row("HIGH")["required"], true);
}

TEST(Friction, SaysWhatExcludesAndNeedsWhat) {
  expect_refused(call_kiln({"bake", "a", "b", "--out", "c", "--cage", "1%", "--cage-mesh", "d"}),
                 {"--cage-mesh and --cage exclude each other", "leave one of them out"});
  expect_refused(call_kiln({"simplify", "a", "--out", "b.obj", "--keep-parts"}),
                 {"--keep-parts needs --faces", "add it"});
  expect_refused(call_kiln({"bake", "a", "b", "--out", "c", "--flip-y=maybe"}),
                 {"--flip-y takes no value"});
  const auto volume = [](std::vector<std::string> more) {
    more.insert(more.begin(), {"volume", "a.nrrd", "--out", "b", "--iso", "1"});
    return call_kiln(more);
  };
  for (const auto& [flag, value, other] :
       {std::tuple("--outer-gap", "1", "--outer"), std::tuple("--raw-type", "u8", "--raw-size"),
        std::tuple("--raw-spacing", "1,1,1", "--raw-size")}) {
    expect_refused(volume({flag, value}),
                   {std::string(flag) + " needs " + other + ": add it, or leave " + flag + " out"});
  }
  expect_refused(volume({"--faces", "9", "--error", "1"}),
                 {"--error and --faces exclude each other: leave one of them out"});
  // A flag without a value may be given again, as scripts do.
  const ProcessResult twice = volume({"--outer", "--outer", "--quiet", "--quiet"});
  EXPECT_EQ(twice.errors.find(" times"), std::string::npos) << twice.errors;
}

TEST(Friction, TakesNamesInCapitalsAndWithBlanks) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const ProcessResult done = bake(scene, {"--maps", "AO, Mask", "--format", "PNG8", "--ao-rays",
                                          "8", "--ao-error", "9/255", "--json", scene / "r.json"});
  ASSERT_EQ(done.exit_code, 0) << done.errors;
  EXPECT_TRUE(fs::exists(scene / "out" / "low_ao.png"));
  EXPECT_TRUE(fs::exists(scene / "out" / "low_mask.png"));
  std::ifstream file(scene / "r.json");
  const nlohmann::json report = nlohmann::json::parse(file);
  EXPECT_EQ(report["options"]["ao_error"], 9.0 / 255);
  EXPECT_EQ(report["options"]["miss"], "low");
}

TEST(Friction, NamesTheLinkToNothing) {
  const fs::path scene = make_scene();
  fs::create_symlink("gone", scene / "out");
  expect_exit(bake(scene, {}), 5,
              {scene / "out", "symbolic link to 'gone'", "create '" + (scene / "gone").string()});
  // Once it is there, all is well.
  fs::create_directory(scene / "gone");
  EXPECT_NE(bake(scene, {"--maps", "mask"}).exit_code, 5);
}

TEST(Friction, SaysWhereTheMeshesAreTheWrongWayRound) {
  const fs::path scene = make_scene();
  expect_exit(call_kiln({"bake", scene / "low.obj", scene / "high.obj", "--out", scene / "out"}), 3,
              {"HIGH first, LOW second"});
}

TEST(Friction, ANegatedFlagIsTheDefault) {
  for (const std::string flag : {"flip-y", "mips", "two-sided", "raw", "quiet"}) {
    expect_refused(call_kiln({"bake", "a", "b", "--out", "c", "--no-" + flag}),
                   {"Without --" + flag, "default", "leave --no-" + flag + " out"});
  }
  expect_refused(call_kiln({"bake", "a", "b", "--out", "c", "--no-gutter"}),
                 {"Leave --gutter out", "value"});
  expect_refused(call_kiln({"render", "a", "--out", "b.png", "--no-flat"}), {"Without --flat"});
}

TEST(Friction, AFlagThatServesNothingIsRefusedAtItsDefaultToo) {
  const fs::path scene = make_scene();
  for (const auto& [given, words] : std::vector<std::pair<Words, Words>>{
           {{"--views", "12"}, {"--views is for --match views", "--fallback views"}},
           {{"--view-criterion", "angle"}, {"--view-criterion is for --match views"}},
           {{"--no-view-refine"}, {"--no-view-refine is for --match views"}},
           {{"--directions", "512"}, {"--directions is for --match visibility or hybrid"}},
           {{"--visibility-at", "texel"}, {"--match visibility"}},
           {{"--view-weight", "all"}, {"--match visibility"}},
           {{"--visibility-clusters", "1"}, {"--match visibility: leave it out"}},
           {{"--match", "visibility", "--visibility-deviation", "0.8"}, {"--visibility-clusters"}},
           {{"--match", "visibility", "--visibility-at", "face", "--visibility-smooth", "4"},
            {"--visibility-at texel"}},
           {{"--match", "visibility", "--visibility-test", "rays", "--visibility-size", "256"},
            {"--visibility-size"}},
           {{"--match", "uv", "--max-distance", "2%"}, {"--max-distance is for", "--fallback ray"}},
           {{"--match", "closest", "--cage", "2%"},
            {"--cage is for --match ray", "--fallback ray"}},
           {{"--force-uv"}, {"--force-uv is for --match uv: leave it out"}},
           {{"--fallback-blend", "0"}, {"--fallback-blend needs a --fallback"}},
           {{"--load-match", "a.exr", "--max-distance", "2%"}, {"--max-distance", "--load-match"}},
           {{"--load-match", "a.exr", "--fallback", "ray"}, {"--fallback", "--load-match"}},
           {{"--maps", "mask", "--flip-y"}, {"--flip-y is for --maps normal"}},
           {{"--maps", "height", "--space", "tangent"}, {"--space is for --maps normal"}},
           {{"--maps", "mask", "--gutter", "16"}, {"--gutter is for --maps"}},
           {{"--height", "1"}, {"--height", "--maps height"}}}) {
    expect_refused(bake(scene, given), words);
  }
  EXPECT_FALSE(fs::exists(scene / "out"));
}

TEST(Friction, QuietKeepsWarnings) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const ProcessResult loud = bake(scene, {"--max-distance", "0.5%"});
  ASSERT_EQ(loud.exit_code, 0) << loud.errors;
  EXPECT_NE(loud.output.find("wrote"), std::string::npos);
  EXPECT_NE(loud.errors.find("warning: "), std::string::npos);
  EXPECT_TRUE(test::only_warnings(loud.errors)) << loud.errors;
  const ProcessResult quiet = bake(scene, {"--max-distance", "0.5%", "--quiet"});
  ASSERT_EQ(quiet.exit_code, 0) << quiet.errors;
  EXPECT_EQ(quiet.output, "");
  EXPECT_EQ(quiet.errors, loud.errors);
  const ProcessResult help = call_kiln({"bake", "--help"});
  EXPECT_NE(help.output.find("warnings"), std::string::npos);
}

TEST(Friction, MissesNameTheFileAndAPlace) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const ProcessResult result = bake(scene, {"--max-distance", "0.5%", "--maps", "normal,mask",
                                            "--max-missed", "1", "--json", scene / "report.json"});
  EXPECT_EQ(result.exit_code, 1) << result.errors;
  const std::size_t at = result.errors.find("kiln: ");
  ASSERT_NE(at, std::string::npos) << result.errors;
  for (const std::string& text : {result.errors.substr(0, at), result.errors.substr(at)}) {
    for (const char* word : {"low.obj'", "%", "largest missed patch", "--max-distance"}) {
      EXPECT_NE(text.find(word), std::string::npos) << word << " in " << text;
    }
  }
  EXPECT_NE(result.errors.find("--max-missed is 1"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("--fallback closest"), std::string::npos) << result.errors;

  // The place is one that was missed, on the unit sphere (its faces lie a little inside).
  std::smatch place;
  const std::string last = result.errors.substr(at);
  ASSERT_TRUE(
      std::regex_search(last, place,
                        std::regex("column (\\d+), row (\\d+), UV \\(([^,]+), ([^)]+)\\), position "
                                   "\\(([^,]+), ([^,]+), ([^)]+)\\)")))
      << last;
  const auto column = static_cast<std::uint32_t>(std::stoul(place[1]));
  const auto row = static_cast<std::uint32_t>(std::stoul(place[2]));
  EXPECT_NEAR(std::stod(place[3]), (column + 0.5) / 64, 1e-3);
  EXPECT_NEAR(std::stod(place[4]), 1 - (row + 0.5) / 64, 1e-3);
  double squared = 0;
  for (std::size_t k = 5; k < 8; ++k) squared += std::stod(place[k]) * std::stod(place[k]);
  EXPECT_NEAR(squared, 1, 0.05);
  const Image mask = test::read_picture(scene / "out" / "low_mask.png");
  ASSERT_EQ(mask.width, 64U);
  EXPECT_EQ(mask.at(column, row)[0], 0.0F);

  // The report has the same.
  std::ifstream stream(scene / "report.json");
  const nlohmann::json report = nlohmann::json::parse(stream);
  bool warned = false;
  for (const auto& warning : report["warnings"]) {
    if (warning["code"] != "many-misses") continue;
    warned = true;
    EXPECT_NE(warning["message"].get<std::string>().find("low.obj"), std::string::npos);
  }
  EXPECT_TRUE(warned);
}

TEST(Friction, OneCauseIsOneWarning) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const ProcessResult result =
      bake(scene, {"--cage", "4%", "--max-distance", "3.5%", "--json", scene / "report.json"});
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.errors.find("twice --cage"), std::string::npos) << result.errors;
  EXPECT_EQ(result.errors.find("found no point"), std::string::npos) << result.errors;
  std::ifstream stream(scene / "report.json");
  const nlohmann::json report = nlohmann::json::parse(stream);
  std::vector<std::string> codes;
  for (const auto& warning : report["warnings"]) codes.push_back(warning["code"]);
  EXPECT_EQ(std::count(codes.begin(), codes.end(), "short-rays"), 1);
  if (report["texels"]["missed"].get<double>() > 0.02 * report["texels"]["samples"].get<double>()) {
    EXPECT_EQ(std::count(codes.begin(), codes.end(), "many-misses"), 1);
  }
}

TEST(Friction, MapsOfAnotherLowOfTheSameNameStay) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  for (const char* folder : {"a", "b"}) {
    fs::create_directory(scene / folder);
    fs::copy_file(scene / "low.obj", scene / folder / "x.obj");
  }
  const fs::path out = scene / "o";
  const auto of = [&](const char* folder, const Words& more) {
    Words words = {"bake",
                   scene / "high.obj",
                   scene / folder / "x.obj",
                   "--size",
                   "32",
                   "--out",
                   out,
                   "--max-distance",
                   "10%"};
    words.insert(words.end(), more.begin(), more.end());
    return call_kiln(words);
  };
  ASSERT_EQ(of("a", {}).exit_code, 0);
  ASSERT_EQ(of("a", {"--flip-y"}).exit_code, 0) << "its own maps are written again";
  const auto written = fs::last_write_time(out / "x_normal.png");
  expect_refused(of("b", {}), {"x_normal.png", "a/x.obj", "b/x.obj", "--out", "--force"});
  EXPECT_EQ(fs::last_write_time(out / "x_normal.png"), written);
  expect_refused(of("b", {"--maps", "mask"}), {"x_normal.png"});
  ASSERT_EQ(of("b", {"--force"}).exit_code, 0);
  EXPECT_EQ(of("b", {}).exit_code, 0);
  expect_refused(of("a", {}), {"b/x.obj"});
  // A file that is gone may have been renamed.
  fs::remove(scene / "b" / "x.obj");
  EXPECT_EQ(of("a", {}).exit_code, 0);
  // Both moved together: still its own.
  fs::create_directory(scene / "moved");
  for (const char* name : {"a", "o"}) fs::rename(scene / name, scene / "moved" / name);
  EXPECT_EQ(call_kiln({"bake", scene / "high.obj", scene / "moved" / "a" / "x.obj", "--size", "32",
                       "--out", scene / "moved" / "o", "--max-distance", "10%"})
                .exit_code,
            0);
}

TEST(Friction, ALowPolyThatKilnMadeIsOneWithItsMaps) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_scene();
  const std::string high = scene / "high.obj";
  const fs::path out = scene / "o";
  ASSERT_EQ(call_kiln({"bake", high, "--out", out, "--faces", "200", "--size", "64"}).exit_code, 0);
  EXPECT_EQ(call_kiln({"bake", high, out / "high_low.obj", "--out", out, "--size", "64"}).exit_code,
            0);
}

TEST(Friction, HelpNamesTheOlderFlagAndWhatTheMaskIsFor) {
  const ProcessResult help = call_kiln({"bake", "--help"});
  EXPECT_NE(help.output.find("older name"), std::string::npos);
  EXPECT_NE(help.output.find("composites"), std::string::npos);
}

}  // namespace
}  // namespace kiln
