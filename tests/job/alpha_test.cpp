// Alpha modes of an asset's materials: those of the high poly, of opacity that the caller samples, and the user's.
#include <array>
#include <optional>

#include "job/job_scene.h"
#include "kiln/image.h"

namespace kiln::test {
namespace {

using nlohmann::json;

struct AlphaCase {
  const char* what;
  AlphaMode glass;  ///< Mode of HIGH's transparent material; its other one is opaque
  bool is_sampled;  ///< The caller samples the opacity of both
  std::optional<AlphaMode> asked;
  AlphaMode stone_wanted, glass_wanted;
  float cutoff_wanted = 0.5F;
};

constexpr AlphaMode kOpaque = AlphaMode::opaque, kMask = AlphaMode::mask, kBlend = AlphaMode::blend;

constexpr std::array<AlphaCase, 9> kCases = {{
    {"each keeps its mode: blend", kBlend, false, {}, kOpaque, kBlend},
    {"each keeps its mode: mask", kMask, false, {}, kOpaque, kMask, 0.25F},
    {"an opacity map where nothing is transparent", kOpaque, false, {}, kMask, kMask},
    {"sampled, nothing else transparent", kOpaque, true, {}, kMask, kMask},
    {"sampled beside blend", kBlend, true, {}, kBlend, kBlend},
    {"sampled beside mask", kMask, true, {}, kMask, kMask},
    {"asked for blend over mask", kMask, false, kBlend, kBlend, kBlend},
    {"asked for mask over blend", kBlend, false, kMask, kMask, kMask},
    {"asked for mask over mask", kMask, false, kMask, kMask, kMask, 0.25F},
}};

/// A high poly of two sheets, each with a material: stone is opaque, glass of the given mode.
Asset high_of(AlphaMode glass) {
  Asset high;
  high.mesh = join_meshes(
      std::vector<Mesh>{square_at(0, 0.01F, "stone", 0.9F), square_at(1, 0.01F, "glass", 0.9F)});
  high.materials.resize(2);
  high.materials[0] = {.name = "stone", .alpha_mode = kOpaque, .place = "0"};
  high.materials[1] = {.name = "glass",
                       .opacity = glass == kOpaque ? 1.0F : 0.5F,
                       .alpha_mode = glass,
                       .alpha_cutoff = 0.25F,
                       .place = "1"};
  return high;
}

/// The low poly: two squares with the same materials, side by side in one atlas.
Mesh low_of_two() {
  Mesh low = join_meshes(std::vector<Mesh>{square_at(0, 0, "stone"), square_at(1, 0, "glass")});
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = low.positions[low.triangles[t][k]];
      low.uvs[low.uv_triangles[t][k]] = {(p.x + 0.5F) / 2, p.y + 0.5F};
    }
  }
  return low;
}

std::string name_of(AlphaMode mode) {
  return mode == kBlend ? "BLEND" : mode == kMask ? "MASK" : "OPAQUE";
}

Job job_of(const AlphaCase& one) {
  Job job;
  job.high = {JobInput(high_of(one.glass), "high")};
  job.out = "a.glb";
  job.bake.width = job.bake.height = 32;
  job.bake.maps = {MapKind::normal, MapKind{"opacity"}};
  job.alpha = one.asked;
  return job;
}

RunHooks hooks_of(const AlphaCase& one, std::uint32_t size) {
  RunHooks hooks;
  if (!one.is_sampled) return hooks;
  hooks.sample = [size](const Match&, const Mesh&) {
    return std::map<std::string, Image>{
        {"opacity", Image{size, size, 1, std::vector<float>(std::size_t{size} * size, 0.75F)}}};
  };
  return hooks;
}

void expect_modes(const AlphaCase& one, const json& head) {
  std::size_t found = 0;
  for (const json& material : head["materials"]) {
    const std::string name = material["name"];
    const bool is_glass = name.find("glass") != std::string::npos;
    EXPECT_EQ(material.value("alphaMode", "OPAQUE"),
              name_of(is_glass ? one.glass_wanted : one.stone_wanted))
        << name;
    if (is_glass && one.glass_wanted == kMask) {
      EXPECT_EQ(material.value("alphaCutoff", 0.5F), one.cutoff_wanted);
    }
    ++found;
  }
  EXPECT_GE(found, 2U);
}

TEST(JobAlpha, ModesAreThoseOfHighOrOfSampledOpacityOrTheUsers) {
  KILN_REQUIRE_DEVICE();
  for (const AlphaCase& one : kCases) {
    SCOPED_TRACE(one.what);
    Job job = job_of(one);
    job.low = JobLow(low_of_two());
    expect_modes(one, head_of(run_in_memory(job, hooks_of(one, 32)).glb));
  }
}

/// A material is as transparent by its number, by a picture, or by its vertices' alpha.
TEST(JobAlpha, AnyKindOfOpacityIsTransparent) {
  KILN_REQUIRE_DEVICE();
  const auto picture =
      std::make_shared<const std::vector<std::byte>>(encode(Image{1, 1, 1, {0.5F}}, {}));
  for (int kind = 0; kind < 4; ++kind) {
    Asset high = high_of(kBlend);
    Material& glass = high.materials[1];
    glass.opacity = kind == 1 ? 0.5F : 1.0F;
    if (kind == 2) glass.opacity_map.bytes = picture;
    if (kind == 3) {
      glass.multiplies = glass.vertex_opacity = true;
      high.mesh.colors.assign(high.mesh.positions.size(), {255, 255, 255, 128});
    }
    Job job = job_of(kCases[0]);
    job.high = {JobInput(high, "high")};
    job.low = JobLow(low_of_two());
    const json head = head_of(run_in_memory(job).glb);
    for (const json& material : head["materials"]) {
      const bool is_glass = material["name"].get<std::string>().find("glass") != std::string::npos;
      // Where nothing is transparent, opacity that is asked for is a mask of both.
      EXPECT_EQ(material.value("alphaMode", "OPAQUE"), kind == 0  ? "MASK"
                                                       : is_glass ? "BLEND"
                                                                  : "OPAQUE")
          << kind;
    }
  }
}

/// All levels of one file have the modes of the first: of sampled opacity as well as of each material's own.
TEST(JobAlpha, LevelsHaveTheModesOfTheFirst) {
  KILN_REQUIRE_DEVICE();
  for (const AlphaCase& one : {kCases[0], kCases[4]}) {
    SCOPED_TRACE(one.what);
    Job job = job_of(one);
    Mesh high = BumpySphere::dense(6000);
    high.material_names = {"stone", "glass"};
    for (const Triangle& t : high.triangles) {
      high.materials.push_back(high.positions[t[0]].y > 0 ? 1 : 0);
    }
    Asset asset = high_of(one.glass);
    asset.mesh = high;
    job.high = {JobInput(asset, "high")};
    job.sets = SetsBy::none;
    job.bake.width = job.bake.height = 64;
    job.low = MakeLow{.max_error = "normal=4",
                      .screen = "192px",
                      .lods = 3,
                      .lod_growth = 1.5,
                      .lods_share_uvs = true,
                      .lods_in_one_file = true};
    RunHooks hooks = hooks_of(one, 64);
    hooks.needs_uvs = true;
    if (one.is_sampled) {
      hooks.sample = [](const Match& match, const Mesh&) {
        const std::uint32_t width = match.width / match.samples,
                            height = match.height / match.samples;
        return std::map<std::string, Image>{
            {"opacity",
             Image{width, height, 1, std::vector<float>(std::size_t{width} * height, 0.75F)}}};
      };
    }
    const json head = head_of(run_in_memory(job, hooks).glb);
    ASSERT_GE(head["meshes"].size(), 2U);
    expect_modes(one, head);
    // Levels that share pictures share materials, of which there are two.
    EXPECT_EQ(head["materials"].size(), 2U);
  }
}

}  // namespace
}  // namespace kiln::test
