// Nothing is baked twice, and nothing stale is taken: each kind of input that a bake reads is changed, and must be seen.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "batch/batch_scene.h"
#include "batch/cache_store.h"
#include "cli/call.h"
#include "kiln/image.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// States of all assets by name, and why.
std::map<std::string, std::string> states(const fs::path& folder,
                                          std::vector<std::string> more = {}, int exit_code = 0) {
  more.insert(more.begin(),
              {"run", (folder / "job.toml").string(), "--json", "-", "--allow-own-maps"});
  const ProcessResult result = call_kiln(more);
  EXPECT_EQ(result.exit_code, exit_code) << result.errors;
  std::map<std::string, std::string> states;
  std::istringstream in(result.output);
  for (std::string line; std::getline(in, line);) {
    const json asset = json::parse(line);
    states[asset["asset"]] =
        asset["state"].get<std::string>() +
        (asset["reason"].is_null() ? "" : ": " + asset["reason"].get<std::string>());
  }
  return states;
}

std::string state(const fs::path& folder, const std::vector<std::string>& more = {}) {
  const auto all = states(folder, more);
  return all.empty() ? "" : all.begin()->second;
}

std::map<std::string, std::string> bytes_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  if (!fs::exists(folder)) return files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = read_file(entry.path());
  }
  return files;
}

/// A picture of one colour.
void save_colour(const fs::path& path, float value) {
  Image image;
  image.width = image.height = 4;
  image.channels = 3;
  image.pixels.assign(48, value);
  fs::create_directories(path.parent_path());
  save_image(image, path, {ImageFormat::png8});
}

TEST(BakeCache, LeavesWhatIsUnchanged) {
  const fs::path folder = make_studio({"a", "b"});
  write(folder / "job.toml", kStudioJob);
  for (const auto& [name, state] : states(folder))
    EXPECT_EQ(state, "baked: no earlier bake is recorded");
  const auto files = bytes_of(folder / "out");
  const auto time = fs::last_write_time(folder / "out/a/a_low_normal.png");
  for (int i = 0; i < 2; ++i) {
    for (const auto& [name, state] : states(folder)) EXPECT_EQ(state, "unchanged");
  }
  EXPECT_EQ(fs::last_write_time(folder / "out/a/a_low_normal.png"), time);
  // Touched: read again, and not baked.
  fs::last_write_time(folder / "assets/a_low.obj",
                      fs::file_time_type::clock::now() - std::chrono::hours(3));
  EXPECT_EQ(states(folder)["a"], "unchanged");
  // Another bake is none of an asset's.
  write(folder / "assets/b_high.obj", read_file(folder / "assets/b_high.obj") + "# changed\n");
  auto all = states(folder);
  EXPECT_EQ(all["a"], "unchanged");
  EXPECT_EQ(all["b"], "baked: assets/b_high.obj changed");
  EXPECT_TRUE(bytes_of(folder / "out") == files);
  EXPECT_EQ(states(folder, {"--rebake"})["a"], "baked: --rebake was given");
  EXPECT_EQ(states(folder, {"--no-cache"})["a"], "baked");
}

TEST(BakeCache, SeesAChangeThatKeepsSizeAndTimes) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  const fs::path high = folder / "assets/a_high.obj";
  // Old enough that its times would prove something.
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(5);
  fs::last_write_time(high, old);
  // Once a file has been as it is for two seconds, its times count: then it is not read again unless they change.
  std::this_thread::sleep_for(std::chrono::milliseconds(2100));
  state(folder);
  EXPECT_EQ(state(folder), "unchanged");
  std::string text = read_file(high);
  const std::size_t digit = text.find("v ") + 4;
  text[digit] = text[digit] == '1' ? '2' : '1';
  write(high, text);
  fs::last_write_time(high, old);
  EXPECT_EQ(state(folder), "baked: assets/a_high.obj changed");
}

TEST(BakeCache, SeesOptionsAndGoesBackToThem) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  state(folder);
  const auto files = bytes_of(folder / "out");
  EXPECT_EQ(state(folder, {"--size", "8"}), "baked: size changed from 16x16 to 8x8");
  EXPECT_EQ(state(folder, {"--size", "8"}), "unchanged");
  // What was baked before is taken back, whole.
  EXPECT_EQ(state(folder), "restored: size changed from 8x8 to 16x16");
  EXPECT_TRUE(bytes_of(folder / "out") == files);
  EXPECT_EQ(state(folder), "unchanged");
  EXPECT_EQ(state(folder, {"--flip-y"}), "baked: flip_y is new");
  EXPECT_EQ(state(folder), "restored: flip_y is gone");
  // A limit that was met is not met by another one.
  EXPECT_EQ(states(folder, {"--max-distance", "0.05%", "--max-missed", "0"}, 1)["a"].substr(0, 6),
            "failed");
  EXPECT_EQ(state(folder).substr(0, 8), "restored");
}

TEST(BakeCache, RestoresOutputsThatWereRemovedOrChanged) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  state(folder);
  const auto files = bytes_of(folder / "out");
  fs::remove(folder / "out/a/a_low_height.png");
  EXPECT_EQ(state(folder), "restored: out/a/a_low_height.png is gone");
  EXPECT_TRUE(bytes_of(folder / "out") == files);
  // One byte, of the same size.
  std::string bytes = read_file(folder / "out/a/a_low_normal.png");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write(folder / "out/a/a_low_normal.png", bytes);
  EXPECT_EQ(state(folder), "restored: out/a/a_low_normal.png changed after it was written");
  EXPECT_TRUE(bytes_of(folder / "out") == files);
  fs::remove_all(folder / "out");
  EXPECT_EQ(state(folder).substr(0, 8), "restored");
  EXPECT_TRUE(bytes_of(folder / "out") == files);
}

TEST(BakeCache, DetectsEntriesThatWereChanged) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  state(folder);
  const auto files = bytes_of(folder / "out");
  std::vector<fs::path> entries;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / ".kiln/entries"))
    entries.push_back(entry.path());
  ASSERT_EQ(entries.size(), 1U);
  const std::string whole = read_file(entries[0]);
  // A bit of any place, and any end that is cut off.
  for (const std::size_t at :
       {std::size_t{0}, std::size_t{40}, whole.size() / 2, whole.size() - 40, whole.size() - 1}) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 4);
    for (const std::string& bytes : {changed, whole.substr(0, at)}) {
      write(entries[0], bytes);
      fs::remove_all(folder / "out");
      EXPECT_EQ(state(folder).substr(0, 5), "baked") << at;
      EXPECT_TRUE(bytes_of(folder / "out") == files);
    }
  }
  // Another asset's entry under this name.
  FolderStore store(folder / "store");
  ASSERT_TRUE(store.put("entries/one", "bytes of one"));
  fs::copy_file(folder / "store/entries/one", folder / "store/entries/two");
  EXPECT_EQ(store.get("entries/one"), "bytes of one");
  EXPECT_FALSE(store.get("entries/two"));
  EXPECT_FALSE(store.get("entries/three"));
  // A record that was changed is none.
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(folder / ".kiln/records")) {
    if (!entry.is_regular_file()) continue;
    std::string text = read_file(entry.path());
    text[text.size() / 2] = static_cast<char>(text[text.size() / 2] ^ 1);
    write(entry.path(), text);
  }
  EXPECT_EQ(state(folder), "restored: no earlier bake is recorded");
}

TEST(BakeCache, SharesResultsBetweenFolders) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  const std::string cache = (folder / "shared").string();
  EXPECT_EQ(state(folder, {"--cache", cache}).substr(0, 5), "baked");
  const fs::path other = scratch_folder();
  fs::copy(folder / "assets", other / "assets", fs::copy_options::recursive);
  write(other / "job.toml", kStudioJob);
  EXPECT_EQ(state(other, {"--cache", cache}), "restored: no earlier bake is recorded");
  EXPECT_TRUE(bytes_of(other / "out") == bytes_of(folder / "out"));
  EXPECT_EQ(state(other, {"--cache", cache}), "unchanged");
  // Of other inputs nothing is taken.
  fs::remove_all(other / "out");
  write(other / "assets/a_low.obj", read_file(other / "assets/a_low.obj") + "#\n");
  EXPECT_EQ(state(other, {"--cache", cache}).substr(0, 5), "baked");
}

/// Reports, saved matches and cages may lie in folders of their own: each is restored there.
TEST(BakeCache, RestoresFilesBesideTheMaps) {
  for (const char* const file : {"json = \"report/a.json\"\n", "save_match = \"match/a.exr\"\n",
                                 "cage = \"auto\"\nsave_cage = \"cages/a.obj\"\n"}) {
    SCOPED_TRACE(file);
    const fs::path folder = make_studio({"a"});
    write(folder / "job.toml",
          std::string("[[bake]]\nlow = \"assets/a_low.obj\"\nhigh = \"assets/a_high.obj\"\n") +
              "size = 16\nmaps = [\"normal\", \"height\"]\nout = \"out\"\n" + file);
    const auto files = [&] {
      std::map<std::string, std::string> all;
      for (const char* const place : {"out", "report", "match", "cages"}) {
        all.merge(bytes_of(folder / place));
      }
      return all;
    };
    EXPECT_EQ(state(folder).substr(0, 5), "baked");
    const std::map<std::string, std::string> made = files();
    EXPECT_EQ(made.size(), 4U);  // two maps, whose they are, and the file
    for (const char* const place : {"out", "report", "match", "cages"}) {
      fs::remove_all(folder / place);
    }
    EXPECT_EQ(state(folder).substr(0, 8), "restored");
    EXPECT_TRUE(files() == made);
  }
}

TEST(BakeCache, DoesNotWriteOverWhatIsTheUsers) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml",
        "[[bake]]\nhigh = \"assets/{name}_high.obj\"\nfaces = 60\nsize = 16\nmaps = "
        "\"normal\"\nout = \"out/{name}.obj\"\n");
  EXPECT_EQ(state(folder).substr(0, 5), "baked");
  write(folder / "out/a.obj", "# my own\nv 0 0 0\n");
  const auto all = states(folder, {}, 1);
  EXPECT_EQ(all.begin()->second.substr(0, 6), "failed");
  EXPECT_EQ(read_file(folder / "out/a.obj"), "# my own\nv 0 0 0\n");
}

/// A kind of input: how it comes to be read, and how it changes.
struct InputCase {
  const char* name;
  std::function<void(const fs::path&)> make;  ///< Before the first bake
  const char* options;                        ///< Lines of [[bake]]
  std::function<void(const fs::path&)> change;
  const char* reason;  ///< That must be given
};

void save_textured(const fs::path& folder, const char* material = "map_Kd tex/albedo.png") {
  Mesh high = BumpySphere::dense(600);
  high.uvs = {{0.2F, 0.2F}, {0.8F, 0.2F}, {0.5F, 0.8F}};
  high.uv_triangles.assign(high.triangles.size(), {0, 1, 2});
  high.materials.assign(high.triangles.size(), 0);
  high.material_names = {"skin"};
  high.material_files = {"high.mtl"};
  save_obj(high, folder / "assets/a_high.obj");
  const std::string text = read_file(folder / "assets/a_high.obj");
  if (text.find("mtllib") == std::string::npos)
    write(folder / "assets/a_high.obj", "mtllib high.mtl\nusemtl skin\n" + text);
  write(folder / "assets/high.mtl", std::string("newmtl skin\nKd 0.5 0.5 0.5\n") + material + "\n");
}

const InputCase kInputs[] = {
    {"High",
     {},
     "",
     [](const fs::path& f) { save_obj(BumpySphere::dense(900), f / "assets/a_high.obj"); },
     "a_high.obj changed"},
    {"Low",
     {},
     "",
     [](const fs::path& f) {
       write(f / "assets/a_low.obj", read_file(f / "assets/a_low.obj") + "#\n");
     },
     "a_low.obj changed"},
    {"Mtl",
     [](const fs::path& f) {
       save_textured(f);
       save_colour(f / "assets/tex/albedo.png", 0.25F);
     },
     "maps = \"color\"\n",
     [](const fs::path& f) {
       write(f / "assets/high.mtl", read_file(f / "assets/high.mtl") + "# more\n");
     },
     "high.mtl changed"},
    {"Texture",
     [](const fs::path& f) {
       save_textured(f);
       save_colour(f / "assets/tex/albedo.png", 0.25F);
     },
     "maps = \"color\"\n",
     [](const fs::path& f) { save_colour(f / "assets/tex/albedo.png", 0.75F); },
     "albedo.png changed"},
    {"TextureThatWasMissing",
     [](const fs::path& f) {
       save_textured(f);
       save_colour(f / "assets/deep/albedo.png", 0.25F);
     },
     "maps = \"color\"\n",
     [](const fs::path& f) { save_colour(f / "assets/tex/albedo.png", 0.75F); },
     "albedo.png is new"},
    {"TextureThatIsFoundNearer",
     [](const fs::path& f) {
       save_textured(f);
       save_colour(f / "assets/deep/albedo.png", 0.25F);
     },
     "maps = \"color\"\n",
     [](const fs::path& f) { save_colour(f / "assets/b/tex/albedo.png", 0.75F); },
     "has other files"},
    {"UdimTile",
     [](const fs::path& f) {
       save_textured(f, "map_Kd tex/albedo.<UDIM>.png");
       save_colour(f / "assets/tex/albedo.1001.png", 0.25F);
     },
     "maps = \"color\"\n",
     [](const fs::path& f) { save_colour(f / "assets/tex/albedo.1002.png", 0.75F); },
     "has other files"},
    {"UdimTileChanged",
     [](const fs::path& f) {
       save_textured(f, "map_Kd tex/albedo.<UDIM>.png");
       save_colour(f / "assets/tex/albedo.1001.png", 0.25F);
     },
     "maps = \"color\"\n",
     [](const fs::path& f) { save_colour(f / "assets/tex/albedo.1001.png", 0.75F); },
     "albedo.1001.png changed"},
    {"Transfer",
     [](const fs::path& f) {
       save_textured(f);
       save_colour(f / "paint.png", 0.25F);
     },
     "maps = \"normal\"\ntransfer = \"paint.png:paint\"\n",
     [](const fs::path& f) { save_colour(f / "paint.png", 0.5F); }, "paint.png changed"},
    {"Cage", [](const fs::path& f) { save_obj(BumpySphere::light(), f / "assets/a_cage.obj"); },
     "cage = { file = \"assets/{name}_cage.obj\", optional = true }\n",
     [](const fs::path& f) {
       write(f / "assets/a_cage.obj", read_file(f / "assets/a_cage.obj") + "#\n");
     },
     "a_cage.obj changed"},
    {"CageThatWasMissing",
     {},
     "cage = { file = \"assets/{name}_cage.obj\", optional = true }\n",
     [](const fs::path& f) { save_obj(BumpySphere::light(), f / "assets/a_cage.obj"); },
     "cage_mesh is new"},
    {"Occluder", [](const fs::path& f) { save_obj(BumpySphere::dense(100), f / "ground.obj"); },
     "maps = \"ao\"\nao_rays = 4\nao_occluders = [\"high\", \"ground.obj\"]\n",
     [](const fs::path& f) { save_obj(BumpySphere::dense(200), f / "ground.obj"); },
     "ground.obj changed"},
    {"OwnMap",
     [](const fs::path& f) {
       write(f / "own.cl",
             "float4 kiln_map(const kiln_point* p) { return (float4)(0.5f, 0, 0, 0); }\n");
     },
     "maps = [\"own=own.cl\"]\n",
     [](const fs::path& f) {
       write(f / "own.cl",
             "float4 kiln_map(const kiln_point* p) { return (float4)(0.7f, 0, 0, 0); }\n");
     },
     "own.cl changed"},
    {"ViewWeights", [](const fs::path& f) { write(f / "views.txt", "0 0 1 1\n0 1 0 0.5\n"); },
     "match = \"visibility\"\nview_weight = \"views.txt\"\n",
     [](const fs::path& f) { write(f / "views.txt", "0 0 1 1\n0 1 0 0.9\n"); },
     "views.txt changed"},
    {"Sidecar", [](const fs::path& f) { write(f / "assets/a.kiln.toml", "size = 8\n"); }, "",
     [](const fs::path& f) { write(f / "assets/a.kiln.toml", "size = 4\n"); }, "size changed"},
    {"SecondHigh",
     {},
     "",
     [](const fs::path& f) { save_obj(BumpySphere::dense(100), f / "assets/a_high_more.obj"); },
     "high changed"},
};

class BakeCacheInputs : public testing::TestWithParam<InputCase> {};

TEST_P(BakeCacheInputs, AreSeenToChange) {
  const InputCase& c = GetParam();
  const fs::path folder = make_studio({"a"});
  if (c.make) c.make(folder);
  write(folder / "job.toml",
        "[defaults]\nsize = 16\nout = \"out/{name}\"\n[[bake]]\nlow = "
        "\"assets/{name}_low.obj\"\nhigh = \"assets/{name}_high*.obj\"\n" +
            std::string(c.options));
  ASSERT_EQ(state(folder), "baked: no earlier bake is recorded");
  ASSERT_EQ(state(folder), "unchanged");
  c.change(folder);
  const std::string after = state(folder);
  EXPECT_EQ(after.substr(0, 5), "baked") << after;
  EXPECT_NE(after.find(c.reason), std::string::npos) << after;
  // What it is now is what a bake without a cache gives.
  const auto ours = bytes_of(folder / "out");
  fs::remove_all(folder / "out");
  state(folder, {"--no-cache"});
  EXPECT_TRUE(bytes_of(folder / "out") == ours);
}

INSTANTIATE_TEST_SUITE_P(All, BakeCacheInputs, testing::ValuesIn(kInputs),
                         [](const auto& info) { return info.param.name; });

TEST(BakeCache, DoesNotKeepMapsThatIncludeFiles) {
  const fs::path folder = make_studio({"a"});
  write(folder / "own.cl",
        "// no #include here\nfloat4 kiln_map(const kiln_point* p) { return (float4)(0.5f, 0, 0, "
        "0); }\n");
  write(folder / "job.toml", std::string(kStudioJob) + "maps = [\"own=own.cl\"]\n");
  EXPECT_EQ(state(folder).substr(0, 5), "baked");
  EXPECT_EQ(state(folder),
            "baked: a user-defined map includes files, whose changes cannot be tracked");
}

TEST(BakeCache, PlansAndWritesDepfiles) {
  const fs::path folder = make_studio({"a", "odd $name#"});
  write(folder / "job.toml", kStudioJob);
  const std::string job = (folder / "job.toml").string(), depfile = (folder / "out.d").string();
  ProcessResult result = call_kiln({"run", job, "--plan"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_NE(result.output.find("a: bake: no earlier bake is recorded"), std::string::npos)
      << result.output;
  EXPECT_FALSE(fs::exists(folder / "out"));
  states(folder, {"--depfile", depfile});
  const std::string text = read_file(depfile);
  for (const std::string file :
       {"assets/a_low.obj", "assets/a_high.obj", "job.toml", "out/a/a_low_normal.png"}) {
    EXPECT_NE(text.find((folder / file).string()), std::string::npos) << file << "\n" << text;
  }
  EXPECT_NE(text.find("odd\\ $$name\\#_low.obj"), std::string::npos) << text;
  states(folder, {"--depfile", depfile, "--depfile-target", "my stamp"});
  EXPECT_EQ(read_file(depfile), "my\\ stamp" + text.substr(text.find(": ")));
  EXPECT_EQ(call_kiln({"run", job, "--depfile-target", "x"}).exit_code, 2);
  write(folder / "assets/a_low.obj", read_file(folder / "assets/a_low.obj") + "#\n");
  result = call_kiln({"run", job, "--plan"});
  EXPECT_NE(result.output.find("a: bake: assets/a_low.obj changed"), std::string::npos)
      << result.output;
  EXPECT_NE(result.output.find("1 to bake, 0 from the cache, 1 unchanged"), std::string::npos)
      << result.output;
  result = call_kiln({"run", job, "--plan", "--json", "-"});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  std::istringstream lines(result.output);
  std::map<std::string, nlohmann::json> assets;
  for (std::string line; std::getline(lines, line);) {
    const nlohmann::json asset = nlohmann::json::parse(line);
    assets[asset["asset"]] = asset;
  }
  ASSERT_EQ(assets.size(), 2U) << result.output;
  EXPECT_EQ(assets["a"]["action"], "bake");
  EXPECT_EQ(assets["a"]["reason"], "assets/a_low.obj changed");
  EXPECT_EQ(assets["odd $name#"]["action"], "unchanged");
  EXPECT_TRUE(assets["odd $name#"]["reason"].is_null());
  const std::string file = (folder / "reports/plan.json").string();
  result = call_kiln({"run", job, "--list", "--json", file});
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  const nlohmann::json listed = nlohmann::json::parse(read_file(file));
  ASSERT_EQ(listed["assets"].size(), 2U);
  EXPECT_GT(listed["assets"][0]["seconds"], 0);
  EXPECT_EQ(call_kiln({"run", job, "--check", "--json", "-"}).exit_code, 2);
  // Files of assets that were not baked have the paths of bakes, below the job file's folder as that was given.
  const auto files = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"env", "-C", folder.string(), kiln_command(), "run", "job.toml",
                               "--only", "a", "--json", "-"});
    return json::parse(run_process(more).output)["files"];
  };
  const json baked_files = files({"--rebake"});
  EXPECT_EQ(baked_files[0], "out/a/a_low_normal.png");
  EXPECT_EQ(files({}), baked_files);
  fs::remove_all(folder / "out");
  EXPECT_EQ(files({}), baked_files);
}

TEST(BakeCache, PrunesWhatWasUsedLeastLately) {
  const fs::path folder = scratch_folder();
  FolderStore store(folder);
  for (const char* const name : {"a", "b", "c"}) {
    ASSERT_TRUE(store.put("entries/" + std::string(name), std::string(1000, *name)));
    fs::last_write_time(folder / "entries" / name,
                        fs::file_time_type::clock::now() - std::chrono::hours(2 + (*name == 'b')));
  }
  ASSERT_TRUE(store.get("entries/b"));  // used
  fs::last_write_time(folder / "entries/a",
                      fs::file_time_type::clock::now() - std::chrono::hours(9));
  store.prune(2100);
  EXPECT_FALSE(store.get("entries/a"));
  EXPECT_TRUE(store.get("entries/b"));
  EXPECT_TRUE(store.get("entries/c"));
  store.prune(0);
  EXPECT_FALSE(store.get("entries/b"));
}

TEST(BakeCache, HooksThatChangeOutputsAreKeptAsTheyLeftThem) {
  std::signal(SIGPIPE, SIG_IGN);  // as the program does: the hook reads nothing
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml",
        std::string(kStudioJob) + "after = \"echo more >> out/a/a_low_normal.png\"\n");
  EXPECT_EQ(state(folder, {"--allow-hooks"}).substr(0, 5), "baked");
  const std::string bytes = read_file(folder / "out/a/a_low_normal.png");
  EXPECT_EQ(state(folder, {"--allow-hooks"}), "unchanged");
  fs::remove(folder / "out/a/a_low_normal.png");
  EXPECT_EQ(state(folder, {"--allow-hooks"}).substr(0, 8), "restored");
  EXPECT_TRUE(read_file(folder / "out/a/a_low_normal.png") == bytes);
}

}  // namespace
}  // namespace kiln::test
