// Limits of a job at their very numbers, and what two of a kind are taken for.
#include <cmath>
#include <utility>

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

}  // namespace
}  // namespace kiln::test
