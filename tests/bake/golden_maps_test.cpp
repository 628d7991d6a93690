// Golden hashes of every map: see golden_test.cpp.
#include <gtest/gtest.h>

#include "bake/golden_scene.h"
#include "bake/golden_table.h"
#include "kiln/bake.h"
#include "support/environment.h"

namespace kiln {
namespace {

using test::golden_high;
using test::golden_low;
using test::GoldenGroup;
using test::sized;
using Row = test::GoldenRow;

/// The golden high poly with colours, materials and groups.
Mesh dressed_high() {
  Mesh mesh = golden_high();
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto share = static_cast<std::uint8_t>(i % 64 * 4);
    mesh.colors.push_back({share, static_cast<std::uint8_t>(255 - share), 40,
                           static_cast<std::uint8_t>(128 + share / 2)});
  }
  mesh.material_names = {"stone", "moss"};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    mesh.materials.push_back(static_cast<std::uint32_t>(t / 50 % 2));
  }
  return mesh;
}

const Row kMaps[] = {
    {"id-material",
     [](BakeOptions& o) {
       o.maps = {MapKind{"id"}};
       o.id_by = IdBy::material;
     }},
    {"ao-samples-2", [](BakeOptions& o) { o.samples = 2; }},
    {"ao-error", [](BakeOptions& o) { o.occlusion.max_error = 0.01; }},
    {"ao-error-keep",
     [](BakeOptions& o) {
       o.occlusion.max_error = 0.02;
       o.encoding.miss = MissPolicy::keep;
       o.samples = 2;
     }},
    {"all",
     [](BakeOptions& o) {
       o.maps = {MapKind::normal,        MapKind::mask,        MapKind{"ao"},
                 MapKind{"bent_normal"}, MapKind{"curvature"}, MapKind{"id"}};
       o.encoding.mips = true;
     }},
};

/// Light by depth views.
const Row kByViews[] = {
    {"ao", [](BakeOptions&) {}},
    {"bent_normal", [](BakeOptions& o) { o.maps = {MapKind{"bent_normal"}}; }},
    {"both",
     [](BakeOptions& o) {
       o.maps = {MapKind{"ao"}, MapKind{"bent_normal"}};
     }},
    {"ao-views-16", [](BakeOptions& o) { o.occlusion.views = 16; }},
    {"ao-samples-2", [](BakeOptions& o) { o.samples = 2; }},
    {"ao-mark", [](BakeOptions& o) { o.encoding.miss = MissPolicy::mark; }},
    {"ao-by-low",
     [](BakeOptions& o) {
       o.occlusion.by_high = false;
       o.occlusion.by_low = true;
     }},
    {"bent-object",
     [](BakeOptions& o) {
       o.maps = {MapKind{"bent_normal"}};
       o.encoding.space = NormalMapSpace::object;
     }},
};

TEST(Golden, LightByViews) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("byviews");
  BakeOptions options = sized(96, 64);
  options.maps = {MapKind{"ao"}};
  options.occlusion.by = OcclusionBy::views;
  options.occlusion.views = 96;
  group.check(Source(*test::device(), dressed_high()), golden_low(), options, kByViews);
  KILN_FINISH_GROUP(group);
}

TEST(Golden, Maps) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("maps");
  BakeOptions options = sized(96, 64);
  options.maps = {MapKind{"ao"}};
  options.occlusion.rays = 32;
  const Source source(*test::device(), dressed_high());
  group.check(source, golden_low(), options, kMaps);
  // Each map of the registry by itself.
  options.light = {{0.3F, 1, 0.2F}, 5};
  for (const MapInfo& info : maps()) {
    options.maps = {info.kind};
    options.match.method = obeys(info, "match.visibility") ? "visibility" : MatchMethod::ray;
    group.check(std::string(info.kind.name), bake(source, golden_low(), options));
  }
  KILN_FINISH_GROUP(group);
}

}  // namespace
}  // namespace kiln
