// What a limit on the bytes of a GLB is spent on, and what the report says of it.
#include <cmath>
#include <cstring>
#include <map>
#include <span>
#include <string>

#include "job/job_scene.h"
#include "kiln/image.h"

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

/// What the report says of bytes, sizes and faces is what the file holds.
TEST(JobBytes, TheReportIsOfTheFile) {
  KILN_REQUIRE_DEVICE();
  const Job job = limited_job(BumpySphere::dense(4000), 30000);
  const JobResult result = run_in_memory(job);
  const json bytes = json::parse(result.report)["bytes"];
  EXPECT_EQ(bytes["max"], 30000);
  EXPECT_EQ(bytes["file"], result.glb.size());
  EXPECT_LE(result.glb.size(), 30000U);
  const json head = head_of(result.glb);
  std::size_t at = 0;
  std::memcpy(&at, result.glb.data() + 12, 4);
  at += 20 + 8;
  ASSERT_EQ(head["images"].size(), bytes["pictures"].size());
  std::uint64_t sum = 0;
  double steps = 0;
  for (std::size_t i = 0; i < bytes["pictures"].size(); ++i) {
    const json& picture = bytes["pictures"][i];
    const json& view = head["bufferViews"][head["images"][i]["bufferView"].get<std::size_t>()];
    const auto length = view["byteLength"].get<std::uint64_t>();
    EXPECT_EQ(picture["bytes"], (length + 3) / 4 * 4);
    const Image image = load_image(
        std::span(result.glb).subspan(at + view.value("byteOffset", std::size_t{0}), length));
    EXPECT_EQ(picture["width"], image.width);
    EXPECT_EQ(picture["height"], image.height);
    EXPECT_EQ("image/" + picture["format"].get<std::string>(), head["images"][i]["mimeType"]);
    sum += picture["bytes"].get<std::uint64_t>();
    steps += picture["error_steps"].get<double>();
  }
  EXPECT_NEAR(bytes["error_steps"].get<double>(), steps, 1e-9 * steps);
  const json& chosen = bytes["trials"][bytes["chosen"].get<std::size_t>()];
  EXPECT_EQ(chosen["faces"], result.low.triangles.size());
  EXPECT_EQ(chosen["fits"], true);
  // The mesh takes what was predicted, but for the JSON of pictures that are not there and what it was allowed to grow.
  const std::uint64_t mesh_bytes = result.glb.size() - sum;
  EXPECT_LE(mesh_bytes, chosen["mesh_bytes"].get<std::uint64_t>());
  EXPECT_GE(mesh_bytes + 2048, chosen["mesh_bytes"].get<std::uint64_t>());
  for (const json& trial : bytes["trials"]) {
    std::uint64_t pictures = 0;
    for (const json& picture : trial["pictures"]) pictures += picture["bytes"].get<std::uint64_t>();
    if (!trial["fits"].get<bool>()) continue;
    EXPECT_EQ(trial["bytes"], trial["mesh_bytes"].get<std::uint64_t>() + pictures);
    EXPECT_LE(trial["bytes"], 30000);
    EXPECT_GE(trial["error_steps"], chosen["error_steps"]);
  }
}

}  // namespace
}  // namespace kiln::test
