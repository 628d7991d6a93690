// What a limit on the bytes of a GLB is spent on, and what the report says of it.
#include <cmath>
#include <map>
#include <string>

#include "job/job_scene.h"

namespace kiln::test {
namespace {

using nlohmann::json;

/// A square with bumps that a map must hold, scaled around its middle.
Mesh bumpy_square(float x, const std::string& material, float scale) {
  Mesh mesh = plane(96, 96, 1, 1);
  for (Vec3& p : mesh.positions) {
    const float z = 0.01F * std::sin(40 * p.x) * std::sin(34 * p.y) + 0.02F;
    p = {scale * p.x + x, scale * p.y, scale * z};
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  mesh.material_names = {material};
  mesh.materials.assign(mesh.triangles.size(), 0);
  return mesh;
}

Mesh scaled_square(float x, const std::string& material, float scale) {
  Mesh mesh = square_at(0, 0, material);
  for (Vec3& p : mesh.positions) p = {scale * p.x + x, scale * p.y, p.z};
  return mesh;
}

Job limited_job(const Mesh& high, std::uint64_t bytes) {
  Job job;
  job.high = {JobInput(high, "high")};
  job.out = "a.glb";
  job.bake.width = job.bake.height = 128;
  job.bake.maps = {MapKind::normal};
  job.given = {"--maps"};
  job.max_bytes = bytes;
  return job;
}

/// Texture sets with the same detail: the one that covers more of the surface has more of the bytes.
TEST(JobBytes, SetsHaveBytesByTheirShareOfTheSurface) {
  KILN_REQUIRE_DEVICE();
  for (const bool is_first : {false, true}) {
    const float first = is_first ? 1 : 0.25F, second = is_first ? 0.25F : 1;
    Job job = limited_job(
        join_meshes(std::vector<Mesh>{bumpy_square(0, "a", first), bumpy_square(3, "b", second)}),
        30000);
    job.low = JobLow(join_meshes(
        std::vector<Mesh>{scaled_square(0, "a", first), scaled_square(3, "b", second)}));
    job.sets = SetsBy::material;
    job.bake.match.max_distance = Length::absolute(0.1);
    const json pictures = json::parse(run_in_memory(job).report)["bytes"]["pictures"];
    ASSERT_EQ(pictures.size(), 2U);
    const auto large = pictures[is_first ? 0 : 1]["bytes"].get<double>(),
               small = pictures[is_first ? 1 : 0]["bytes"].get<double>();
    EXPECT_GT(large, 1.5 * small);
  }
}

/// Pictures that a function samples have no size before they are made: a third of the bytes is left for them.
TEST(JobBytes, PlansLeaveAThirdForSampledPictures) {
  KILN_REQUIRE_DEVICE();
  const Job job = limited_job(BumpySphere::dense(4000), 30000);
  RunHooks hooks;
  hooks.sample = [](const Match& match, const Mesh&) {
    std::map<std::string, Image> images;
    images["color"] = {match.width / match.samples, match.height / match.samples, 3, {}};
    images["color"].pixels.assign(std::size_t{images["color"].width} * images["color"].height * 3,
                                  0.5F);
    return images;
  };
  for (const bool samples : {false, true}) {
    const json bytes =
        json::parse(run_in_memory(job, samples ? hooks : RunHooks()).report)["bytes"];
    const auto planned = bytes["trials"][bytes["chosen"].get<std::size_t>()]["bytes"].get<double>();
    EXPECT_LE(planned, samples ? 20000 : 30000);
    EXPECT_GT(planned, samples ? 15000 : 20000);
  }
}

}  // namespace
}  // namespace kiln::test
