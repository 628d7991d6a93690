// Golden hashes of what maps are made of, of meshes and of sessions: see golden_test.cpp.
#include <gtest/gtest.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "bake/golden_scene.h"
#include "bake/golden_table.h"
#include "kiln/session.h"
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
using test::with_face_normals;
using test::with_flaws;
using Row = test::GoldenRow;

// ---- what maps are made of points ---------------------------------------------------------------

const Row kImages[] = {
    {"plain", [](BakeOptions&) {}},
    {"object", [](BakeOptions& o) { o.encoding.space = NormalMapSpace::object; }},
    {"face", [](BakeOptions& o) { o.encoding.space = NormalMapSpace::face; }},
    {"flip-y", [](BakeOptions& o) { o.encoding.flip_y = true; }},
    {"face-flip-y",
     [](BakeOptions& o) {
       o.encoding.space = NormalMapSpace::face;
       o.encoding.flip_y = true;
     }},
    {"two-component", [](BakeOptions& o) { o.encoding.two_component = true; }},
    {"two-component-raw",
     [](BakeOptions& o) {
       o.encoding.two_component = true;
       o.encoding.flip_y = true;
       o.encoding.raw = true;
     }},
    {"raw", [](BakeOptions& o) { o.encoding.raw = true; }},
    {"object-raw",
     [](BakeOptions& o) {
       o.encoding.space = NormalMapSpace::object;
       o.encoding.raw = true;
     }},
    {"miss-fill", [](BakeOptions& o) { o.encoding.miss = MissPolicy::fill; }},
    {"miss-fill-no-gutter",
     [](BakeOptions& o) {
       o.encoding.miss = MissPolicy::fill;
       o.encoding.gutter = 0;
     }},
    {"miss-mark", [](BakeOptions& o) { o.encoding.miss = MissPolicy::mark; }},
    {"miss-mark-raw",
     [](BakeOptions& o) {
       o.encoding.miss = MissPolicy::mark;
       o.encoding.raw = true;
       o.samples = 2;
     }},
    {"gutter-0", [](BakeOptions& o) { o.encoding.gutter = 0; }},
    {"gutter-3", [](BakeOptions& o) { o.encoding.gutter = 3; }},
    {"gutter-infinite", [](BakeOptions& o) { o.encoding.gutter = -1; }},
    {"gutter-infinite-fill",
     [](BakeOptions& o) {
       o.encoding.gutter = -1;
       o.encoding.miss = MissPolicy::fill;
       o.encoding.space = NormalMapSpace::object;
     }},
    {"samples-2", [](BakeOptions& o) { o.samples = 2; }},
    {"samples-3-two-component",
     [](BakeOptions& o) {
       o.samples = 3;
       o.encoding.two_component = true;
     }},
    {"samples-4-fill",
     [](BakeOptions& o) {
       o.samples = 4;
       o.encoding.miss = MissPolicy::fill;
     }},
    {"mask", [](BakeOptions& o) { o.maps = {MapKind::mask}; }},
    {"normal-and-mask",
     [](BakeOptions& o) {
       o.maps = {MapKind::normal, MapKind::mask};
     }},
    {"mask-and-normal-fill",
     [](BakeOptions& o) {
       o.maps = {MapKind::mask, MapKind::normal};
       o.encoding.miss = MissPolicy::fill;
       o.encoding.gutter = -1;
     }},
    {"mips", [](BakeOptions& o) { o.encoding.mips = true; }},
    {"mips-samples-2",
     [](BakeOptions& o) {
       o.encoding.mips = true;
       o.samples = 2;
       o.maps = {MapKind::normal, MapKind::mask};
       o.encoding.gutter = 0;
     }},
    {"mips-object-infinite",
     [](BakeOptions& o) {
       o.encoding.mips = true;
       o.encoding.space = NormalMapSpace::object;
       o.encoding.gutter = -1;
       o.encoding.miss = MissPolicy::mark;
     }},
    {"mips-two-component-fill",
     [](BakeOptions& o) {
       o.encoding.mips = true;
       o.encoding.two_component = true;
       o.encoding.miss = MissPolicy::fill;
     }},
    {"mips-face-flip-y-raw",
     [](BakeOptions& o) {
       o.encoding.mips = true;
       o.encoding.space = NormalMapSpace::face;
       o.encoding.flip_y = true;
       o.encoding.raw = true;
     }},
    {"1x1", [](BakeOptions& o) { o.width = o.height = 1; }},
    {"64x64", [](BakeOptions& o) { o.width = o.height = 64; }},
    {"33x129-mips",
     [](BakeOptions& o) {
       o.width = 33;
       o.height = 129;
       o.encoding.mips = true;
     }},
    {"256x192-far",
     [](BakeOptions& o) {
       o.width = 256;
       o.height = 192;
       o.match.max_distance = Length::share(0.1);
     }},
    {"512x512-mips",
     [](BakeOptions& o) {
       o.width = o.height = 512;
       o.encoding.mips = true;
     }},
    {"512x512-views",
     [](BakeOptions& o) {
       o.width = o.height = 512;
       o.match.method = MatchMethod::views;
     }},
    {"512x300-closest-infinite",
     [](BakeOptions& o) {
       o.width = 512;
       o.height = 300;
       o.match.method = MatchMethod::closest;
       o.encoding.gutter = -1;
     }},
    {"1024x1024-samples-2",  // more than a band of rows
     [](BakeOptions& o) {
       o.width = o.height = 1024;
       o.samples = 2;
     }},
    {"1024x700-uv",
     [](BakeOptions& o) {
       by_uv(o);
       o.width = 1024;
       o.height = 700;
     }},
};

TEST(Golden, Images) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("image");
  const Mesh low = golden_low();
  const Source source(*test::device(), golden_high());
  group.check(source, low, sized(120, 96), kImages);

  // From a match that was saved, whatever found it.
  BakeOptions options = sized(120, 96);
  options.samples = 2;
  options.report.keep_match = true;
  options.match.method = MatchMethod::views;
  const Match found = *bake(source, low, options).match;
  const std::filesystem::path file = test::scratch_folder() / "match.exr";
  save_match(found, file);
  const Match loaded = load_match(file);
  options.match.method = MatchMethod::ray;
  options.match.saved = &loaded;
  options.encoding.space = NormalMapSpace::object;
  options.encoding.mips = true;
  group.check("saved-match", bake(source, low, options));
  KILN_FINISH_GROUP(group);
}

// ---- meshes as they come --------------------------------------------------------------------------

/// The layout with two charts on top of each other, and one that reaches out of the unit square.
Mesh with_shifted_charts(Mesh mesh) {
  for (Vec2& uv : mesh.uvs) {
    if (uv.x < 0.25F && uv.y < 0.5F) uv.x += 0.25F;
    if (uv.x > 0.75F && uv.y < 0.5F) uv.x += 0.125F;
  }
  return mesh;
}

Mesh without_uvs(Mesh mesh) {
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  return mesh;
}

TEST(Golden, Meshes) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("mesh");
  struct Pair {
    const char* name;
    Mesh high, low;
  };
  const Mesh high = golden_high();
  const Mesh low = golden_low();
  const Pair pairs[] = {
      {"high-normals", with_bent_normals(high), low},
      {"low-normals", high, with_bent_normals(low)},
      {"low-face-normals", high, with_face_normals(low)},
      {"both-normals", with_bent_normals(high), with_face_normals(low)},
      {"high-flaws", with_flaws(high), low},
      {"low-flaws", high, with_flaws(low)},
      {"far", moved_far(high), moved_far(low)},
      {"shifted-charts", high, with_shifted_charts(low)},
      {"high-without-uvs", without_uvs(high), low},
  };
  for (const Pair& pair : pairs) {
    const Source source(*test::device(), pair.high);
    BakeOptions options = sized(96, 80);
    const std::string name = pair.name;
    group.check(name, bake(source, pair.low, options));
    options.encoding.space = NormalMapSpace::face;
    options.match.fallback = {MatchMethod::views};
    group.check(name + "-face", bake(source, pair.low, options));
    options = sized(96, 80);
    options.match.method = MatchMethod::hybrid;
    options.match.visibility.directions = 64;
    options.encoding.space = NormalMapSpace::object;
    group.check(name + "-hybrid", bake(source, pair.low, options));
    if (pair.high.uvs.empty()) continue;
    options = sized(96, 80);
    by_uv(options);
    group.check(name + "-uv", bake(source, pair.low, options));
  }

  // Another box than the mesh's own decides rounding and shares of the diagonal.
  const Bounds box{{-2, -1.75, -1.5}, {1.5, 2, 2.25}};
  const Source boxed(*test::device(), high, RayTraversal::automatic, box);
  group.check("other-bounds", bake(boxed, low, sized(96, 80)));

  const std::filesystem::path file = test::scratch_folder() / "quads.obj";
  test::write_quads(file);
  const Mesh quads = load_mesh(file);
  group.check("quads", quads);
  Mesh bare = without_uvs(quads);
  bare.normals.clear();
  bare.normal_triangles.clear();
  group.check("quads-low", bake(Source(*test::device(), bare), quads, sized(96, 80)));
  KILN_FINISH_GROUP(group);
}

// ---- high polys that change ---------------------------------------------------------------------

TEST(Golden, Sessions) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("session");
  const Mesh low = golden_low();
  const Row rows[] = {
      {"uv", by_uv},
      {"uv-mips-infinite",
       [](BakeOptions& o) {
         by_uv(o);
         o.encoding.mips = true;
         o.encoding.gutter = -1;
         o.samples = 2;
         o.maps = {MapKind::normal, MapKind::mask};
       }},
      {"uv-fallback",
       [](BakeOptions& o) {
         by_uv(o);
         o.match.fallback = {MatchMethod::closest};
         o.match.max_distance = Length::share(0.05);
       }},
      {"ray", [](BakeOptions&) {}},
      {"ray-mips-infinite",
       [](BakeOptions& o) {
         o.encoding.mips = true;
         o.encoding.gutter = -1;
         o.encoding.miss = MissPolicy::fill;
       }},
      {"views-object",
       [](BakeOptions& o) {
         o.match.method = MatchMethod::views;
         o.encoding.space = NormalMapSpace::object;
       }},
      {"closest", [](BakeOptions& o) { o.match.method = MatchMethod::closest; }},
      {"visibility",
       [](BakeOptions& o) {
         o.match.method = MatchMethod::visibility;
         o.match.visibility.directions = 64;
       }},
  };
  constexpr std::uint32_t kFirst = 700, kCount = 900;
  for (const Row& row : rows) {
    BakeOptions options = sized(96, 80);
    options.report.keep_match = true;
    row.set(options);
    for (const bool with_normals : {false, true}) {
      const Mesh dense = with_normals ? with_bent_normals(golden_high()) : golden_high();
      const std::string name = std::string(row.name) + (with_normals ? "-normals" : "");
      BakeSession session(*test::device(), dense, low, options);
      group.check(name + "-first", session.bake());
      std::vector<Vec3> changed(dense.positions.begin() + kFirst,
                                dense.positions.begin() + kFirst + kCount);
      for (std::size_t i = 0; i < kCount; ++i) {
        const float by = 1 + 0.001F * static_cast<float>(i % 17);
        changed[i] = {changed[i].x * by, changed[i].y * by, changed[i].z * by};
      }
      session.set_positions(kFirst, changed);
      group.check(name + "-positions", session.bake());
      if (!with_normals) continue;
      changed.assign(dense.normals.begin() + kFirst, dense.normals.begin() + kFirst + kCount);
      for (std::size_t i = 0; i < kCount; ++i) {
        changed[i].y += 0.05F * static_cast<float>(i % 13) - 0.3F;
      }
      session.set_normals(kFirst, changed);
      group.check(name + "-set", session.bake());
    }
  }
  KILN_FINISH_GROUP(group);
}

TEST(Golden, ViewSessions) {
  KILN_REQUIRE_GOLDEN_DEVICE();
  GoldenGroup group("views");
  const Mesh low = golden_low();
  const Source source(*test::device(), golden_high());
  BakeOptions options = sized(120, 96);
  options.samples = 2;
  ViewSession session(source, low, options);
  const Vec3 views[] = {{0, 0, 1}, {1, 0.5F, -0.25F}, {-3, 1, 1}, {0.5F, 2, 0}, {0, 0.25F, -2}};
  for (std::size_t i = 0; i < std::size(views); ++i) {
    session.add(views[i]);
    const std::string name = std::to_string(i + 1);
    const Match match = session.match();
    group.check(name + ":match", match);
    options.match.saved = &match;
    group.check(name, bake(source, low, options));
  }
  KILN_FINISH_GROUP(group);
}

}  // namespace
}  // namespace kiln
