// Job files: layers, what is found, and what is refused with its line.
#include "batch/job_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "batch/assets.h"
#include "batch/batch_scene.h"
#include "batch/schema_check.h"
#include "cli/call.h"
#include "job/files.h"
#include "job/job_options.h"
#include "kiln/error.h"
#include "kiln/options.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

Batch expand(const fs::path& folder, const std::string& text, const std::string& profile = {},
             ExpandOptions options = {}) {
  write(folder / "job.toml", text);
  return expand_job_file(read_job_file(folder / "job.toml", profile), options);
}

/// The message of what it throws; empty: nothing.
template <typename Function>
std::string message_of(const Function& function) {
  try {
    function();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::usage) << error.what();
    return error.what();
  }
  return {};
}

std::string refused(const std::string& text, const std::string& profile = {}) {
  return message_of([&] { parse_job_file(text, "job.toml", profile); });
}

void expect_words(const std::string& message, const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    EXPECT_NE(message.find(word), std::string::npos) << "'" << word << "' in: " << message;
  }
}

const std::string kGood = "[[bake]]\nhigh = \"a.obj\"\n";

TEST(JobFile, RefusesWhatIsWrongWithItsLine) {
  const struct {
    std::string text;
    std::vector<std::string> words;
  } cases[] = {
      {"", {"job.toml", "no [[bake]]"}},
      {"[[bake]]\nlow = \"a.obj\"\n", {"job.toml:1", "high is missing"}},
      {"bake = 3\n", {"job.toml:1", "[[bake]]"}},
      {"[bake]\nhigh = \"a.obj\"\n", {"job.toml:1", "[[bake]]"}},
      {kGood + "[deafults]\nsize = 3\n", {"job.toml:3", "deafults", "did you mean defaults?"}},
      {kGood + "sise = 512\n", {"job.toml:3", "sise", "did you mean size?"}},
      {kGood + "size = 0\n", {"job.toml:3", "size"}},
      {kGood + "size = \"big\"\n", {"job.toml:3", "size", "big"}},
      {kGood + "size = nan\n", {"job.toml:3", "size", "nan"}},
      {kGood + "max_missed = nan\n", {"job.toml:3", "max_missed"}},
      {kGood + "max_missed = -inf\n", {"job.toml:3", "max_missed"}},
      {kGood + "size = 2020-01-01\n", {"job.toml:3", "size", "a date"}},
      {kGood + "size = []\n", {"job.toml:3", "size", "empty"}},
      {kGood + "size = [[8]]\n", {"job.toml:3", "size", "a list"}},
      {kGood + "samples = [1, 2]\n", {"job.toml:3", "samples"}},
      {kGood + "samples = 1.5\n", {"job.toml:3", "samples", "1.5"}},
      {kGood + "flip_y = \"yes\"\n", {"job.toml:3", "flip_y"}},
      {kGood + "maps = [\"normals\", \"aoo\"]\n", {"job.toml:3", "maps", "did you mean normal?"}},
      {kGood + "max-distance = \"2%\"\nmax_distance = \"3%\"\n", {"job.toml:4", "line 3"}},
      {kGood + "device = \"0\"\n", {"job.toml:3", "kiln run --device"}},
      {kGood + "cage = { fil = \"x\" }\n", {"job.toml:3", "cage"}},
      {kGood + "cage = { file = \"x\", optinal = true }\n",
       {"job.toml:3", "optinal", "did you mean optional?"}},
      {kGood + "cage = { file = \"x\", optional = 1 }\n",
       {"job.toml:3", "optional", "true or false"}},
      {kGood + "low = { file = \"x\", optional = true }\n", {"job.toml:3", "low"}},
      {kGood + "skip = 3\n", {"job.toml:3", "skip", "patterns"}},
      {kGood + "skip = [\"{a\"]\n", {"job.toml:3", "skip"}},
      {kGood + "retries = -1\n", {"job.toml:3", "retries"}},
      {kGood + "timeout = 0\n", {"job.toml:3", "timeout"}},
      {kGood + "timeout = nan\n", {"job.toml:3", "timeout"}},
      {kGood + "out = \"\"\n", {"job.toml:3", "out", "empty"}},
      {kGood + "out = \"a\\u0000b\"\n", {"job.toml:3", "out"}},
      // Backslashes of Windows: escapes that TOML doesn't know, a line break, a tab.
      {kGood + "out = \"maps\\dew\"\n", {"job.toml:3", "escape", "single quotes"}},
      {kGood + "out = \"maps\\new\"\n", {"job.toml:3", "out", "single quotes"}},
      {kGood + "out = \"maps\\teapot\"\n", {"job.toml:3", "out", "single quotes"}},
      {kGood + "[defaults]\nhigh = \"a.obj\"\n", {"job.toml:4", "[[bake]]"}},
      {kGood + "[profile.ci]\nsiez = 3\n", {"job.toml:4", "size"}},
      {kGood + "[check]\ngoldn = \"x\"\n", {"job.toml:4", "golden"}},
      {kGood + "[check]\nlimits = { mised = 1 }\n", {"job.toml:4", "missed"}},
      {kGood + "[check]\nlimits = { normal.maen = 1 }\n", {"job.toml:4", "mean"}},
      {kGood + "[check]\nlimits = { missed = \"much\" }\n", {"job.toml:4", "much"}},
      {kGood + "[check]\nlimits = { missed = nan }\n", {"job.toml:4", "nan"}},
      {"kiln = \">=99\"\n" + kGood + "unknown = 1\n", {"job.toml:1", ">=99"}},
      {"kiln = \"new\"\n" + kGood, {"job.toml:1", "new"}},
      {"kiln = 3\n" + kGood, {"job.toml:1", "kiln"}},
      {kGood + "size = 5\nsize = 6\n", {"job.toml:4"}},
      {kGood + "size = \n", {"job.toml:3"}},
      {"a" + std::string(50, '.') + "\n", {"job.toml:1"}},
      {std::string(100000, '[') + "\n", {"job.toml:1"}},
      {"\xff\xfe\n", {"job.toml:1"}},
      {"[[bake]]\xCA\xA2\n", {"job.toml:1"}},  // U+02A2, for which toml++ has no case
  };
  for (const auto& [text, words] : cases) {
    const std::string message = refused(text);
    EXPECT_NE(message, "") << text;
    expect_words(message, words);
  }
  std::string deep = "a";
  for (int i = 0; i < 1000000; ++i) deep += ".a";
  expect_words(refused(deep + " = 1\n"), {"job.toml:1", "parts"});
  EXPECT_EQ(refused("kiln = \">=0.1, <100\"\n" + kGood), "");
  EXPECT_EQ(refused(kGood + "gutter = inf\n"), "");
  EXPECT_EQ(refused(kGood + "note = 1\n") == "", false);
  expect_words(refused(kGood + "[profile.ci]\nsize = 8\n", "cii"), {"cii", "did you mean ci?"});
}

TEST(JobFile, RefusesFilesThatAreTooLong) {
  const fs::path path = scratch_folder() / "job.toml";
  {
    std::ofstream file(path);
    file << kGood;
    file.seekp(100 << 20);
    file << "#";
  }
  try {
    read_job_file(path, "");
    ADD_FAILURE() << "was read";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    expect_words(error.what(), {"longer than 16 MiB"});
  }
  // Memory is taken for the file's size, not for the limit.
  {
    std::ofstream file(path);
    file << kGood;
  }
  EXPECT_EQ(read_small_file(path, std::size_t{1} << 46, "It"), kGood);
}

TEST(JobFile, PairsFilesByCaptures) {
  const fs::path folder = make_studio({"props/crate", "props/old/barrel", "rock", "wip/deep/new"});
  write(folder / "assets/props/crate_low.mtl", "");
  write(folder / "assets/rock_cage.obj", "");
  save_obj(BumpySphere::dense(700), folder / "assets/rock_high_b.obj");
  const Batch batch = expand(folder, kStudioJob);
  ASSERT_EQ(batch.assets.size(), 3U);
  EXPECT_TRUE(batch.warnings.empty()) << batch.warnings[0].message.text();
  std::vector<std::string> names;
  for (const BatchAsset& asset : batch.assets) names.push_back(asset.name);
  EXPECT_EQ(names, (std::vector<std::string>{"props/crate", "props/old/barrel", "rock"}));
  const Job& rock = batch.assets[2].job;
  EXPECT_EQ(high_files(rock), (std::vector<std::string>{folder / "assets/rock_high.obj",
                                                        folder / "assets/rock_high_b.obj"}));
  EXPECT_EQ(low_files(rock), std::vector<std::string>{folder / "assets/rock_low.obj"});
  EXPECT_EQ(rock.out, (folder / "out/rock").string());
  EXPECT_EQ(rock.cage_mesh, (folder / "assets/rock_cage.obj").string());
  EXPECT_EQ(batch.assets[0].job.cage_mesh, "");
  EXPECT_EQ(batch.assets[0].job.out, (folder / "out/props/crate").string());
  EXPECT_EQ(rock.bake.width, 16U);
}

TEST(JobFile, LayersGoBeforeOthersInTheirOrder) {
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "assets/a_low.kiln.toml", "samples = 3\nskip = false\nmaps = \"ao\"\n");
  const std::string text = R"([defaults]
size = 16
samples = 1
gutter = 1
cage = "5%"
light = "0,1,0"
ao_rays = 8
out = "out/{name}"
[profile.ci]
size = 8
gutter = 2
samples = 2
[[bake]]
low = "assets/{name}_low.obj"
high = "assets/{name}_high.obj"
size = 32
cage_mesh = "assets/{name}_cage.obj"
)";
  write(folder / "assets/a_cage.obj", "");
  write(folder / "assets/b_cage.obj", "");
  ExpandOptions options;
  options.command_line.settings.push_back({"ao_rays", {"9"}, false, {"command line", "", 0}, ""});
  const Batch batch = expand(folder, text, "ci", options);
  ASSERT_EQ(batch.assets.size(), 2U);
  const Job &a = batch.assets[0].job, &b = batch.assets[1].job;
  EXPECT_EQ(a.bake.width, 32U);          // bake before profile
  EXPECT_EQ(a.bake.encoding.gutter, 2);  // profile before defaults
  EXPECT_EQ(a.bake.samples, 3U);         // sidecar before all of the file
  EXPECT_EQ(b.bake.samples, 2U);
  EXPECT_EQ(a.bake.occlusion.rays, 9U);  // command line before all
  // What no map obeys is left out where it is said for all bakes, and refused where it is said for one.
  EXPECT_FALSE(b.given.contains("--ao-rays"));
  EXPECT_FALSE(b.given.contains("--light"));
  // What excludes another option replaces it.
  EXPECT_FALSE(a.bake.match.cage);
  EXPECT_NE(a.cage_mesh, "");
  const auto origin = [&](const char* key) {
    for (const Setting& setting : batch.assets[0].settings) {
      if (setting.key == key)
        return setting.origin.layer + " " + std::to_string(setting.origin.line);
    }
    return std::string();
  };
  EXPECT_EQ(origin("size"), "bake 16");
  EXPECT_EQ(origin("gutter"), "profile.ci 11");
  EXPECT_EQ(origin("samples"), "sidecar 1");
  EXPECT_EQ(origin("ao_rays"), "command line 0");
}

/// Of all layers that set an option, in any combination of them, the last in their order counts.
TEST(JobFile, TheLastLayerCountsInEveryCombination) {
  const fs::path folder = make_studio({"a"});
  constexpr unsigned kLayers = 5;  // defaults, profile, bake, sidecar, command line
  for (unsigned layers = 1; layers < 1U << kLayers; ++layers) {
    const auto line_of = [&](unsigned layer) {
      return (layers >> layer & 1U) != 0 ? "samples = " + std::to_string(layer + 2) + "\n" : "";
    };
    const fs::path sidecar = folder / "assets/a_low.kiln.toml";
    fs::remove(sidecar);
    if ((layers >> 3U & 1U) != 0) write(sidecar, line_of(3));
    ExpandOptions options;
    if ((layers >> 4U & 1U) != 0) {
      options.command_line.settings.push_back(
          {"samples", {"6"}, false, {"command line", "", 0}, ""});
    }
    const Batch batch = expand(folder,
                               "[defaults]\nout = \"out/{name}\"\n" + line_of(0) +
                                   "[profile.ci]\nsize = 8\n" + line_of(1) +
                                   "[[bake]]\nlow = \"assets/{name}_low.obj\"\nhigh = "
                                   "\"assets/{name}_high.obj\"\n" +
                                   line_of(2),
                               "ci", options);
    ASSERT_EQ(batch.assets.size(), 1U);
    EXPECT_EQ(batch.assets[0].job.bake.samples, std::bit_width(layers) + 1U) << layers;
  }
}

TEST(JobFile, SidecarsThatServeNothingAreTold) {
  const fs::path folder = make_studio({"a"});
  write(folder / "assets/a_lwo.kiln.toml", "size = 4\n");
  const Batch batch = expand(folder, kStudioJob);
  ASSERT_EQ(batch.warnings.size(), 1U);
  EXPECT_EQ(batch.warnings[0].code, "unused-sidecar");
  // A file without patterns is of one asset, and says nothing about others.
  const char* const one =
      "[[bake]]\nlow = \"assets/a_low.obj\"\nhigh = \"assets/a_high.obj\"\nout = \"out\"\n";
  EXPECT_TRUE(expand(folder, one).warnings.empty());
  write(folder / "assets/a.kiln.toml", "size = 4\n");
  EXPECT_EQ(expand(folder, kStudioJob).assets[0].job.bake.width, 4U);
  write(folder / "assets/a_low.kiln.toml", "size = 5\n");
  expect_words(message_of([&] { expand(folder, kStudioJob); }), {"sidecars of one asset"});
  fs::remove(folder / "assets/a.kiln.toml");
  write(folder / "assets/a_low.kiln.toml", "\nsiez = 5\n");
  expect_words(message_of([&] { expand(folder, kStudioJob); }), {"a_low.kiln.toml:2", "size"});
}

/// Whichever of two options names the other in its row, the later layer's wins.
TEST(JobFile, OptionsReplaceThoseThatExcludeThem) {
  const fs::path folder = make_studio({"a"});
  write(folder / "cage.obj", "");
  write(folder / "match.exr", "");
  const std::string files =
      "[[bake]]\nlow = \"assets/{name}_low.obj\"\nhigh = \"assets/{name}_high.obj\"\n"
      "out = \"out\"\n";
  const std::pair<std::string, std::string> cages{"cage_mesh = \"cage.obj\"\n", "cage = 0.1\n"};
  const std::pair<std::string, std::string> matches{"load_match = \"match.exr\"\n",
                                                    "save_match = \"saved.exr\"\n"};
  const auto job = [&](const std::string& earlier, const std::string& later) {
    return expand(folder, "[defaults]\n" + earlier + files + later).assets[0].job;
  };
  EXPECT_EQ(job(cages.first, cages.second).cage_mesh, "");
  EXPECT_TRUE(job(cages.first, cages.second).bake.match.cage);
  EXPECT_NE(job(cages.second, cages.first).cage_mesh, "");
  EXPECT_FALSE(job(cages.second, cages.first).bake.match.cage);
  EXPECT_EQ(job(matches.first, matches.second).load_match, "");
  EXPECT_NE(job(matches.first, matches.second).save_match, "");
  EXPECT_NE(job(matches.second, matches.first).load_match, "");
  EXPECT_EQ(job(matches.second, matches.first).save_match, "");
}

/// Within one layer neither wins, in whichever order they are written: both are named.
TEST(JobFile, OptionsOfOneLayerThatExcludeEachOtherAreRefused) {
  const fs::path folder = make_studio({"a"});
  write(folder / "cage.obj", "");
  write(folder / "match.exr", "");
  const std::string bake =
      "[[bake]]\nlow = \"assets/{name}_low.obj\"\nhigh = \"assets/{name}_high.obj\"\n"
      "out = \"out\"\n";
  const struct {
    std::string one, other;
    std::vector<std::string> words;
  } cases[] = {
      {"cage = 0.1\n", "cage_mesh = \"cage.obj\"\n", {"`cage_mesh` and `cage` exclude each other"}},
      {"save_match = \"saved.exr\"\n",
       "load_match = \"match.exr\"\n",
       {"`load_match` and `save_match` exclude each other"}},
  };
  for (const auto& pair : cases) {
    for (const std::string& lines : {pair.one + pair.other, pair.other + pair.one}) {
      SCOPED_TRACE(lines);
      expect_words(message_of([&] { expand(folder, bake + lines); }), pair.words);
      expect_words(message_of([&] { expand(folder, "[defaults]\n" + lines + bake); }), pair.words);
      write(folder / "assets/a_low.kiln.toml", lines);
      expect_words(message_of([&] { expand(folder, bake); }), pair.words);
      fs::remove(folder / "assets/a_low.kiln.toml");
    }
  }
}

TEST(JobFile, TellsWhatIsLeftWithoutAPair) {
  const fs::path folder = make_studio({"a", "b"});
  fs::remove(folder / "assets/b_low.obj");
  Batch batch = expand(folder, kStudioJob);
  ASSERT_EQ(batch.warnings.size(), 1U);
  EXPECT_EQ(batch.warnings[0].code, "unpaired-high");
  save_obj(BumpySphere::light(), folder / "assets/c_low.obj");
  batch = expand(folder, kStudioJob);
  ASSERT_EQ(batch.assets.size(), 2U);
  EXPECT_EQ(batch.assets[0].problem, "");
  expect_words(batch.assets[1].problem, {"no high", "c_high"});
}

TEST(JobFile, RefusesOutputsThatMeet) {
  const fs::path folder = make_studio({"a", "b"});
  const auto bake = [&](const std::string& more) {
    return message_of([&] {
      expand(
          folder,
          "[[bake]]\nlow = \"assets/{name}_low.obj\"\nhigh = \"assets/{name}_high.obj\"\n" + more);
    });
  };
  expect_words(bake("out = \"game.glb\"\n"), {"job.toml:4", "'a' and 'b'", "both write"});
  // Stems tell files of one folder apart.
  EXPECT_EQ(bake("out = \"maps\"\n"), "");
  const std::string second =
      "[[bake]]\nlow = \"assets/{name}_low.obj\"\nhigh = \"assets/{name}_high.obj\"\n";
  expect_words(bake("out = \"o/{name}\"\n" + second + "out = \"o/{name}\"\n"),
               {"job.toml:3)", "job.toml:7)", "both write"});
  expect_words(bake(""), {"job.toml:3", "no output"});
  expect_words(bake("out = \"../out\"\n"), {"job.toml:4", "outside", "--allow-outside"});
  expect_words(bake("out = \"/tmp/{name}\"\n"), {"job.toml:4", "outside"});
  expect_words(bake("out = \"out/{nmae}\"\n"), {"job.toml:4", "did you mean {name}?"});
  expect_words(bake("out = \"out\"\nsave_match = \"m.exr\"\n"), {"both write", "m.exr"});
  // What the next run would take for an input.
  expect_words(bake("out = \"assets/{name}_x.glb\"\n[[bake]]\nhigh = \"assets/{name}.glb\"\nout = "
                    "\"out/{name}\"\n"),
               {"job.toml:6", "no file matches"});
  save_obj(BumpySphere::dense(600), folder / "assets/c.obj");
  expect_words(message_of([&] {
                 expand(folder,
                        "[[bake]]\nhigh = \"assets/{name}.obj\"\nfaces = 40\nout = "
                        "\"assets/{name}_game.obj\"\n");
               }),
               {"job.toml:2", "matches this pattern"});
  // Unless that rule skips it; another rule's `skip` does not count.
  const std::string into_assets =
      "[[bake]]\nhigh = \"assets/{name}.obj\"\nfaces = 40\nout = \"assets/{name}_game.obj\"\n";
  const std::string skip = "skip = [\"assets/*_game.obj\"]\n";
  EXPECT_EQ(message_of([&] { expand(folder, into_assets + skip); }), "");
  expect_words(message_of([&] {
                 expand(folder, into_assets + "[[bake]]\nhigh = \"assets/c*.obj\"\nfaces = 40\n" +
                                    "out = \"out/c_game.obj\"\n" + skip);
               }),
               {"job.toml:2", "matches this pattern"});
  // A link out of the folder is outside.
  fs::create_directory_symlink("/tmp", folder / "link");
  expect_words(bake("out = \"link/{name}\"\n"), {"outside"});
  ExpandOptions allowed;
  allowed.allow_outside = true;
  EXPECT_EQ(expand(folder,
                   "[[bake]]\nlow = \"assets/{name}_low.obj\"\nhigh = "
                   "\"assets/{name}_high.obj\"\nout = \"../out\"\n",
                   "", allowed)
                .assets.size(),
            2U);
}

TEST(JobFile, RefusesPatternsThatMatchNothingOrTooMuch) {
  const fs::path folder = make_studio({"a"});
  const auto bake = [&](const std::string& text) {
    return message_of([&] { expand(folder, "[[bake]]\nout = \"out/{name}\"\n" + text); });
  };
  expect_words(bake("high = \"scans/{name}.glb\"\n"), {"job.toml:3", "no file matches"});
  expect_words(bake("high = \"nowhere.glb\"\n"), {"job.toml:3", "there is no file"});
  expect_words(bake("high = \"assets/{name}_high.obj\"\nlow = \"assets/{other}_low.obj\"\n"),
               {"job.toml:3", "{name}", "is not captured"});
  expect_words(bake("high = \"{dir}/../{name}_high.obj\"\n"), {"job.toml:3", "after a capture"});
  // One mesh in two formats would be baked as two.
  save_obj(BumpySphere::light(), folder / "assets/a_low.ply");
  expect_words(bake("high = \"assets/{name}_high.obj\"\nlow = \"assets/{name}_low.*\"\n"),
               {"job.toml:4", "two formats"});
}

TEST(JobFile, CodeNeedsAWord) {
  const fs::path folder = make_studio({"a"});
  write(folder / "steep.cl", "");
  const std::string text =
      "[[bake]]\nhigh = \"assets/a_high.obj\"\nlow = \"assets/a_low.obj\"\nout = \"out\"\n";
  expect_words(message_of([&] { expand(folder, text + "maps = [\"steep=steep.cl\"]\n"); }),
               {"job.toml:5", "--allow-own-maps"});
  ExpandOptions allowed;
  allowed.allow_own_maps = true;
  EXPECT_EQ(
      expand(folder, text + "maps = [\"steep=steep.cl\"]\n", "", allowed).assets[0].job.own_maps[0],
      "steep=" + (folder / "steep.cl").string());
  write(folder / "assets/a.kiln.toml", "");
  write(folder / "assets/a_low.kiln.toml", "maps = [\"steep=../steep.cl\"]\n");
  fs::remove(folder / "assets/a.kiln.toml");
  expect_words(message_of([&] { expand(folder, text); }),
               {"a_low.kiln.toml:1", "--allow-own-maps"});
  fs::remove(folder / "assets/a_low.kiln.toml");
  expect_words(message_of([&] { expand(folder, text + "before = \"true\"\n"); }),
               {"job.toml:5", "--allow-hooks"});
}

TEST(JobFile, PathsOfAllOptionsBeginAtTheFile) {
  // Each row whose help shows a file is known to path_access().
  for (const OptionRow& row : bake_rows()) {
    const bool shows = row.value.words.find("FILE") != std::string::npos ||
                       row.value.words == "DIR" || row.help.starts_with("FILE") ||
                       row.flag == "--ao-occluders" || row.flag == "--maps";
    if (row.flag == "--high" || row.flag == "--low") continue;
    EXPECT_EQ(path_access(row) != PathAccess::none, shows) << row.flag;
  }
  const fs::path folder = make_studio({"a"});
  const Batch batch = expand(folder, R"([[bake]]
high = "assets/{name}_high.obj"
low = "assets\\{name}_low.obj"
out = "out"
maps = ["ao", "near=ao:ao-distance=2%"]
transfer = ["tex/{name}.png:color", "mtl:roughness"]
ao_occluders = ["high", "ground.obj"]
save_match = "match/{name}.exr"
)");
  const Job& job = batch.assets.at(0).job;
  const std::string base = folder.string() + "/";
  EXPECT_EQ(low_files(job), std::vector<std::string>{base + "assets/a_low.obj"});
  EXPECT_EQ(job.transfers, (std::vector<std::string>{base + "tex/a.png:color", "mtl:roughness"}));
  EXPECT_EQ(job.occluders, std::vector<std::string>{base + "ground.obj"});
  EXPECT_EQ(job.variants, std::vector<std::string>{"near=ao:ao-distance=2%"});
  EXPECT_EQ(job.save_match, base + "match/a.exr");
  EXPECT_EQ(job.out, base + "out");
}

TEST(JobFile, NumbersOfFacesAreLevels) {
  const fs::path folder = make_studio({"a"});
  const Batch batch = expand(folder,
                             "[[bake]]\nhigh = \"assets/{name}_high.obj\"\nfaces = [200, 100, "
                             "50]\nout = \"out/{name}.glb\"\n");
  ASSERT_EQ(batch.assets.size(), 3U);
  EXPECT_EQ(batch.assets[0].job.low.make.faces, 200U);
  EXPECT_EQ(batch.assets[2].job.low.make.faces, 50U);
  EXPECT_EQ(batch.assets[0].job.out, (folder / "out/a.glb").string());
  EXPECT_EQ(batch.assets[1].job.out, (folder / "out/a_lod1.glb").string());
  EXPECT_EQ(batch.assets[2].job.out, (folder / "out/a_lod2.glb").string());
}

TEST(JobFile, OnlyKeepsNames) {
  const fs::path folder = make_studio({"props/a", "props/b", "c"});
  ExpandOptions options;
  options.selected_names = {"props/*"};
  EXPECT_EQ(expand(folder, kStudioJob, "", options).assets.size(), 2U);
  options.selected_names = {"props"};
  EXPECT_EQ(expand(folder, kStudioJob, "", options).assets.size(), 2U);
  // Without a slash, also the last part of a name.
  for (const auto& [only, count] :
       {std::pair{"a", 1U}, std::pair{"{a,c}", 2U}, std::pair{"?", 3U}}) {
    options.selected_names = {only};
    EXPECT_EQ(expand(folder, kStudioJob, "", options).assets.size(), count) << only;
  }
  options.selected_names = {"x/a"};
  EXPECT_NE(message_of([&] { expand(folder, kStudioJob, "", options); }), "");
  options.selected_names = {"prosp/a"};
  expect_words(message_of([&] { expand(folder, kStudioJob, "", options); }),
               {"prosp/a", "did you mean props/a?"});
}

json json_of(const TomlValue& value) {
  using Kind = TomlValue::Kind;
  if (value.kind == Kind::table) {
    json object = json::object();
    for (std::size_t i = 0; i < value.keys.size(); ++i)
      object[value.keys[i]] = json_of(value.elements[i]);
    return object;
  }
  if (value.kind == Kind::list) {
    json list = json::array();
    for (const TomlValue& element : value.elements) list.push_back(json_of(element));
    return list;
  }
  return value.kind == Kind::text ? json(value.text) : json::parse(value.text);
}

TEST(JobFile, ExamplesFitTheSchema) {
  const json schema = json::parse(job_file_schema());
  const std::string issue = R"(kiln = ">=0.3"
[defaults]
size = 1024
maps = ["normal", "ao", "curvature", "id"]
out = "out/{dir}/{name}"
[profile.ci]
size = 512
[[bake]]
low  = "assets/{dir}/{name}_low.*"
high = "assets/{dir}/{name}_high*.{fbx,glb,ply}"
cage = { file = "assets/{dir}/{name}_cage.obj", optional = true }
skip = ["assets/wip/*"]
[[bake]]
high = "scans/{name}.glb"
faces = [20000, 5000, 1200]
out = "out/scans/{name}.glb"
[check]
golden = "golden"
limits = { missed = "5%", normal.mean = 0.5, ao.max = 0.02, outliers = "0.1%" }
)";
  for (const std::string& text : {issue, std::string(kStudioJob)}) {
    EXPECT_EQ(misfit(schema, json_of(parse_toml(text, "job.toml"))), "");
    parse_job_file(text, "job.toml", "ci");
  }
  // And it refuses what the reader refuses.
  for (const char* const line : {"siez = 3", "maps = 3.5", "samples = 99", "cage = { fil = 1 }",
                                 "retries = -1", "flip_y = 3"}) {
    const std::string text = kGood + line + "\n";
    EXPECT_NE(refused(text), "") << line;
    if (std::string(line) == "maps = 3.5" || std::string(line) == "samples = 99")
      continue;  // looser, for fractions
    EXPECT_NE(misfit(schema, json_of(parse_toml(text, "job.toml"))), "") << line;
  }
}

TEST(JobFile, ExamplesOfTheRepositoryAreGood) {
  const json schema = json::parse(job_file_schema());
  // Files that the examples name, of kinds that they name.
  const fs::path folder = make_studio({"crate", "props/barrel", "wip/sketch"});
  write(folder / "scans/rock.ply", "ply\n");  // not read by --check
  std::size_t examples = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(KILN_EXAMPLES)) {
    if (entry.path().extension() != ".toml") continue;
    SCOPED_TRACE(entry.path());
    ++examples;
    const std::string text = read_file(entry.path());
    EXPECT_EQ(misfit(schema, json_of(parse_toml(text, "job.toml"))), "");
    write(folder / "job.toml", text);
    ProcessResult result = call_kiln({"run", (folder / "job.toml").string(), "--check"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    const TomlValue file = parse_toml(text, "job.toml");
    const TomlValue* const profiles = file.find("profile");
    for (const std::string& profile :
         profiles == nullptr ? std::vector<std::string>() : profiles->keys) {
      result = call_kiln({"run", (folder / "job.toml").string(), "--check", "--profile", profile});
      EXPECT_EQ(result.exit_code, 0) << result.errors;
    }
  }
  EXPECT_GE(examples, 1U);
  // The manual shows the example as it is.
  const std::string manual = read_file(fs::path(KILN_EXAMPLES) / "../kiln/README.md");
  EXPECT_NE(manual.find("```toml\n" + read_file(fs::path(KILN_EXAMPLES) / "job/job.toml") + "```"),
            std::string::npos);
}

TEST(JobFile, PrintsACommandAsAJob) {
  const fs::path folder = make_studio({"odd{name}*"});
  Job job;
  job.high = {(folder / "assets/odd{name}*_high.obj").string()};
  job.low = (folder / "assets/odd{name}*_low.obj").string();
  job.out = (folder / "out").string();
  set_option(job, "maps", "normal,ao,near=ao:ao-distance=2%");
  set_option(job, "size", "64");
  set_option(job, "gutter", "inf");
  set_option(job, "flip_y", "true");
  set_option(job, "max_distance", "2%");
  const Batch batch = expand(folder, to_job_file(to_json(job)));
  ASSERT_EQ(batch.assets.size(), 1U);
  Job again = batch.assets[0].job;
  again.quiet = false;
  EXPECT_EQ(to_json(again), to_json(job));
}

}  // namespace
}  // namespace kiln::test
