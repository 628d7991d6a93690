// High polys that are larger than memory: from which sizes on they are streamed, and which options of a job keep them
// from it.
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "asset/ply_stream.h"
#include "job/job_scene.h"
#include "job/stages.h"
#include "job/streaming.h"
#include "kiln/limits.h"
#include "source/streamed_files.h"

namespace kiln::test {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;

/// A job whose high poly of 300,000 triangles takes at least 29 MiB in a bake, and 42 typically.
struct LargeHigh {
  LargeHigh() {
    job.high = {save_ply(BumpySphere::dense(300000), scratch_folder())};
    job.low = BumpySphere::light();
    job.out = "maps";
    job.bake.width = job.bake.height = 64;
    job.bake.maps = {MapKind::normal};
    job.given = {"--maps"};
  }

  /// True if the high poly is streamed with so much memory left.
  bool is_streamed(std::uint64_t mebibytes) const {
    RunLog log({}, {});
    leave_memory(mebibytes * kMebibyte);
    bool streamed = false;
    const std::string error =
        error_of([&] { streamed = open_streamed_high(job, job.bake, hooks, log) != nullptr; });
    set_memory_limit(0);
    EXPECT_EQ(error, "");
    return streamed;
  }
  /// The error with so little memory left that no bake can hold the high poly.
  std::string error() const {
    RunLog log({}, {});
    leave_memory(20 * kMebibyte);
    const std::string text = error_of([&] { open_streamed_high(job, job.bake, hooks, log); });
    set_memory_limit(0);
    return text;
  }

  Job job;
  RunHooks hooks;
};

/// Each option that needs the whole mesh is named; without it the same job streams.
TEST(LargeHigh, OptionsThatNeedTheWholeMeshAreNamed) {
  const LargeHigh plain;
  ASSERT_TRUE(plain.is_streamed(35));
  struct Case {
    const char* name;
    std::function<void(LargeHigh&)> give;
  };
  const Case cases[] = {
      {"job.max_bytes", [](LargeHigh& at) { at.job.max_bytes = 100000; }},
      {"job.transfers", [](LargeHigh& at) { at.job.transfers = {"a.png:relief"}; }},
      {"job.bake.match.method = auto", [](LargeHigh& at) { at.job.match_auto = true; }},
      {"job.bake.match.cage = auto", [](LargeHigh& at) { at.job.cage_auto = true; }},
      {"job.parts_by", [](LargeHigh& at) { at.job.parts_by = PartsBy::name; }},
      {"job.load_match", [](LargeHigh& at) { at.job.load_match = "a.exr"; }},
      {"job.save_match", [](LargeHigh& at) { at.job.save_match = "a.exr"; }},
      {"job.save_source", [](LargeHigh& at) { at.job.save_source = "a.kiln"; }},
      {"job.reasons", [](LargeHigh& at) { at.job.reasons = true; }},
      {"job.alpha_test", [](LargeHigh& at) { at.job.alpha_test = 0.5; }},
      {"a function that samples images",
       [](LargeHigh& at) {
         at.hooks.sample = [](const Match&, const Mesh&) { return std::map<std::string, Image>(); };
       }},
      {"job.clean = all",
       [](LargeHigh& at) {
         at.job.given.insert("--clean");
         at.job.clean = CleanHigh::all;
       }},
      {"job.fill_holes", [](LargeHigh& at) { at.job.fill_holes = 5; }},
      {"job.frame.up", [](LargeHigh& at) { at.job.frame.up = {"high=z"}; }},
      {"job.frame.unit", [](LargeHigh& at) { at.job.frame.unit = {"high=cm"}; }},
      {"job.frame.shading", [](LargeHigh& at) { at.job.frame.shading.rule = ShadingRule::flat; }},
      {"job.frame.shading", [](LargeHigh& at) { at.job.frame.shading.rule = ShadingRule::angle; }},
  };
  for (const Case& each : cases) {
    LargeHigh with = plain;
    each.give(with);
    const std::string error = with.error();
    EXPECT_NE(error.find("is larger than memory, and " + std::string(each.name)), std::string::npos)
        << each.name << ": " << error;
    EXPECT_NE(error.find("needs the whole high poly in memory: leave it out."), std::string::npos)
        << error;
    // Where the mesh may fit, it is read whole in place of an error.
    EXPECT_FALSE(with.is_streamed(150)) << each.name;
  }
  LargeHigh kept = plain;
  kept.job.given.insert("--clean");
  kept.job.clean = CleanHigh::none;
  EXPECT_TRUE(kept.is_streamed(35));
}

/// Plans simplify the whole mesh to many sizes, and compare its pictures with theirs. The remedies bake from the same file.
TEST(LargeHigh, PlansAreRefusedWithARemedy) {
  const LargeHigh plain;
  const auto expect_refused = [&](const std::function<void(JobLow&)>& make) {
    LargeHigh plan = plain;
    plan.job.low = JobLow();
    make(plan.job.low);
    const std::string error = plan.error();
    EXPECT_NE(error.find("planning a LOW by rendered errors needs the whole high poly in memory: "
                         "give LOW, job.low.make.faces, or a largest deviation "
                         "(job.low.make.max_error = 0.2%)"),
              std::string::npos)
        << error;
    EXPECT_FALSE(plan.is_streamed(400));  // It is read whole where it may fit.
  };
  expect_refused([](JobLow& low) { low.make.max_error = "normal=4"; });
  expect_refused([](JobLow& low) { low.make.max_angle = "2"; });
  LargeHigh remedy = plain;
  remedy.job.low = JobLow();
  remedy.job.low.make.max_error = "0.2%";
  EXPECT_TRUE(remedy.is_streamed(250));
  remedy.job.low.make.max_error.clear();
  remedy.job.low.make.faces = 500;
  EXPECT_TRUE(remedy.is_streamed(250));
}

/// Only one file is streamed.
TEST(LargeHigh, SeveralMeshesAreReadWhole) {
  LargeHigh two;
  two.job.high.push_back(two.job.high.front());
  EXPECT_FALSE(two.is_streamed(20));
  LargeHigh in_memory;
  in_memory.job.high = {JobInput(tetrahedron(), "high")};
  EXPECT_FALSE(in_memory.is_streamed(1));
}

/// What is needed: 256 MiB, 32 bytes a texel, and 140 bytes a triangle in a bake, 240 if a low poly of
/// some number of faces is made of it, 420 if one within an error is.
TEST(LargeHigh, StreamsFromTheMemoryOnThatABakeNeeds) {
  LargeHigh high;
  EXPECT_TRUE(high.is_streamed(256 + 40 - 16));
  EXPECT_FALSE(high.is_streamed(256 + 40 + 16));
  high.job.bake.width = 4096;
  high.job.bake.height = 2048;
  EXPECT_TRUE(high.is_streamed(256 + 40 + 256 - 16));
  EXPECT_FALSE(high.is_streamed(256 + 40 + 256 + 16));
  high.job.bake.width = high.job.bake.height = 64;
  high.job.low = JobLow();
  high.job.low.make.faces = 500;
  EXPECT_TRUE(high.is_streamed(256 + 69 - 16));
  EXPECT_FALSE(high.is_streamed(256 + 69 + 16));
  high.job.low.make = MakeLow{.max_error = "1%"};
  EXPECT_TRUE(high.is_streamed(256 + 120 - 16));
  EXPECT_FALSE(high.is_streamed(256 + 120 + 16));
}

/// Maps of an asset that are left to Kiln: those of a mesh in memory, and colours if the mesh has some.
TEST(LargeHigh, AssetsHaveColoursIfTheMeshHasThem) {
  const fs::path folder = scratch_folder();
  Mesh mesh = tetrahedron();
  for (const bool colored : {false, true}) {
    if (colored) mesh.colors.assign(mesh.positions.size(), {1, 2, 3, 255});
    const auto stream = stream_ply(save_ply(mesh, folder));
    EXPECT_EQ(stream->has_colors(), colored);
    Job job;
    job.out = "game.glb";
    set_default_asset_maps(job);
    ASSERT_TRUE(choose_streamed_asset_maps(job, *stream));
    std::vector<MapKind> expected = {MapKind::normal, MapKind{"ao"}};
    if (colored) expected.emplace_back("color");
    EXPECT_EQ(job.bake.maps, expected);
    job.given.insert("--maps");
    EXPECT_FALSE(choose_streamed_asset_maps(job, *stream));
  }
}

/// The report states the normals that are used.
TEST(LargeHigh, NormalsAreTheFilesOrSmooth) {
  const fs::path folder = scratch_folder();
  Mesh mesh = BumpySphere::dense(500, true);
  mesh.normal_triangles.clear();
  ShadingReport report = shading_of(*stream_ply(save_ply(mesh, folder)));
  EXPECT_EQ(report.chosen, ShadingRule::file);
  EXPECT_EQ(report.given, mesh.triangles.size());
  EXPECT_EQ(report.missing, 0U);
  mesh.normals.clear();
  report = shading_of(*stream_ply(save_ply(mesh, folder)));
  EXPECT_EQ(report.chosen, ShadingRule::smooth);
  EXPECT_EQ(report.given, 0U);
  EXPECT_EQ(report.missing, mesh.triangles.size());
}

}  // namespace
}  // namespace kiln::test
