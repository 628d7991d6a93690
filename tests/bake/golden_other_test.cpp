// Golden hashes of plans, low polys, terrains, volumes and pictures: see golden_test.cpp.
#include <gtest/gtest.h>

#include <string>

#include "bake/golden_scene.h"
#include "bake/golden_table.h"
#include "kiln/assess.h"
#include "kiln/contour.h"
#include "kiln/height_field.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"
#include "support/environment.h"

namespace kiln {
namespace {

using test::by_uv;
using test::golden_high;
using test::golden_low;
using test::GoldenGroup;
using test::moved_far;
using test::sized;
using test::with_bent_normals;
using test::with_flaws;

TEST(Golden, Plans) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("plan");
  const Mesh low = golden_low();
  Mesh bare = golden_high();
  bare.uvs.clear();
  bare.uv_triangles.clear();
  const Source with_layout(*test::device(), golden_high());
  const Source source(*test::device(), bare);
  const auto check = [&](const std::string& name, const Source& from, double max_error,
                         const BakeOptions& options) {
    PlanOptions plan;
    plan.max_error = max_error;
    plan.bake = options;
    const PlannedBake planned = bake_planned(from, low, plan);
    group.check(name, planned.result);
  };
  BakeOptions options = sized(256, 256);
  options.match.max_distance = Length::share(0.1);
  check("best", source, 0, options);
  check("error-8", source, 8, options);
  check("out-of-reach", source, 0.01, options);
  options.maps = {MapKind::normal, MapKind::mask};
  options.encoding.mips = true;
  options.report.keep_match = true;
  check("all-outputs", source, 6, options);
  options = sized(128, 256);
  options.match.uv.max_distance = test::kNoBound;
  check("uv", with_layout, 0, options);
  check("uv-error-8", with_layout, 8, options);
  options.match.cage = Length::share(0.05);
  check("cage", source, 0, options);
  KILN_FINISH_GROUP(group);
}

TEST(Golden, LightMeshes) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("lowmesh");
  const UnwrapMethod pairs = UnwrapMethod::pairs;
  const Mesh high = golden_high();
  const Source source(*test::device(), high);
  const auto check = [&](const std::string& name, const SimplifyOptions& options,
                         const UnwrapOptions& layout) {
    const Mesh simplified = simplify(high, options);
    group.check(name + "-simplify", simplified);
    const Mesh low = unwrap(simplified, layout);
    group.check(name + "-unwrap", low);
    BakeOptions bake_options = sized(layout.size, layout.size);
    bake_options.encoding.gutter = static_cast<std::int32_t>(layout.border_texels);
    bake_options.encoding.mips = true;
    group.check(name + "-bake", bake(source, low, bake_options));
  };
  check("faces-600", {.faces = 600}, {.method = pairs, .size = 256});
  check("faces-2500", {.faces = 2500}, {.method = pairs, .size = 256, .border_texels = 1});
  check("error", {.max_error = 0.01}, {.method = pairs, .size = 200, .border_texels = 4});
  group.check("flaws-simplify", simplify(with_flaws(golden_high()), {.faces = 1000}));
  group.check("far-simplify", simplify(moved_far(golden_high()), {.faces = 1000}));
  group.check("low-unwrap", unwrap(golden_low(), {.method = pairs, .size = 64}));
  KILN_FINISH_GROUP(group);
}

TEST(Golden, HeightFields) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("height");
  const Image image = test::golden_terrain(90, 70);
  const HeightFieldOptions field{9, 0, 1.5};
  const Mesh dense = height_field_mesh(image, field);
  const Mesh plane = height_field_plane(image, field);
  Mesh terrain = simplify(dense, {.faces = 300, .height_field = true});
  lay_out_over_height_field(terrain, image, field);
  group.check("dense", dense);
  group.check("plane", plane);
  group.check("terrain", terrain);
  const Source source(*test::device(), dense);
  BakeOptions options = sized(128, 96);
  options.report.keep_match = true;
  by_uv(options);
  group.check("plane-uv", bake(source, plane, options));
  group.check("terrain-uv", bake(source, terrain, options));
  options.encoding.mips = true;
  options.samples = 2;
  options.encoding.space = NormalMapSpace::object;
  group.check("terrain-uv-mips", bake(source, terrain, options));
  options = sized(128, 96);
  group.check("terrain-ray", bake(source, terrain, options));
  options.match.method = MatchMethod::views;  // one view, since both are height fields
  group.check("terrain-views", bake(source, terrain, options));
  options.match.max_distance = Length::absolute(2);
  group.check("plane-views", bake(source, plane, options));
  KILN_FINISH_GROUP(group);
}

TEST(Golden, Volumes) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("volume");
  const Device& device = *test::device();
  const Volume floats = test::golden_volume();
  const Volume bytes = test::golden_volume_of_bytes();
  const auto contoured = [&](const std::string& name, const Volume& volume,
                             const ContourOptions& options) {
    group.check(name + "-contour", contour(device, volume, options));
  };
  contoured("closed", floats, {});
  contoured("open", floats, {.border = VolumeBorder::open});
  contoured("below", floats, {.iso = 0.25, .inside = Inside::below});
  contoured("outer", floats, {.outer_only = true});
  contoured("outer-gap-2", floats, {.outer_only = true, .outer_gap = 2});
  contoured("bytes", bytes, {.iso = 128});
  contoured("bytes-half", bytes, {.iso = 127.5});

  const auto extracted = [&](const std::string& name, const Volume& volume,
                             const ExtractOptions& options) {
    const ExtractResult result = extract(device, volume, options);
    group.check(name + "-mesh", result.mesh);
    group.check(name + "-map", result.normal_map);
    return result.mesh;
  };
  const Mesh low = extracted("faces-800", floats, {.faces = 800, .size = 256});
  extracted("error", floats, {.error = 0.2, .size = 256, .space = NormalMapSpace::object});
  extracted("free", floats,
            {.contour = {.outer_only = true},
             .faces = 300,
             .keep_topology = false,
             .min_part = 0.1,
             .size = 128,
             .border_texels = 1,
             .flip_y = true});
  extracted("bytes", bytes, {.contour = {.iso = 128}, .error = 0.3, .size = 512, .raw = true});

  const Source full(device, contour(device, floats));
  BakeOptions options = sized(256, 256);
  options.encoding.gutter = 2;
  group.check("full-ray", bake(full, low, options));
  options.match.method = MatchMethod::closest;
  options.encoding.space = NormalMapSpace::object;
  group.check("full-closest", bake(full, low, options));
  KILN_FINISH_GROUP(group);
}

TEST(Golden, Assessments) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("assess");
  const Mesh low = golden_low();
  const Source source(*test::device(), golden_high());
  for (const MatchMethod method : {MatchMethod::ray, MatchMethod::closest}) {
    BakeOptions options = sized(96, 80);
    options.match.method = method;
    options.report.keep_match = true;
    const Match match = *bake(source, low, options).match;
    AssessOptions assess_options;
    assess_options.directions = 100;
    assess_options.avoid = {{0, 1, 0}};
    assess_options.fields = true;
    const AssessmentFields fields = assess(source, low, match, assess_options).fields;
    const std::string name = method == MatchMethod::ray ? "ray" : "closest";
    group.check(name + "-match-distance", fields.match_distance);
    group.check(name + "-image-space", fields.image_space);
    group.check(name + "-stretch", fields.stretch);
    group.check(name + "-object-space", fields.object_space);
    group.check(name + "-normalised-image-space", fields.normalised_image_space);
    group.check(name + "-uniformity", fields.uniformity);
  }
  KILN_FINISH_GROUP(group);
}

TEST(Golden, Pictures) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("render");
  const Device& device = *test::device();
  const Mesh high = golden_high();
  const Mesh low = golden_low();
  const auto drawn = [&](const std::string& name, const Scene& scene, RenderOptions options) {
    options.size = 160;
    group.check(name, scene.draw(options));
  };
  const Scene dense(device, with_bent_normals(high));
  drawn("high", dense, {});
  drawn("high-above", dense, {.azimuth_degrees = -75, .elevation_degrees = 60, .samples = 1});
  drawn("high-z-up", dense, {.z_up = true, .samples = 2, .ambient_rays = 0});
  drawn("high-flat", dense, {.samples = 2, .ambient_rays = 20, .flat = true});
  drawn("high-normals", dense, {.azimuth_degrees = 200, .samples = 1, .show_normals = true});
  for (const NormalMapSpace space :
       {NormalMapSpace::tangent, NormalMapSpace::object, NormalMapSpace::face}) {
    BakeOptions options = sized(128, 128);
    options.encoding.space = space;
    options.encoding.flip_y = space == NormalMapSpace::tangent;
    const Image map = bake(Source(device, high), low, options).maps[0].image;
    const Scene scene(device, low, {&map, space, options.encoding.flip_y});
    const std::string name = "low-" + std::to_string(static_cast<int>(space));
    drawn(name, scene, {.ambient_rays = 16, .frame = &high});
    drawn(name + "-normals", scene, {.samples = 1, .show_normals = true});
    drawn(name + "-colors", scene, {.samples = 2, .show_colors = true});
  }
  drawn("low-without-map", Scene(device, low), {.azimuth_degrees = 120});
  KILN_FINISH_GROUP(group);
}

}  // namespace
}  // namespace kiln
