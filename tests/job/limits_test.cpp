// Limits of a job at their very numbers, and what two of a kind are taken for.
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "job/job_scene.h"

namespace kiln::test {
namespace {

using nlohmann::json;

Job job_of(const Mesh& high, const Mesh& low) {
  Job job;
  job.high = {JobInput(high, "high")};
  job.low = JobLow(low);
  job.out = "maps";
  job.bake.width = job.bake.height = 32;
  job.bake.maps = {MapKind::normal};
  job.bake.match.max_distance = Length::absolute(0.5);
  return job;
}

/// "Fails if more samples are missed": as many as allowed are not more.
TEST(JobLimits, AsManyMissedSamplesAsAllowedAreNoFailure) {
  KILN_REQUIRE_DEVICE();
  for (const float width : {1.0F, 0.5F}) {
    Job job = job_of(square_at(width == 1 ? 0 : -0.25F, 0.02F, "h", width), square_at(0, 0, "l"));
    const json texels = json::parse(run_in_memory(job).report)["texels"];
    const auto missed = texels["missed"].get<double>(), samples = texels["samples"].get<double>();
    ASSERT_EQ(missed > 0, width < 1);
    const double percent = 100.0 * missed / samples;
    job.max_missed_percent = percent;
    EXPECT_TRUE(run_in_memory(job).failure.text().empty()) << percent;
    if (width == 1) continue;
    EXPECT_NEAR(percent, 50, 5);
    job.max_missed_percent = std::nextafter(percent, 0);
    EXPECT_FALSE(run_in_memory(job).failure.text().empty()) << percent;
  }
}

/// A square in each of several UDIM tiles, over which HIGH leans by turns.
std::pair<Mesh, Mesh> tiles(std::size_t count, bool differ) {
  std::vector<Mesh> high, low;
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = static_cast<float>(2 * i);
    Mesh leaning = square_at(x, 0.02F, "h");
    const float slope = differ && i % 2 == 1 ? -0.3F : 0.3F;
    for (Vec3& p : leaning.positions) p.z += slope * (p.x - x);
    leaning.normals.clear();
    leaning.normal_triangles.clear();
    high.push_back(std::move(leaning));
    low.push_back(square_at(x, 0, "l"));
    for (Vec2& uv : low.back().uvs) uv.x += static_cast<float>(i);
  }
  return {join_meshes(high), join_meshes(low)};
}

/// Two tiles of different surfaces are two sets as three are three; tiles of one surface are repeats.
TEST(JobLimits, TilesOfDifferentSurfacesAreSets) {
  KILN_REQUIRE_DEVICE();
  for (const std::size_t count : {1U, 2U, 3U}) {
    for (const bool differ : {false, true}) {
      const auto [high, low] = tiles(count, differ);
      const json report = json::parse(run_in_memory(job_of(high, low)).report);
      const std::size_t sets = report.contains("sets") ? report["sets"].size() : 0;
      EXPECT_EQ(sets, differ && count > 1 ? count : 0U) << count << ' ' << differ;
    }
  }
}

/// Characters that file systems, MTL files or shells do not accept are replaced in names of files; others stay.
TEST(JobLimits, SetsHaveSafeFileNames) {
  KILN_REQUIRE_DEVICE();
  std::vector<Mesh> low;
  const char* const odd =
      "a\x7F"
      "b\x1F"
      "c d";
  const char* const names[] = {odd, "x/y\\z:!", "Plain-1_\xC3\xA4.~", "plain-1_\xC3\xA4.~"};
  for (const char* name : names)
    low.push_back(square_at(2.0F * static_cast<float>(low.size()), 0, name));
  Mesh high = join_meshes(low);
  for (Vec3& p : high.positions) p.z += 0.02F;
  Job job = job_of(high, join_meshes(low));
  job.sets = SetsBy::material;
  job.out = (scratch_folder() / "maps").string();
  check(job);
  std::vector<std::string> files;
  for (const std::string& file : run_job([] { return *device(); }, job, {}, {}).files) {
    const std::string stem = std::filesystem::path(file).filename().string();
    if (stem.ends_with("_normal.png")) files.push_back(stem);
  }
  ASSERT_EQ(files.size(), 4U);
  const std::string start = files[0].substr(0, files[0].find("_a_b"));
  // The last one differs from the third in case alone, which some file systems ignore.
  const char* const words[] = {"a_b_c_d", "x_y_z__", "Plain-1_\xC3\xA4.~", "plain-1_\xC3\xA4.~_2"};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(files[i], start + "_" + words[i] + "_normal.png");
}

/// A plan makes its low poly itself, so it refuses what needs one, and maps that are too small in either direction.
TEST(JobLimits, PlansRefuseWhatNeedsALowPoly) {
  Job plain;
  plain.high = {JobInput(BumpySphere::dense(500), "high")};
  plain.low.make.max_error = "normal=5";
  plain.out = "maps";
  plain.bake.width = plain.bake.height = 64;
  plain.bake.maps = {MapKind::normal};
  EXPECT_NO_THROW(check(plain));
  const auto refuses = [&](const char* words, const auto& change) {
    Job job = plain;
    change(job);
    try {
      check(job);
      ADD_FAILURE() << "not refused: " << words;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
      EXPECT_NE(error.message().text().find(words), std::string::npos) << error.message().text();
    }
  };
  refuses("need a LOW", [](Job& job) { job.cage_mesh = "cage.obj"; });
  refuses("need a LOW", [](Job& job) { job.cage_auto = true; });
  refuses("need a LOW", [](Job& job) { job.parts_by = PartsBy::name; });
  refuses("is the largest map", [](Job& job) { job.bake.width = 8; });
  refuses("is the largest map", [](Job& job) { job.bake.height = 8; });
  refuses("both limit the error", [](Job& job) { job.low.make.max_angle = "5"; });
  refuses("measures normal maps", [](Job& job) { job.bake.maps = {MapKind{"ao"}}; });
}

/// The screen must leave 16 pixels to the last level: each level halves it.
TEST(JobLimits, TheLastLevelHasSixteenPixels) {
  for (const std::uint32_t levels : {2U, 3U, 5U}) {
    const std::uint32_t least = 16U << (levels - 1);
    for (const std::uint32_t pixels : {least - 1, least}) {
      Job job;
      job.high = {JobInput(BumpySphere::dense(500), "high")};
      job.low.make.max_error = "normal=5";
      job.low.make.lods = levels;
      job.low.make.screen = std::to_string(pixels) + "px";
      job.out = "maps";
      job.bake.maps = {MapKind::normal};
      const auto run_check = [&] { check(job); };
      if (pixels < least) {
        EXPECT_THROW(run_check(), Error) << levels;
      } else {
        EXPECT_NO_THROW(run_check()) << levels;
      }
    }
  }
}

}  // namespace
}  // namespace kiln::test
