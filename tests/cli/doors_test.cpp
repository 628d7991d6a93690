// One job by every door writes the same bytes: the command, kiln::run() with options by name and from JSON, C.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clean/open_shells.h"
#include "clean/triangle_list.h"
#include "cli/call.h"
#include "cli/command_scene.h"
#include "job/open_shell_sides.h"
#include "kiln/asset.h"
#include "kiln/image.h"
#include "kiln/job.h"
#include "kiln/kiln_c.h"
#include "kiln/option_error.h"
#include "kiln/options.h"
#include "support/environment.h"
#include "support/read_file.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;

/// Options of a job beside its output, with their values.
using Options = std::vector<std::pair<std::string, std::vector<std::string>>>;

/// A row of data/jobs.json, which tests/python/test_doors.py reads, too. "{scene}" stands for the scene's folder.
struct DoorCase {
  std::string name;
  std::string out;  ///< Empty: a folder
  Options options;
  int exit_code = 0;
};

std::vector<DoorCase> read_jobs() {
  std::vector<DoorCase> cases;
  std::ifstream in(test_data("jobs.json"));
  for (const auto& row : nlohmann::ordered_json::parse(in)) {
    DoorCase c{row.at("name"), row.value("out", ""), {}, row.value("exit", 0)};
    for (const auto& [option, values] : row.at("options").items()) {
      c.options.emplace_back(option, values.get<std::vector<std::string>>());
    }
    if (!row.at("options").contains("size")) {
      c.options.emplace_back("size", std::vector<std::string>{"64"});
    }
    cases.push_back(std::move(c));
  }
  return cases;
}

/// Two balls of two materials, one half transparent, one beside the other in nodes of their own.
void save_two_balls(const Mesh& ball, const fs::path& path,
                    const std::shared_ptr<const AssetPictures>& pictures = {}) {
  Mesh parts[] = {ball, ball};
  for (Vec3& p : parts[1].positions) p.x += 3;
  parts[0].name = "left";
  parts[1].name = "right";
  for (Mesh& part : parts) {
    part.colors.assign(part.positions.size(), {200, 100, 50, 255});
    part.material_names = {part.name};
    part.materials.assign(part.triangles.size(), 0);
  }
  const Mesh both = join_meshes(parts);
  std::vector<AssetMaterial> materials(2);
  materials[0].name = "left";
  materials[1].name = "right";
  for (AssetMaterial& material : materials) material.pictures = pictures;
  materials[1].double_sided = true;
  materials[1].alpha_mode = AlphaMode::blend;
  save_asset(both, materials, path);
}

/// Two copies of a mesh beside each other, each an object.
Mesh two_objects(const Mesh& part) {
  Mesh parts[] = {part, part};
  for (Vec3& p : parts[1].positions) p.x += 3;
  for (int i = 0; i < 2; ++i) {
    parts[i].object_names = {i == 0 ? "left" : "right"};
    parts[i].objects.assign(part.triangles.size(), 0);
  }
  return join_meshes(parts);
}

fs::path make_doors_scene() {
  fs::path folder = make_scene(3000);
  save_obj(low_of_halves(0), folder / "halves.obj");
  save_obj(low_of_halves(1), folder / "tiles.obj");
  Mesh cage = BumpySphere::light();
  for (Vec3& p : cage.positions) p = {p.x * 1.2F, p.y * 1.2F, p.z * 1.2F};
  save_obj(cage, folder / "cage.obj");
  save_two_balls(BumpySphere::dense(2000), folder / "two.glb");
  save_two_balls(BumpySphere::light(), folder / "two_low.glb");
  const Image rough{2, 1, 1, {0.25F, 0.75F}};
  const AssetMaps maps{.roughness = &rough};
  save_two_balls(BumpySphere::light(), folder / "rough.glb",
                 std::make_shared<AssetPictures>(encode_maps(maps)));
  for (const auto& [file, part] : {std::pair{"parts.obj", BumpySphere::dense(2000)},
                                   std::pair{"parts_low.obj", BumpySphere::light()}}) {
    save_obj(two_objects(part), folder / file);
  }
  save_obj(BumpySphere::dense(2000), folder / "ball.obj");
  save_obj(BumpySphere::light(64, 32), folder / "laid_out.obj");
  Mesh roof = plane(1, 1);
  for (Vec3& p : roof.positions) p.z += 1.2F;
  save_obj(roof, folder / "roof.obj");
  Job saved{.high = {(folder / "high.obj").string()},
            .low = (folder / "low.obj").string(),
            .out = (folder / "saved").string()};
  saved.bake.width = saved.bake.height = 64;
  saved.save_match = (folder / "match.exr").string();
  run(*device(), saved);
  std::ofstream(folder / "steep.cl") << "float4 kiln_map(const kiln_point* p) {\n  return "
                                        "(float4)(p->normal.z * 0.5f + 0.5f, 0, 0, 0);\n}\n";
  Image hills;
  hills.width = hills.height = 16;
  hills.channels = 1;
  for (int i = 0; i < 256; ++i) hills.pixels.push_back(static_cast<float>((i * 37) % 97) / 96);
  save_image(hills, folder / "hills.png", {ImageFormat::png16});
  save_image(hills, folder / "plain.png", {ImageFormat::png8});
  return folder;
}

/// Values with the folder of the scene in place of "{scene}".
std::vector<std::string> placed(std::vector<std::string> values, const fs::path& scene) {
  constexpr std::string_view kScene = "{scene}";
  for (std::string& value : values) {
    if (const std::size_t at = value.find(kScene); at != std::string::npos) {
      value.replace(at, kScene.size(), scene.string());
    }
  }
  return values;
}

fs::path output(const DoorCase& c, const fs::path& folder) {
  return c.out.empty() ? folder : folder / c.out;
}

std::map<std::string, std::string> files_in(const fs::path& folder) {
  std::map<std::string, std::string> files;
  if (!fs::exists(folder)) return files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    // Plots are the command's; records and tables name places.
    const bool plot = name.find("_plan") != std::string::npos;
    if (!entry.is_regular_file() || name.starts_with('.') || plot) continue;
    files[name] = read_file(entry.path());
  }
  return files;
}

int by_command(const DoorCase& c, const fs::path& scene, const fs::path& out) {
  std::vector<std::string> words = {"bake"};
  for (const char* side : {"high", "low"}) {
    for (const auto& [option, values] : c.options) {
      if (option == side) words.push_back(placed(values, scene)[0]);
    }
  }
  for (const auto& [option, values] : c.options) {
    if (option == "high" || option == "low") continue;
    std::string flag = "--" + option;
    std::replace(flag.begin(), flag.end(), '_', '-');
    for (const std::string& value : placed(values, scene)) {
      if (value == "true") {
        words.push_back(flag);
      } else {
        words.push_back(flag + "=" + value);
      }
    }
  }
  words.push_back("--out=" + out.string());
  const ProcessResult result = call_kiln(words);
  EXPECT_EQ(result.exit_code, c.exit_code) << result.errors;
  return result.exit_code;
}

Job job_of(const DoorCase& c, const fs::path& scene, const fs::path& out) {
  Job job;
  for (const auto& [option, values] : c.options) set_option(job, option, placed(values, scene));
  set_option(job, "out", out.string());
  return job;
}

void by_run(const Job& job) {
  const JobResult result = run(*device(), job);
  EXPECT_TRUE(result.failure.empty()) << result.failure.text();
  EXPECT_FALSE(result.files.empty());
}

void by_c(const DoorCase& c, const fs::path& scene, const fs::path& out) {
  kiln_job* job = nullptr;
  ASSERT_EQ(kiln_job_new(&job), KILN_OK);
  for (const auto& [option, values] : c.options) {
    for (const std::string& value : placed(values, scene)) {
      ASSERT_EQ(kiln_job_add(job, option.c_str(), value.c_str()), KILN_OK) << kiln_error_message();
    }
  }
  ASSERT_EQ(kiln_job_set(job, "out", out.string().c_str()), KILN_OK);
  kiln_job_result* result = nullptr;
  EXPECT_EQ(kiln_job_run(job, nullptr, nullptr, nullptr, &result), KILN_OK) << kiln_error_message();
  EXPECT_NE(kiln_job_file(result, 0), nullptr);
  EXPECT_EQ(kiln_job_failure(result), nullptr);
  kiln_job_result_free(result);
  kiln_job_free(job);
}

class Doors : public testing::TestWithParam<DoorCase> {};

TEST_P(Doors, WriteTheSameBytes) {
  KILN_REQUIRE_DEVICE();
  const DoorCase& c = GetParam();
  static const fs::path scene = make_doors_scene();
  const fs::path folder = scratch_folder();
  fs::path outs[4];
  for (int i = 0; i < 4; ++i) outs[i] = folder / ("door" + std::to_string(i));
  if (by_command(c, scene, output(c, outs[0])) != 0) {
    EXPECT_THROW(by_run(job_of(c, scene, output(c, outs[1]))), Error);
    return;
  }
  const std::map<std::string, std::string> wanted = files_in(outs[0]);
  ASSERT_FALSE(wanted.empty());
  const Job job = job_of(c, scene, output(c, outs[1]));
  by_run(job);
  Job again = job_from_json(to_json(job));
  EXPECT_EQ(to_json(again), to_json(job));
  again.out = output(c, outs[2]).string();
  by_run(again);
  by_c(c, scene, output(c, outs[3]));
  for (int i = 1; i < 4; ++i) {
    const std::map<std::string, std::string> files = files_in(outs[i]);
    EXPECT_EQ(files.size(), wanted.size()) << "door " << i;
    for (const auto& [name, bytes] : wanted) {
      const auto found = files.find(name);
      ASSERT_NE(found, files.end()) << name << " is missing at door " << i;
      EXPECT_TRUE(found->second == bytes) << name << " differs at door " << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Jobs, Doors, testing::ValuesIn(read_jobs()),
                         [](const auto& tested) { return tested.param.name; });

TEST(Job, InMemoryHasTheBytesOfTheFiles) {
  const fs::path scene = make_doors_scene();
  Job job{.high = {(scene / "two.glb").string()},
          .low = MakeLow{.faces = 300},
          .out = (scene / "door" / "game.glb").string()};
  job.bake.width = job.bake.height = 64;
  job.bake.occlusion.rays = 16;
  by_run(job);
  job.in_memory = true;
  const JobResult kept = run(*device(), job);
  EXPECT_TRUE(kept.files.empty());
  const std::string file = read_file(job.out);
  ASSERT_EQ(kept.glb.size(), file.size());
  EXPECT_EQ(std::memcmp(kept.glb.data(), file.data(), file.size()), 0);
  EXPECT_LE(kept.low.triangles.size(), 330U);
}

/// Colours are sRGB-encoded, values moved into their ranges, and texts and mip-maps are written, without a job, too.
TEST(Job, MapsOfTheLibraryAreSavedAsByJobs) {
  const fs::path scene = make_doors_scene();
  Mesh high = load_mesh(scene / "high.obj");
  for (const Vec3& p : high.positions) {
    const auto byte = [](float x) { return static_cast<std::uint8_t>(127.5F + 100 * x); };
    high.colors.push_back({byte(p.x), byte(p.y), byte(p.z), 255});
  }
  const Mesh low = load_mesh(scene / "low.obj");
  BakeOptions options;
  options.width = options.height = 64;
  options.maps = {MapKind::normal, "color", "height", "curvature", "position"};
  options.encoding.mips = true;
  BakeResult baked = bake(Source(*device(), high), low, options);
  for (const ImageFormat format : {ImageFormat::png16, ImageFormat::png8, ImageFormat::exr_half}) {
    const std::string ending(extension_of(format));
    const fs::path by_job = scene / "job", by_library = scene / "library";
    Job job{.high = {high}, .low = JobInput(low, "low"), .out = by_job.string()};
    job.bake = options;
    job.image.format = format;
    by_run(job);
    fs::create_directories(by_library);
    std::size_t files = 0;
    for (const BakedMap& map : baked.maps) {
      const fs::path path = by_library / ("low_" + std::string(map.kind.name) + ending);
      files += save_image(map, path, {format}).size();
      EXPECT_FALSE(map.stored);
    }
    const std::map<std::string, std::string> wanted = files_in(by_job);
    EXPECT_EQ(wanted.size(), files);
    for (const auto& [name, bytes] : files_in(by_library)) {
      ASSERT_TRUE(wanted.contains(name)) << name;
      EXPECT_TRUE(wanted.at(name) == bytes) << name;
    }
    fs::remove_all(by_job);
    fs::remove_all(by_library);
  }
  // A map that was converted is not converted again.
  BakedMap& color = baked.maps[1];
  to_stored(color, ImageFormat::png8);
  EXPECT_TRUE(color.stored);
  const std::vector<float> once = color.image.pixels;
  to_stored(color, ImageFormat::png8);
  EXPECT_EQ(color.image.pixels, once);
  const AssetMaps slots = asset_maps({&color, 1});
  ASSERT_EQ(slots.color, &color.image);
  EXPECT_EQ(color.image.pixels, once);
}

TEST(Job, AssetsOfBytesAreThoseOfFiles) {
  const fs::path scene = make_doors_scene();
  for (const char* file : {"two.glb", "high.obj"}) {
    const std::string text = read_file(scene / file);
    const Asset of_bytes = load_asset(std::as_bytes(std::span(text)), file);
    const Asset of_file = load_asset(scene / file);
    EXPECT_EQ(of_bytes.mesh.positions, of_file.mesh.positions);
    EXPECT_EQ(of_bytes.mesh.triangles, of_file.mesh.triangles);
    EXPECT_EQ(of_bytes.mesh.name, of_file.mesh.name);
    ASSERT_EQ(of_bytes.materials.size(), of_file.materials.size());
    for (std::size_t i = 0; i < of_file.materials.size(); ++i) {
      EXPECT_EQ(of_bytes.materials[i].name, of_file.materials[i].name);
      EXPECT_EQ(of_bytes.materials[i].alpha_mode, of_file.materials[i].alpha_mode);
    }
  }
  EXPECT_THROW(load_asset(std::span<const std::byte>(), "empty.glb"), Error);
}

TEST(Job, TakesMeshesInMemory) {
  const fs::path scene = make_doors_scene();
  Job job{.high = {(scene / "high.obj").string()},
          .low = (scene / "low.obj").string(),
          .out = (scene / "door").string()};
  job.bake.width = job.bake.height = 64;
  job.in_memory = true;
  const JobResult of_files = run(*device(), job);
  job.high = {load_mesh(scene / "high.obj")};
  job.low = load_mesh(scene / "low.obj");
  const JobResult of_memory = run(*device(), job);
  ASSERT_EQ(of_files.maps.size(), 1U);
  ASSERT_EQ(of_memory.maps.size(), 1U);
  EXPECT_EQ(of_memory.maps[0].name, "normal");
  EXPECT_EQ(of_memory.maps[0].map.image.pixels, of_files.maps[0].map.image.pixels);
  EXPECT_THROW(to_json(job), Error);
  job.reasons = true;
  EXPECT_THROW(check(job), Error);
}

/// An error says which option it is about, what it was given and may be, and what else to change; each door spells it.
TEST(Job, ErrorsCarryTheirData) {
  Job job{.high = {"high.obj"}, .low = "low.obj", .out = "maps"};
  const auto thrown = [](const auto& function) -> OptionError {
    try {
      function();
    } catch (const OptionError& error) {
      return error;
    }
    return OptionError("nothing was thrown");
  };
  const OptionError range = thrown([&] { set_option(job, "--samples", "17"); });
  EXPECT_EQ(range.code(), ErrorCode::usage);
  EXPECT_EQ(range.option(), "samples");
  EXPECT_EQ(range.value(), "17");
  EXPECT_EQ(range.allowed(), "1 to 16");
  EXPECT_TRUE(remedies_of(range.message()).empty());
  EXPECT_EQ(range.message().text(option_as_flag), "--samples is '17': give 1 to 16");
  EXPECT_EQ(range.message().text(option_as_keyword), "samples is '17': give 1 to 16");
  EXPECT_STREQ(range.what(), "job.bake.samples is '17': give 1 to 16");
  // A name that an option has in a text stays a text.
  const OptionError named = thrown([&] { set_option(job, "cage", "--samples.obj"); });
  EXPECT_EQ(named.option(), "cage");
  ASSERT_EQ(remedies_of(named.message()).size(), 1U);
  EXPECT_EQ(remedies_of(named.message())[0].option, "cage_mesh");
  EXPECT_NE(std::string(named.what()).find("'--samples.obj'"), std::string::npos);

  job.layers = true;
  const OptionError pair = thrown([&] { check(job); });
  EXPECT_EQ(pair.option(), "layers");
  ASSERT_EQ(remedies_of(pair.message()).size(), 1U);
  EXPECT_EQ(remedies_of(pair.message())[0].option, "format");
  EXPECT_EQ(remedies_of(pair.message())[0].value, "exr");
  EXPECT_EQ(pair.message().text(option_as_flag),
            "--layers writes one EXR with several layers: add --format exr or exr32.");
  EXPECT_EQ(pair.message().text(option_as_keyword),
            "layers writes one EXR with several layers: add format=\"exr\" or exr32.");
  EXPECT_STREQ(
      pair.what(),
      "job.layers writes one EXR with several layers: add job.image.format = exr or exr32.");
  kiln_job* c = nullptr;
  ASSERT_EQ(kiln_job_new(&c), KILN_OK);
  EXPECT_NE(kiln_job_set(c, "samples", "17"), KILN_OK);
  EXPECT_STREQ(kiln_error_message(), range.what());
  kiln_job_free(c);
}

/// Warnings, and errors of rooms below, name options as data, too.
TEST(Job, WarningsCarryTheirData) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_doors_scene();
  const std::string hills = (scene / "hills.png").string();
  Job job{.high = {hills}, .out = (scene / "maps").string()};
  set_option(job, "size", "64");
  set_option(job, "no_data", "12345");
  const JobResult result = run(*device(), job);
  const auto idle =
      std::find_if(result.causes.begin(), result.causes.end(),
                   [](const Warning& warning) { return warning.code == "no-data-idle"; });
  ASSERT_NE(idle, result.causes.end());
  const auto has = [](const std::string& text, const std::string& word) {
    return text.find(word) != std::string::npos;
  };
  EXPECT_TRUE(has(idle->message.text(option_as_flag), "the value of --no-data"));
  EXPECT_TRUE(has(idle->message.text(option_as_keyword), "the value of no_data"));
  const std::string member = "the value of job.heights.no_data";
  EXPECT_TRUE(has(idle->message.text(option_as_member), member));
  EXPECT_TRUE(has(result.report, "the value of --no-data"));
  const ProcessResult command =
      call_kiln({"bake", hills, "--size=64", "--no-data=12345", "--out=" + job.out});
  EXPECT_TRUE(has(command.errors, "the value of --no-data")) << command.errors;
  kiln_job* c = nullptr;
  ASSERT_EQ(kiln_job_new(&c), KILN_OK);
  for (const auto& [name, value] :
       {std::pair("high", hills.c_str()), std::pair("size", "64"), std::pair("no_data", "12345"),
        std::pair("out", job.out.c_str())}) {
    ASSERT_EQ(kiln_job_add(c, name, value), KILN_OK) << kiln_error_message();
  }
  kiln_job_result* of_c = nullptr;
  ASSERT_EQ(kiln_job_run(c, nullptr, nullptr, nullptr, &of_c), KILN_OK) << kiln_error_message();
  std::string told;
  for (std::size_t i = 0; kiln_job_warning(of_c, i) != nullptr; ++i)
    told += kiln_job_warning(of_c, i);
  EXPECT_TRUE(has(told, member)) << told;
  kiln_job_result_free(of_c);
  kiln_job_free(c);

  Job far{.high = {(scene / "high.obj").string()},
          .low = (scene / "low.obj").string(),
          .out = (scene / "far").string()};
  set_option(far, "match", "uv");
  try {
    run(*device(), far);
    ADD_FAILURE() << "HIGH has no UVs";
  } catch (const Error& error) {
    EXPECT_EQ(error.option(), "match.method");
    EXPECT_TRUE(has(error.message().text(option_as_flag), "which --match uv finds"))
        << error.what();
    EXPECT_TRUE(has(error.message().text(option_as_keyword), "which match=\"uv\" finds"));
    EXPECT_TRUE(has(error.what(), "which `match.method` uv finds"));
  }
}

/// No wrong value and no contradiction names a flag to those who link.
TEST(Job, ErrorsNameNoFlags) {
  const auto what = [](const auto& function) -> std::string {
    try {
      function();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  int told = 0;
  for (const std::string name :
       {"size",        "samples", "gutter",     "match",   "fallback",     "max_distance",
        "cage",        "views",   "view",       "light",   "origin",       "format",
        "space",       "faces",   "max_missed", "unwrap",  "maps",         "screen",
        "max_outline", "extent",  "height",     "no_data", "high_normals", "two_sided"}) {
    Job job;
    const std::string text = what([&] { set_option(job, name, "?"); });
    EXPECT_EQ(text.find("--"), std::string::npos) << text;
    EXPECT_NE(text.find("job."), std::string::npos) << name << ": " << text;
    ++told;
  }
  const Options contradictions[] = {{{"faces", {"10"}}, {"low", {"low.obj"}}},
                                    {{"layers", {"true"}}},
                                    {{"raw", {"true"}}},
                                    {{"lod", {"2"}}},
                                    {{"screen", {"600px"}}},
                                    {{"keep_parts", {"true"}}, {"low", {"low.obj"}}},
                                    {{"cage_mesh", {"cage.obj"}}},
                                    {{"save_cage", {"cage.obj"}}},
                                    {{"tangents", {"mikktspace"}}},
                                    {{"match_by", {"name"}}},
                                    {{"low_names", {"*"}}},
                                    {{"views", {"12"}}},
                                    {{"ao_rays", {"16"}}},
                                    {{"height", {"2"}}},
                                    {{"dither", {"true"}}},
                                    {{"alpha", {"mask"}}},
                                    {{"density", {"detail"}}, {"low", {"low.obj"}}},
                                    {{"out", {"maps.zip"}}},
                                    {{"range", {"height=1"}}, {"maps", {"height"}}},
                                    {{"pack", {"a=b"}}},
                                    {{"match", {"axis"}}},
                                    {{"max_angle", {"3"}}}};
  for (const Options& options : contradictions) {
    Job job{.high = {"high.obj"}, .low = MakeLow{.faces = 100}, .out = "maps"};
    for (const auto& [name, values] : options) {
      if (name == "low") job.low = JobLow("low.obj");
      if (name == "faces" || name != "low") set_option(job, name, values);
    }
    const std::string text = what([&] {
      check(job);
      run(*device(), job);
    });
    EXPECT_NE(text, "") << options[0].first;
    EXPECT_EQ(text.find("--"), std::string::npos) << text;
    ++told;
  }
  EXPECT_GT(told, 40);
}

/// A low poly that is made for maps in memory has no file to be named by.
TEST(Job, MakesALowPolyInMemory) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_doors_scene();
  Job job{.high = {load_mesh(scene / "high.obj")}, .low = MakeLow{.faces = 200}};
  job.in_memory = true;
  job.bake.width = job.bake.height = 32;
  const JobResult faces = run(*device(), job);
  ASSERT_EQ(faces.maps.size(), 1U);
  EXPECT_LE(faces.low.triangles.size(), 200U);
  job.low = MakeLow{.max_error = "normal=8"};
  job.bake.width = job.bake.height = 64;
  EXPECT_GT(run(*device(), job).low.triangles.size(), 0U);
}

/// What members point to is as what files hold.
TEST(Job, TakesCagesMatchesAndOccludersInMemory) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_doors_scene();
  Job job{.high = {load_mesh(scene / "high.obj")}, .low = load_mesh(scene / "low.obj")};
  job.in_memory = true;
  job.bake.width = job.bake.height = 32;
  job.bake.occlusion.rays = 16;
  job.bake.maps = {MapKind::normal, "ao"};
  Job files = job;
  files.cage_mesh = (scene / "cage.obj").string();
  files.occluders = {(scene / "cage.obj").string()};
  const JobResult wanted = run(*device(), files);
  const Mesh cage = load_mesh(scene / "cage.obj");
  job.bake.match.cage_mesh = &cage;
  job.bake.occlusion.by_others = {&cage};
  const JobResult found = run(*device(), job);
  ASSERT_EQ(found.maps.size(), 2U);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(found.maps[i].map.image.pixels, wanted.maps[i].map.image.pixels);
  }
  job.bake.match.ray.rule = RayRule::outermost;
  job.given = {"--ray"};
  EXPECT_THROW(check(job), Error);  // from a cage the first face is taken
  job.given.clear();
  job.bake.match.ray = {};
  job.high = {(scene / "high.obj").string()};
  job.low = (scene / "low.obj").string();
  EXPECT_THROW(to_json(job), Error);
  // A match is taken as it is.
  job.bake.match.cage_mesh = nullptr;
  const Mesh high = load_mesh(scene / "high.obj"), low = load_mesh(scene / "low.obj");
  BakeOptions by;
  by.width = by.height = 32;
  const Match match = kiln::match(Source(*device(), high), low, by).match;
  job.bake.occlusion.by_others.clear();
  const JobResult rays = run(*device(), job);
  job.bake.match.saved = &match;
  EXPECT_EQ(run(*device(), job).maps[0].map.image.pixels, rays.maps[0].map.image.pixels);
  job.bake.match.max_distance = Length::share(0.1);
  EXPECT_THROW(check(job), Error);
}

/// Alpha modes and sides that are said go before those of HIGH's materials.
TEST(Job, SaysTheLooksOfMaterials) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_doors_scene();
  Job job{.high = {(scene / "two.glb").string()},
          .low = MakeLow{.faces = 200},
          .out = (scene / "game.glb").string()};
  job.bake.width = job.bake.height = 32;
  job.bake.maps = {"color", "opacity"};
  const auto looks = [&] {
    run(*device(), job);
    return load_asset(job.out).materials;
  };
  // No material of HIGH is transparent: what is asked for by a map is masked.
  for (const Material& material : looks()) {
    EXPECT_EQ(material.alpha_mode, AlphaMode::mask);
    EXPECT_EQ(material.double_sided, material.name == "right");
  }
  job.alpha = AlphaMode::blend;
  job.double_sided = true;
  for (const Material& material : looks()) {
    EXPECT_EQ(material.alpha_mode, AlphaMode::blend);
    EXPECT_TRUE(material.double_sided);
  }
  job.out = (scene / "maps").string();
  EXPECT_THROW(check(job), Error);
}

/// Of lists of numbers, one is a value.
TEST(Job, ListsOfNumbersAreValues) {
  const Job job = job_from_json(
      R"({"size": [64, 32], "light": [0, 0.6, 0.8], "view": [[0, 0, 1], [1, 0, 0]], "range": {"height": [-1, 1]}})");
  EXPECT_EQ(job.bake.width, 64U);
  EXPECT_EQ(job.bake.height, 32U);
  EXPECT_EQ(job.bake.match.views.directions.size(), 2U);
  EXPECT_FLOAT_EQ(job.bake.light.direction.y, 0.6F);
  EXPECT_EQ(job.ranges, std::vector<std::string>{"height=-1,1"});
  Job other;
  other.bake.samples = 3;
  set_options(other, R"({"size": 16})");
  EXPECT_EQ(other.bake.width, 16U);
  EXPECT_EQ(other.bake.samples, 3U);
}

TEST(Job, OptionsHaveTheNamesOfFlagsAndMembers) {
  Job job;
  set_option(job, "--max-distance", "2%");
  EXPECT_TRUE(is_given(job, "max_distance"));
  EXPECT_EQ(option_values(job, "match.max_distance"), std::vector<std::string>{"2%"});
  set_option(job, "bake.match.max_distance", "0.5");
  ASSERT_TRUE(job.bake.match.max_distance);
  EXPECT_FALSE(job.bake.match.max_distance->relative);
  const auto message = [&](const char* name, const char* value) -> std::string {
    try {
      set_option(job, name, value);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message("max_distanse", "1").find("max_distance"), std::string::npos);
  EXPECT_NE(message("samples", "17").find("1 to 16"), std::string::npos);
  EXPECT_NE(message("samples", "").find("no value"), std::string::npos);
  EXPECT_EQ(job.bake.samples, BakeOptions().samples);
  for (const char* json :
       {"", "[]", "{\"faces\": [1, 2]}", "{\"nothing\": 1}", "{\"maps\": [[1]]}"}) {
    EXPECT_THROW(job_from_json(json), Error) << json;
  }
}

/// A member that was set is an option that was given, without a word of its flag.
TEST(Job, MembersCountAsFlagsDo) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_doors_scene();
  Job typed{.high = {(scene / "two.glb").string()},
            .low = MakeLow{.faces = 300},
            .out = (scene / "typed" / "game.glb").string()};
  typed.bake.width = typed.bake.height = 64;
  typed.bake.maps = {MapKind::normal};
  typed.clean = CleanHigh::none;
  typed.image.format = ImageFormat::webp;
  typed.bake.match.max_distance = Length::share(0.05);
  by_run(typed);
  Job named;
  for (const auto& [name, value] :
       std::map<std::string, std::string>{{"high", (scene / "two.glb").string()},
                                          {"faces", "300"},
                                          {"size", "64"},
                                          {"maps", "normal"},
                                          {"clean", "none"},
                                          {"format", "webp"},
                                          {"max_distance", "5%"}}) {
    set_option(named, name, value);
  }
  named.out = (scene / "named" / "game.glb").string();
  by_run(named);
  EXPECT_EQ(files_in(scene / "typed"), files_in(scene / "named"));
  const Asset asset = load_asset(scene / "typed" / "game.glb");
  for (const Material& material : asset.materials) EXPECT_TRUE(material.color_map.empty());
  // A flag that serves nothing is refused, however it was set.
  typed.bake.match.views.count = 12;
  EXPECT_THROW(check(typed), Error);
}

/// A map of the user's own stands alone where no other is named.
TEST(Job, OwnMapsBringNoOthers) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_doors_scene();
  Job job{.high = {(scene / "high.obj").string()}, .low = (scene / "low.obj").string()};
  job.in_memory = true;
  job.bake.width = job.bake.height = 32;
  job.own_maps = {"steep=" + (scene / "steep.cl").string()};
  const JobResult result = run(*device(), job);
  ASSERT_EQ(result.maps.size(), 1U);
  EXPECT_EQ(result.maps[0].name, "steep");
  job.own_maps.clear();
  EXPECT_EQ(run(*device(), job).maps.at(0).name, "normal");
}

/// Values that rows say of themselves, drawn at random: what is set is said again, and JSON keeps it.
TEST(Job, IsTheSameAfterJson) {
  std::mt19937 random(7);
  const auto below = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  const std::pair<const char*, std::vector<std::string>> values[] = {
      {"size", {"64", "128x32", "glass=64"}},
      {"maps", {"normal", "ao", "height", "near=ao:ao-rays=8"}},
      {"max_distance", {"2%", "0.125"}},
      {"faces", {"10", "20000"}},
      {"format", {"png8", "exr", "webp"}},
      {"gutter", {"inf", "0", "7"}},
      {"fallback", {"closest", "fill", "mark"}},
      {"views", {"auto", "5"}},
      {"light", {"1,2,3", "0,-1,0.25"}},
      {"max_error", {"0.2%", "normal=3deg,ao=2/255"}},
      {"unwrap", {"true", "pairs"}},
      {"no_data", {"none", "auto", "-9999"}},
      {"extent", {"10", "10,20"}},
      {"sets", {"udim", "one", "material"}},
      {"two_sided", {"true"}},
      {"ao_back_faces", {}},
      {"high_normals", {"flat", "35"}},
      {"ao_error", {"0.25", "1"}},
      {"view", {"0,0,1", "1,1,0"}},
      {"cage", {"auto", "1%"}},
      {"match_by", {"name", "all"}},
      {"clean", {"none", "all"}},
      {"recall", {"100"}},
      {"origin", {"1,2,3"}}};
  for (int i = 0; i < 300; ++i) {
    Job job;
    job.high = {"a b.glb"};
    job.out = "maps";
    for (const auto& [name, choices] : values) {
      if (choices.empty() || below(3) != 0) continue;
      set_option(job, name, choices[below(choices.size())]);
    }
    const std::string json = to_json(job);
    const Job again = job_from_json(json);
    ASSERT_EQ(to_json(again), json);
    for (const auto& [name, choices] : values) {
      if (choices.empty()) continue;
      ASSERT_EQ(option_values(again, name), option_values(job, name)) << name << "\n" << json;
    }
  }
}

// The warning counts what views see of all materials that were made double-sided, and of no other.
TEST(Job, ShellsOfSeveralMaterialsAreCountedTogether) {
  const auto bowl = [](float x, float size) {
    Mesh mesh = icosphere(4);
    std::vector<std::uint8_t> is_upper;
    for (const Triangle& t : mesh.triangles) {
      const float sum = mesh.positions[t[0]].y + mesh.positions[t[1]].y + mesh.positions[t[2]].y;
      is_upper.push_back(sum > 0 ? 1 : 0);
    }
    drop_triangles(mesh, is_upper);
    for (Vec3& p : mesh.positions) p = {size * p.x + x, size * p.y, size * p.z};
    return mesh;
  };
  const std::vector<Mesh> meshes = {bowl(0, 1), bowl(3, 0.8F), bowl(-3, 0.6F)};
  Mesh mesh = join_meshes(meshes);
  mesh.material_names = {"one", "two", "stated"};
  mesh.materials.clear();
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    mesh.materials.insert(mesh.materials.end(), meshes[m].triangles.size(), m);
  }
  const std::vector<OpenShells> shells = find_open_shells(mesh);
  ASSERT_EQ(shells.size(), 3U);
  std::vector<AssetMaterial> materials(3);
  const std::optional<Warning> warning =
      show_backs_of_shells(mesh, {false, false, true}, materials);
  ASSERT_TRUE(warning.has_value());
  EXPECT_EQ(warning->count, shells[0].back + shells[1].back);
  const double share = 100.0 * static_cast<double>(shells[0].back + shells[1].back) /
                       static_cast<double>(shells[0].front + shells[1].front + warning->count);
  EXPECT_NE(warning->message.text().find(std::to_string(std::lround(share)) + "% of what views"),
            std::string::npos)
      << warning->message.text();
  EXPECT_TRUE(materials[0].double_sided && materials[1].double_sided);
  EXPECT_FALSE(materials[2].double_sided);
}

TEST(Job, CTakesNullAndSaysWhatIsWrong) {
  EXPECT_EQ(kiln_job_new(nullptr), KILN_USAGE);
  EXPECT_EQ(kiln_job_set(nullptr, "faces", "1"), KILN_USAGE);
  EXPECT_EQ(kiln_job_run(nullptr, nullptr, nullptr, nullptr, nullptr), KILN_USAGE);
  kiln_job* job = nullptr;
  ASSERT_EQ(kiln_job_new(&job), KILN_OK);
  EXPECT_EQ(kiln_job_set(job, nullptr, "1"), KILN_USAGE);
  EXPECT_EQ(kiln_job_set(job, "faces", nullptr), KILN_USAGE);
  EXPECT_EQ(kiln_job_add(job, nullptr, "1"), KILN_USAGE);
  EXPECT_EQ(kiln_job_set_json(job, "{"), KILN_USAGE);
  EXPECT_EQ(kiln_job_set_high(job, nullptr, nullptr), KILN_USAGE);
  EXPECT_EQ(kiln_job_set(job, "facets", "1"), KILN_USAGE);
  EXPECT_NE(std::string(kiln_error_message()).find("faces"), std::string::npos);
  kiln_job_result* result = nullptr;
  EXPECT_EQ(kiln_job_run(job, nullptr, nullptr, nullptr, &result), KILN_USAGE);  // no high poly
  EXPECT_EQ(result, nullptr);
  kiln_job_free(job);
  kiln_job_free(nullptr);
  kiln_job_result_free(nullptr);
  size_t size = 7;
  EXPECT_EQ(kiln_job_glb(nullptr, &size), nullptr);
  EXPECT_EQ(kiln_job_file(nullptr, 0), nullptr);
  EXPECT_EQ(kiln_job_map(nullptr, 0, nullptr), KILN_USAGE);
  EXPECT_EQ(kiln_job_low(nullptr, nullptr), KILN_USAGE);
}

TEST(Job, CKeepsResultsInMemory) {
  KILN_REQUIRE_DEVICE();
  const fs::path scene = make_doors_scene();
  kiln_mesh *high = nullptr, *low = nullptr, *made = nullptr;
  ASSERT_EQ(kiln_mesh_load((scene / "high.obj").string().c_str(), &high), KILN_OK);
  ASSERT_EQ(kiln_mesh_load((scene / "low.obj").string().c_str(), &low), KILN_OK);
  kiln_job* job = nullptr;
  ASSERT_EQ(kiln_job_new(&job), KILN_OK);
  ASSERT_EQ(kiln_job_set_high(job, high, nullptr), KILN_OK);
  ASSERT_EQ(kiln_job_set_low(job, low, nullptr), KILN_OK);
  ASSERT_EQ(kiln_job_set_in_memory(job, 1), KILN_OK);
  ASSERT_EQ(kiln_job_set(job, "size", "32x16"), KILN_OK);
  kiln_job_result* result = nullptr;
  ASSERT_EQ(kiln_job_run(job, nullptr, nullptr, nullptr, &result), KILN_OK) << kiln_error_message();
  kiln_job_image image;
  kiln_job_image_init(&image);
  ASSERT_EQ(kiln_job_map(result, 0, &image), KILN_OK);
  EXPECT_EQ(std::string(image.name), "normal");
  EXPECT_EQ(image.width, 32U);
  EXPECT_EQ(image.height, 16U);
  EXPECT_EQ(image.channels, 3U);
  EXPECT_EQ(kiln_job_map(result, 1, &image), KILN_USAGE);
  EXPECT_EQ(kiln_job_file(result, 0), nullptr);
  ASSERT_EQ(kiln_job_low(result, &made), KILN_OK);
  kiln_mesh_free(made);
  kiln_job_result_free(result);
  kiln_job_free(job);
  kiln_mesh_free(high);
  kiln_mesh_free(low);
}

}  // namespace
}  // namespace kiln::test
