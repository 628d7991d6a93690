// Parts of the cache by themselves: keys, what is kept, what is taken, shared high polys.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>
#include <vector>

#include "batch/bake_cache.h"
#include "batch/batch_scene.h"
#include "batch/cache_store.h"
#include "batch/content_hash.h"
#include "batch/source_cache.h"
#include "cli/call.h"
#include "support/process.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Kind = CacheDecision::Kind;

/// A cache, and an asset of one file that it knows.
class KeptAsset : public testing::Test {
 protected:
  void SetUp() override {
    write(folder_ / "high.obj", "v 0 0 0\n");
    write(folder_ / "low_normal.png", "pixels");
    asset_.name = "a";
    asset_.job.high = {(folder_ / "high.obj").string()};
    asset_.job.low = JobLow((folder_ / "low.obj").string());
    asset_.job.out = folder_.string();
    info_.platform = "platform";
    info_.driver = "1.0";
    info_.name = "some CPU";
    cache_.set_device(info_);
    inputs_.files[(folder_ / "high.obj").string()] = hash("high.obj");
  }
  std::string hash(const std::string& file) const {
    return file_hash(folder_ / file).value_or("none");
  }
  std::string keep() {
    const std::string changed = cache_.store_result(
        asset_, inputs_, {}, {(folder_ / "low_normal.png").string()}, Json::array(), 0);
    if (changed.empty()) cache_.record_outputs(asset_, false);
    return changed;
  }

  fs::path folder_ = scratch_folder();
  BatchAsset asset_;
  DeviceInfo info_;
  InputLog::Inputs inputs_;
  BakeCache cache_{folder_, folder_ / "records", std::make_unique<FolderStore>(folder_ / "cache")};
};

TEST_F(KeptAsset, IsOfADeviceClass) {
  EXPECT_EQ(cache_.decide(asset_).kind, Kind::bake);
  ASSERT_EQ(keep(), "");
  ASSERT_EQ(cache_.decide(asset_).kind, Kind::unchanged);
  const std::map<std::string, std::function<void(DeviceInfo&)>> others = {
      {"platform", [](DeviceInfo& info) { info.platform = "other"; }},
      {"driver", [](DeviceInfo& info) { info.driver = "1.1"; }},
      {"kind", [](DeviceInfo& info) { info.is_gpu = !info.is_gpu; }},
      {"division",
       [](DeviceInfo& info) { info.has_correct_division = !info.has_correct_division; }},
      {"denormals", [](DeviceInfo& info) { info.has_denormals = !info.has_denormals; }},
      {"atomics", [](DeviceInfo& info) { info.has_atomics_64 = !info.has_atomics_64; }}};
  for (const auto& [name, change] : others) {
    DeviceInfo other = info_;
    change(other);
    cache_.set_device(other);
    EXPECT_EQ(cache_.decide(asset_).kind, Kind::bake) << name;
  }
  // Processors of one driver are of one class.
  DeviceInfo other = info_;
  other.name = "another CPU";
  cache_.set_device(other);
  EXPECT_EQ(cache_.decide(asset_).kind, Kind::unchanged);
}

TEST_F(KeptAsset, IsNotKeptWhereInputsChangedMeanwhile) {
  const auto expect_refused = [&](const char* what) {
    EXPECT_NE(keep(), "") << what;
    EXPECT_EQ(cache_.decide(asset_).kind, Kind::bake) << what;
  };
  InputLog::Inputs good = inputs_;
  inputs_.files[(folder_ / "high.obj").string()] = std::string(32, '0');
  expect_refused("another file was read");
  inputs_ = good;
  inputs_.missing_files.insert((folder_ / "low_normal.png").string());
  expect_refused("a file that was missing is there");
  inputs_ = good;
  inputs_.answers[{folder_.string(), "named high.obj"}] = "elsewhere/high.obj\n";
  expect_refused("a folder has other files");
  inputs_ = good;
  EXPECT_EQ(keep(), "");
}

TEST_F(KeptAsset, HasPicturesOfItsFiles) {
  const std::vector<std::string> files = {(folder_ / "low_normal.png").string()};
  const std::string key = cache_.derived_data_key(asset_, files, "page");
  EXPECT_EQ(cache_.derived_data_key(asset_, files, "page"), key);
  EXPECT_NE(cache_.derived_data_key(asset_, files, "other"), key);
  EXPECT_NE(cache_.derived_data_key(asset_, {}, "page"), key);
  write(folder_ / "low_normal.png", "other pixels");
  const std::string second = cache_.derived_data_key(asset_, files, "page");
  EXPECT_NE(second, key);
  write(folder_ / "high.obj", "v 0 0 1\n");
  EXPECT_NE(cache_.derived_data_key(asset_, files, "page"), second);
  cache_.put_derived_data(key, "text");
  EXPECT_EQ(cache_.get_derived_data(key), "text");
  EXPECT_FALSE(cache_.get_derived_data(second));
}

/// Each of these could change a file that a bake writes.
TEST_F(KeptAsset, EachOptionOfTheBakeIsPartOfTheKey) {
  const auto key = [&](const BatchAsset& asset) {
    return cache_.derived_data_key(asset, {}, "page");
  };
  const std::vector<std::pair<const char*, std::function<void(Job&)>>> changes = {
      {"", [](Job&) {}},
      {"width", [](Job& job) { job.bake.width += 16; }},
      {"height", [](Job& job) { job.bake.height += 16; }},
      {"samples", [](Job& job) { job.bake.samples += 1; }},
      {"padding", [](Job& job) { job.bake.encoding.gutter += 1; }},
      {"flip-y", [](Job& job) { job.bake.encoding.flip_y = true; }},
      {"space", [](Job& job) { job.bake.encoding.space = NormalMapSpace::object; }},
      {"distance",
       [](Job& job) {
         job.bake.match.max_distance = {0.5, false};
       }},
      {"relative distance",
       [](Job& job) {
         job.bake.match.max_distance = {0.5, true};
       }},
      {"high", [](Job& job) { job.high = {"/another.obj"}; }},
      {"two of high", [](Job& job) { job.high.push_back(job.high[0]); }},
      {"low", [](Job& job) { job.low = JobLow("/other.obj"); }},
      {"out", [](Job& job) { job.out += "/x"; }},
      {"cage", [](Job& job) { job.cage_auto = true; }},
      {"cage mesh", [](Job& job) { job.cage_mesh = "cage.obj"; }}};
  std::map<std::string, std::string> first;
  for (const auto& [name, change] : changes) {
    BatchAsset other = asset_;
    change(other.job);
    const auto [entry, is_new] = first.emplace(key(other), name);
    EXPECT_TRUE(is_new) << name << " has the key of '" << entry->second << "'";
  }
  const std::string plain = key(asset_);
  BatchAsset hooked = asset_;
  hooked.after = "true";
  EXPECT_NE(key(hooked), plain);
  // None of these changes a file of the bake.
  BatchAsset alike = asset_;
  alike.job.quiet = true;
  alike.job.device = "another";
  alike.before = "true";
  alike.retries = 3;
  EXPECT_EQ(key(alike), plain);
}

TEST(BakeCacheParts, AnotherBuildOfKilnBakesAnew) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  // The same program with a byte more.
  const fs::path other = folder / "kiln";
  fs::copy_file(kiln_command(), other);
  const auto state = [&](const std::string& program) {
    const ProcessResult result =
        run_process({program, "run", (folder / "job.toml").string(), "--json", "-"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.exit_code == 0 ? json::parse(result.output)["state"].get<std::string>() : "";
  };
  EXPECT_EQ(state(kiln_command()), "baked");
  EXPECT_EQ(state(other), "unchanged");
  write(other, read_file(other) + "x");
  EXPECT_EQ(state(other), "baked");
}

TEST(BakeCacheParts, EntriesOfOthersWriteNothingElsewhere) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  const auto state = [&] {
    const ProcessResult result = call_kiln({"run", (folder / "job.toml").string(), "--json", "-"});
    return json::parse(result.output)["state"].get<std::string>();
  };
  ASSERT_EQ(state(), "baked");
  FolderStore store(folder / ".kiln");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / ".kiln/entries")) {
    const std::string name = "entries/" + entry.path().filename().string();
    const std::string bytes = store.get(name).value();
    const std::size_t line = bytes.find('\n'), size = std::stoul(bytes.substr(0, line));
    json head = json::parse(bytes.substr(line + 1, size));
    for (json& file : head["files"]) {
      if (file["path"] == "out/a/a_low_normal.png") file["path"] = "assets/a_low_normal.png";
    }
    const std::string changed = head.dump();
    ASSERT_TRUE(store.put(
        name, std::to_string(changed.size()) + "\n" + changed + bytes.substr(line + 1 + size)));
  }
  fs::remove_all(folder / "out");
  EXPECT_EQ(state(), "baked");
  EXPECT_FALSE(fs::exists(folder / "assets/a_low_normal.png"));
  EXPECT_TRUE(fs::exists(folder / "out/a/a_low_normal.png"));
}

TEST(BakeCacheParts, AnotherHookBakesAnew) {
  const fs::path folder = make_studio({"a"});
  const auto state = [&](const std::string& after) {
    write(folder / "job.toml", std::string(kStudioJob) + "after = \"" + after + "\"\n");
    const ProcessResult result =
        call_kiln({"run", (folder / "job.toml").string(), "--json", "-", "--allow-hooks"});
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return json::parse(result.output)["state"].get<std::string>();
  };
  EXPECT_EQ(state("cat > /dev/null"), "baked");
  EXPECT_EQ(state("cat > /dev/null"), "unchanged");
  EXPECT_EQ(state("cat > one.json"), "baked");
  EXPECT_TRUE(fs::exists(folder / "one.json"));
}

TEST(BakeCacheParts, ARunKeepsToTheLimit) {
  const fs::path folder = make_studio({"a"});
  write(folder / "job.toml", kStudioJob);
  const fs::path old = folder / ".kiln/entries/old";
  write(old, "x");
  fs::resize_file(old, std::uintmax_t{70} << 20);
  fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(50));
  const std::string job = (folder / "job.toml").string();
  EXPECT_EQ(call_kiln({"run", job, "--cache-limit", "100M"}).exit_code, 0);
  EXPECT_TRUE(fs::exists(old));
  EXPECT_EQ(call_kiln({"run", job, "--cache-limit", "64M", "--rebake"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(old));
  // What was made now stays.
  fs::remove_all(folder / "out");
  const ProcessResult result = call_kiln({"run", job, "--json", "-"});
  EXPECT_EQ(json::parse(result.output)["state"], "restored");
}

TEST(SourceCache, TellsMeshesApartByAllThatABakeReads) {
  KILN_REQUIRE_DEVICE();
  Mesh mesh = BumpySphere::dense(200);
  mesh.normals.assign(mesh.positions.size(), Vec3{0, 0, 1});
  mesh.normal_triangles = mesh.triangles;
  mesh.colors.assign(mesh.positions.size(), {1, 2, 3, 4});
  mesh.uvs.assign(mesh.positions.size(), Vec2{0.25F, 0.5F});
  mesh.uv_triangles = mesh.triangles;
  mesh.tangents.assign(3 * mesh.triangles.size(), Tangent{{1, 0, 0}, 1});
  SourceCache cache(100);
  cache.get(*device(), mesh, RayTraversal::automatic);
  cache.get(*device(), mesh, RayTraversal::automatic);
  EXPECT_EQ(cache.built_count(), 1U);
  const std::vector<std::function<void(Mesh&)>> changes = {
      [](Mesh& m) { m.positions[3].x += 0.001F; },
      [](Mesh& m) {
        m.normals[3] = {0, 1, 0};
      },
      [](Mesh& m) { std::swap(m.normal_triangles[0], m.normal_triangles[1]); },
      [](Mesh& m) {
        m.colors[5] = {9, 2, 3, 4};
      },
      [](Mesh& m) { m.origin[1] = 1; },
      [](Mesh& m) { std::swap(m.triangles[0], m.triangles[1]); },
      [](Mesh& m) {
        m.material_names = {"skin"};
        m.materials.assign(m.triangles.size(), 0);
      },
      [](Mesh& m) {
        m.material_names = {"leaf"};
        m.materials.assign(m.triangles.size(), 0);
      },
      [](Mesh& m) {
        m.group_names = {"skin"};
        m.groups.assign(m.triangles.size(), 0);
      },
      [](Mesh& m) {
        m.object_names = {"skin"};
        m.objects.assign(m.triangles.size(), 0);
      },
      [](Mesh& m) { m.material_files = {"skin.mtl"}; },
      [](Mesh& m) { m.name = "other"; },
      [](Mesh& m) { m.uvs[7].x = 0.75F; },
      [](Mesh& m) { std::swap(m.uv_triangles[0], m.uv_triangles[1]); },
      [](Mesh& m) { m.tangents[4].sign = -1; },
      [](Mesh& m) {
        m.polygons.resize(m.triangles.size());
        std::iota(m.polygons.begin(), m.polygons.end(), 0U);
      },
      [](Mesh& m) { m.metres = 1; },
      [](Mesh& m) { m.uv_set = 1; },
      [](Mesh& m) {
        m.other_uvs = {{1, m.uvs}};
      }};
  std::size_t made = 1;
  for (const auto& change : changes) {
    Mesh other = mesh;
    change(other);
    cache.get(*device(), other, RayTraversal::automatic);
    EXPECT_EQ(cache.built_count(), ++made);
  }
  cache.get(*device(), mesh, RayTraversal::automatic);
  EXPECT_EQ(cache.built_count(), made);
  cache.get(*device(), mesh, RayTraversal::cpu);
  EXPECT_EQ(cache.built_count(), made + 1);
}

TEST(SourceCache, KeepsWhatWasUsedLast) {
  KILN_REQUIRE_DEVICE();
  const Mesh a = cube(1), b = cube(2), c = cube(3);
  SourceCache cache(2);
  std::vector<std::size_t> made;
  for (const Mesh* mesh : {&a, &b, &a, &c, &a, &c, &b}) {
    cache.get(*device(), *mesh, RayTraversal::automatic);
    made.push_back(cache.built_count());
  }
  EXPECT_EQ(made, (std::vector<std::size_t>{1, 2, 2, 3, 3, 3, 4}));
}

}  // namespace
}  // namespace kiln::test
