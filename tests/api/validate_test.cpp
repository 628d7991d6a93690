// validate(): every field of a mesh, of options and of a match, corrupted, is an Error with its id, wherever
// it enters the library, and never a crash.
#include "kiln/validate.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "kiln/attribute.h"
#include "kiln/render.h"
#include "kiln/session.h"
#include "kiln/simplify.h"
#include "kiln/unwrap.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The id of the error that `work` throws; empty: none.
std::string id_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_STRNE(error.what(), "");
    return error.id();
  }
  return {};
}

/// One with all attributes.
Mesh whole_mesh() {
  Mesh mesh = test::cube();
  const std::size_t count = mesh.triangles.size();
  mesh.colors.assign(mesh.positions.size(), {1, 2, 3, 4});
  mesh.groups.assign(count, 0);
  mesh.groups.back() = 1;
  mesh.group_names = {"body", "lid"};
  mesh.objects = mesh.materials = mesh.groups;
  mesh.object_names = mesh.material_names = mesh.group_names;
  for (std::uint32_t t = 0; t < count; ++t) mesh.polygons.push_back(t / 2);
  mesh.tangents.assign(3 * count, {{1, 0, 0}, 1});
  return mesh;
}

struct Corruption {
  std::string id;
  std::function<void(Mesh&)> apply;
};

/// Any one index of a list, to anything beyond its pool.
Corruption bad_index(std::vector<Triangle> Mesh::*list, std::size_t pool) {
  return {"mesh-index", [list, pool](Mesh& mesh) {
            const auto t = *rc::gen::inRange<std::size_t>(0, (mesh.*list).size());
            const auto k = *rc::gen::inRange<std::size_t>(0, 3);
            const auto least = static_cast<std::uint32_t>(pool);
            (mesh.*list)[t][k] = *rc::gen::element(least, least + 1, 0x7FFFFFFFU, 0xFFFFFFFFU);
          }};
}

/// A list of another length, but not of none.
template <typename T>
Corruption bad_size(std::vector<T> Mesh::*list) {
  return {"mesh-size", [list](Mesh& mesh) {
            const std::size_t right = (mesh.*list).size();
            std::size_t size = *rc::gen::inRange<std::size_t>(1, 2 * right);
            if (size == right) ++size;
            (mesh.*list).resize(size, (mesh.*list)[0]);
          }};
}

std::vector<Corruption> corruptions(const Mesh& mesh) {
  return {bad_index(&Mesh::triangles, mesh.positions.size()),
          bad_index(&Mesh::uv_triangles, mesh.uvs.size()),
          bad_index(&Mesh::normal_triangles, mesh.normals.size()),
          bad_size(&Mesh::uv_triangles),
          bad_size(&Mesh::normal_triangles),
          bad_size(&Mesh::colors),
          bad_size(&Mesh::groups),
          bad_size(&Mesh::objects),
          bad_size(&Mesh::materials),
          bad_size(&Mesh::polygons),
          bad_size(&Mesh::tangents),
          {"mesh-index", [](Mesh& m) { m.positions.resize(m.positions.size() - 1); }},
          {"mesh-index", [](Mesh& m) { m.uvs.clear(); }},
          {"mesh-index", [](Mesh& m) { m.normals.clear(); }},
          {"mesh-group", [](Mesh& m) { m.group_names.pop_back(); }},
          {"mesh-group", [](Mesh& m) { m.object_names.pop_back(); }},
          {"mesh-group", [](Mesh& m) { m.material_names.pop_back(); }},
          {"mesh-polygon", [](Mesh& m) { m.polygons.back() += 2 + *rc::gen::inRange(0U, 9U); }},
          {"mesh-polygon", [](Mesh& m) { m.polygons[0] = 1; }},
          {"mesh-polygon", [](Mesh& m) { m.polygons.back() = 0; }},
          {"mesh-origin", [](Mesh& m) {
             m.origin[*rc::gen::inRange<std::size_t>(0, 3)] =
                 *rc::gen::element(std::nan(""), kInfinity, -kInfinity);
           }}};
}

TEST(Validate, AMeshThatHoldsTogetherPasses) {
  validate(whole_mesh());
  validate(test::icosphere(2));
  validate(Mesh{});
  Mesh imperfect = test::cube();
  imperfect.positions[3] = {kNan, 0, 0};  // handled by rule, and counted
  imperfect.triangles[0] = {1, 1, 2};
  imperfect.uvs[0].x = kNan;
  validate(imperfect);
}

TEST(Validate, EveryFieldOfAMeshIsChecked) {
  const bool passed = rc::check([] {
    const Mesh whole = whole_mesh();
    for (const Corruption& one : corruptions(whole)) {
      Mesh mesh = whole;
      one.apply(mesh);
      RC_ASSERT(id_of([&] { validate(mesh); }) == one.id);
    }
  });
  EXPECT_TRUE(passed);
}

TEST(Validate, NoCorruptMeshEntersTheLibrary) {
  KILN_REQUIRE_DEVICE();
  const Device& device = *test::device();
  const Mesh good = whole_mesh();
  const Source source(device, good);
  const BakeOptions small{.width = 8, .height = 8};
  const bool passed = rc::check([&] {
    Mesh mesh = good;
    const std::vector<Corruption> all = corruptions(mesh);
    const Corruption& one = all[*rc::gen::inRange<std::size_t>(0, all.size())];
    one.apply(mesh);
    BakeOptions caged = small;
    caged.match.cage_mesh = &mesh;
    const SessionOptions boxed{.bounds = Bounds{{-1, -1, -1}, {1, 1, 1}}};
    const std::vector<std::function<void()>> ways = {
        [&] { Source(device, mesh); },
        [&] { Source(device, mesh, RayTraversal::automatic, boxed.bounds); },
        [&] { Source::build(device, mesh, {}); },
        [&] { bake(source, mesh, small); },
        [&] { bake(source, good, caged); },
        [&] { match(source, mesh, small); },
        [&] { BakeSession(device, mesh, good, small, boxed); },
        [&] { BakeSession(device, good, mesh, small); },
        [&] { ViewSession(source, mesh, small); },
        [&] { Scene(device, mesh); },
        [&] { simplify(mesh, {.faces = 4}); },
        [&] { unwrap(mesh); },
        [&] { Bounds::of(mesh); },
    };
    const auto& way = ways[*rc::gen::inRange<std::size_t>(0, ways.size())];
    RC_ASSERT(id_of(way) == one.id);
  });
  EXPECT_TRUE(passed);
}

TEST(Validate, EveryOptionIsChecked) {
  struct Case {
    std::string id;
    std::function<void(BakeOptions&)> apply;
  };
  Mesh cage = test::cube();
  const auto wild = [](auto last) {  // beyond the last name
    return static_cast<decltype(last)>(static_cast<int>(last) + *rc::gen::element(1, 2, 90, -100));
  };
  const auto out_of_range = [](double least_bad) {
    return Length::absolute(*rc::gen::element(least_bad, -1.0, std::nan(""), kInfinity));
  };
  const std::vector<Case> cases = {
      {"option-range",
       [](BakeOptions& o) { o.width = *rc::gen::element(0U, 16385U, 0xFFFFFFFFU); }},
      {"option-range", [](BakeOptions& o) { o.height = *rc::gen::element(0U, 16385U); }},
      {"option-range", [](BakeOptions& o) { o.samples = *rc::gen::element(0U, 17U); }},
      {"option-range", [](BakeOptions& o) { o.maps.clear(); }},
      {"option-range", [](BakeOptions& o) { o.encoding.gutter = *rc::gen::element(-2, 4097); }},
      {"option-range", [&](BakeOptions& o) { o.match.max_distance = out_of_range(0); }},
      {"option-range", [&](BakeOptions& o) { o.match.cage = out_of_range(-1e-9); }},
      {"option-range", [&](BakeOptions& o) { o.match.ray.edge_width = out_of_range(0); }},
      {"option-range", [&](BakeOptions& o) { o.curvature_radius = out_of_range(0); }},
      {"option-range", [&](BakeOptions& o) { o.occlusion.distance = out_of_range(0); }},
      {"option-range", [](BakeOptions& o) { o.occlusion.rays = *rc::gen::element(0U, 4097U); }},
      {"option-range", [](BakeOptions& o) { o.occlusion.by_high = false; }},
      {"option-range", [](BakeOptions& o) { o.occlusion.by_others = {nullptr}; }},
      {"option-range", [](BakeOptions& o) { o.match.fallback_blend = 257; }},
      {"option-range", [](BakeOptions& o) { o.match.views.count = 513; }},
      {"option-range", [](BakeOptions& o) { o.match.views.count = 0; }},
      {"option-range", [](BakeOptions& o) { o.match.views.size = 8193; }},
      {"option-range",
       [](BakeOptions& o) {
         o.match.method = MatchMethod::hybrid;
         o.match.visibility.directions = *rc::gen::element(0U, 4097U);
       }},
      {"option-range",
       [](BakeOptions& o) { o.match.uv.max_overlap = *rc::gen::element(-1.0, std::nan("")); }},
      {"option-enum", [&](BakeOptions& o) { o.encoding.space = wild(NormalMapSpace::face); }},
      {"option-enum", [&](BakeOptions& o) { o.encoding.miss = wild(MissPolicy::mark); }},
      {"option-enum", [&](BakeOptions& o) { o.match.ray.rule = wild(RayRule::nearest); }},
      {"option-enum", [&](BakeOptions& o) { o.match.ray.direction = wild(RayDirection::painted); }},
      {"option-enum",
       [&](BakeOptions& o) { o.match.views.criterion = wild(ViewCriterion::angle); }},
      {"option-enum", [&](BakeOptions& o) { o.match.visibility.at = wild(VisibilityAt::texel); }},
      {"option-enum",
       [&](BakeOptions& o) { o.match.visibility.test = wild(VisibilityTest::rays); }},
      {"option-enum",
       [&](BakeOptions& o) { o.match.visibility.likelihood = wild(ViewLikelihood::list); }},
      {"option-name", [](BakeOptions& o) { o.match.method = MatchMethod{"rays"}; }},
      {"option-name", [](BakeOptions& o) { o.match.method = MatchMethod{}; }},
      {"option-name", [](BakeOptions& o) { o.match.fallback = {MatchMethod{"nothing"}}; }},
      {"option-name", [](BakeOptions& o) { o.maps.push_back(MapKind{"Normal"}); }},
      {"option-contradiction",
       [](BakeOptions& o) {
         o.encoding.space = NormalMapSpace::object;
         o.encoding.two_component = true;
       }},
      {"option-contradiction",
       [&](BakeOptions& o) {
         o.match.cage = Length::share(0.1);
         o.match.cage_mesh = &cage;
       }},
      {"option-contradiction",
       [](BakeOptions& o) {
         o.match.cage = Length::share(0.1);
         o.match.method =
             *rc::gen::element(MatchMethod::views, MatchMethod::closest, MatchMethod::uv);
       }},
      {"option-contradiction", [](BakeOptions& o) { o.match.fallback_blend = 4; }},
      {"option-contradiction", [](BakeOptions& o) { o.match.fallback = {MatchMethod::ray}; }},
      {"option-contradiction", [](BakeOptions& o) { o.match.fallback = {MatchMethod::uv}; }},
      {"option-contradiction", [](BakeOptions& o) { o.maps = {MapKind{"visibility"}}; }},
      {"option-contradiction", [](BakeOptions& o) { o.match.visibility.clusters = 2; }},
  };
  validate(BakeOptions{});
  const bool passed = rc::check([&] {
    for (const Case& one : cases) {
      BakeOptions options{.width = 8, .height = 8};
      one.apply(options);
      const std::string id = id_of([&] { validate(options); });
      if (id != one.id) {
        RC_FAIL("case " + std::to_string(&one - cases.data()) + ": '" + id + "' instead of " +
                one.id);
      }
    }
  });
  EXPECT_TRUE(passed);
}

/// Each end of a documented range is legal, and the next value beyond it is not.
TEST(Validate, RangesIncludeTheirEnds) {
  using Options = BakeOptions;
  struct Range {
    const char* name;
    std::function<void(Options&, double)> set;
    std::vector<double> legal, illegal;
  };
  constexpr double kTiny = 1e-9;
  const auto unsigned_of = [](double value) { return static_cast<std::uint32_t>(value); };
  const std::vector<Range> ranges = {
      {"width", [&](Options& o, double v) { o.width = unsigned_of(v); }, {1, 16384}, {0, 16385}},
      {"height", [&](Options& o, double v) { o.height = unsigned_of(v); }, {1, 16384}, {0, 16385}},
      {"samples", [&](Options& o, double v) { o.samples = unsigned_of(v); }, {1, 16}, {0, 17}},
      {"gutter",
       [](Options& o, double v) { o.encoding.gutter = static_cast<std::int32_t>(v); },
       {-1, 0, 4096},
       {-2, 4097}},
      {"recall",
       [&](Options& o, double v) { o.report.recall = unsigned_of(v); },
       {0, 1 << 20},
       {(1 << 20) + 1}},
      {"own_map_seconds",
       [](Options& o, double v) { o.own_map_seconds = v; },
       {1, 86400},
       {1 - kTiny, 86400.001, kNan}},
      {"rays",
       [&](Options& o, double v) { o.occlusion.rays = unsigned_of(v); },
       {1, 4096},
       {0, 4097}},
      {"views of occlusion",
       [&](Options& o, double v) { o.occlusion.views = unsigned_of(v); },
       {16, 4096},
       {15, 4097}},
      {"error of occlusion",
       [](Options& o, double v) { o.occlusion.max_error = v; },
       {0, 1},
       {-kTiny, 1 + kTiny, kNan}},
      {"angle of light",
       [](Options& o, double v) { o.light.angle_degrees = v; },
       {0, 90},
       {-kTiny, 90 + kTiny, kNan}},
      {"blend",
       [&](Options& o, double v) {
         o.match.fallback = {MatchMethod::closest};
         o.match.fallback_blend = unsigned_of(v);
       },
       {0, 256},
       {257}},
      {"views",
       [&](Options& o, double v) { o.match.views.count = unsigned_of(v); },
       {1, 512},
       {0, 513}},
      {"size of views",
       [&](Options& o, double v) { o.match.views.size = unsigned_of(v); },
       {1, 8192},
       {8193}},
      {"max_distance",
       [](Options& o, double v) { o.match.max_distance = Length::absolute(v); },
       {kTiny, 1e30},
       {0, -kTiny, kInfinity, kNan}},
      {"near_distance",
       [](Options& o, double v) { o.match.near_distance = Length::absolute(v); },
       {kTiny, 1e30},
       {0, -kTiny, kInfinity, kNan}},
      {"cage",
       [](Options& o, double v) { o.match.cage = Length::absolute(v); },
       {0, 1e30},
       {-kTiny, kInfinity, kNan}},
      {"edge_width",
       [](Options& o, double v) { o.match.ray.edge_width = Length::absolute(v); },
       {kTiny, 1e30},
       {0, -kTiny, kInfinity, kNan}},
      {"curvature_radius",
       [](Options& o, double v) { o.curvature_radius = Length::absolute(v); },
       {kTiny, 1e30},
       {0, -kTiny, kInfinity, kNan}},
      {"distance of occlusion",
       [](Options& o, double v) { o.occlusion.distance = Length::absolute(v); },
       {kTiny, 1e30},
       {0, -kTiny, kInfinity, kNan}},
      {"x of light",
       [](Options& o, double v) {
         o.light.direction = {static_cast<float>(v), 0, 0};
       },
       {-1, 1e-3},
       {0, kInfinity, kNan}},
      {"origin",
       [](Options& o, double v) {
         o.encoding.origin = {{0, v, 0}};
       },
       {-1e30, 0},
       {kInfinity, kNan}},
      {"range of a map",
       [](Options& o, double v) {
         o.maps = {MapKind{"curvature"}};
         o.encoding.ranges = {{MapKind{"curvature"}, {0, static_cast<float>(v)}}};
       },
       {1e-6},
       {0, -1, kInfinity, kNan}}};
  for (const Range& range : ranges) {
    for (const bool legal : {true, false}) {
      for (const double value : legal ? range.legal : range.illegal) {
        Options options{.width = 8, .height = 8};
        range.set(options, value);
        EXPECT_EQ(id_of([&] { validate(options); }), legal ? "" : "option-range")
            << range.name << " " << value;
      }
    }
  }
}

/// Depth views hold the nearest front faces: whatever else occlusion may be asked for contradicts them.
TEST(Validate, OcclusionByViewsTakesNothingElse) {
  const auto id = [](const std::function<void(OcclusionOptions&)>& change) {
    BakeOptions options{.width = 8, .height = 8};
    options.occlusion.by = OcclusionBy::views;
    change(options.occlusion);
    return id_of([&] { validate(options); });
  };
  EXPECT_EQ(id([](OcclusionOptions&) {}), "");
  const std::function<void(OcclusionOptions&)> changes[] = {
      [](OcclusionOptions& o) { o.distance = Length::share(0.5); },
      [](OcclusionOptions& o) { o.falloff = OcclusionFalloff::linear; },
      [](OcclusionOptions& o) { o.back_faces = false; },
      [](OcclusionOptions& o) { o.max_error = 0.1; }};
  for (const auto& change : changes) {
    EXPECT_EQ(id(change), "option-contradiction");
    EXPECT_EQ(id([&](OcclusionOptions& o) {
                change(o);
                o.by = OcclusionBy::rays;
              }),
              "");
  }
}

/// A cube's correspondence with itself.
struct Matched {
  Mesh mesh = test::cube();
  Source source{*test::device(), mesh};
  BakeOptions options{.width = 16, .height = 16, .samples = 2};
  Match match = kiln::match(source, mesh, options).match;
};

TEST(Validate, EveryFieldOfAMatchIsCheckedWhereverItEnters) {
  KILN_REQUIRE_DEVICE();
  struct Case {
    std::string id;
    std::function<void(Match&, std::size_t)> apply;  // the second: a sample that was found
  };
  const auto cut = [](auto list) {
    return [list](Match& m, std::size_t) {
      const std::size_t right = (m.*list).size();
      (m.*list).resize(*rc::gen::element<std::size_t>(0, 1, right - 1, right + 1));
    };
  };
  const auto bad_weight = [] {
    return *rc::gen::element(kNan, -0.01F, 1.01F, static_cast<float>(kInfinity));
  };
  const std::vector<Case> cases = {
      {"match-size", cut(&Match::triangle)},
      {"match-size", cut(&Match::u)},
      {"match-size", cut(&Match::v)},
      {"match-size", cut(&Match::distance)},
      {"match-size", cut(&Match::status)},
      {"match-size", [](Match& m, std::size_t) { m.samples = *rc::gen::element(0U, 3U, 17U); }},
      {"match-size", [](Match& m, std::size_t) { m.width = *rc::gen::element(0U, 31U, ~0U); }},
      {"match-size", [](Match& m, std::size_t) { m.height = *rc::gen::element(0U, 64U, ~0U); }},
      {"match-status",
       [](Match& m, std::size_t) {
         const auto i = *rc::gen::inRange<std::size_t>(0, m.status.size());
         m.status[i] = *rc::gen::element<std::uint8_t>(9, 99, 255);
       }},
      {"match-triangle",
       [](Match& m, std::size_t i) { m.triangle[i] = *rc::gen::element(12U, 0xFFFFFFFFU); }},
      {"match-weight", [&](Match& m, std::size_t i) { m.u[i] = bad_weight(); }},
      {"match-weight", [&](Match& m, std::size_t i) { m.v[i] = bad_weight(); }},
      {"match-weight", [](Match& m, std::size_t i) { m.u[i] = m.v[i] = 0.6F; }},
      {"match-distance",
       [](Match& m, std::size_t i) {
         m.distance[i] = *rc::gen::element(kNan, static_cast<float>(kInfinity));
       }},
  };
  const Matched scene;
  validate(scene.match);
  const std::vector<float> values(scene.mesh.positions.size());
  const bool passed = rc::check([&] {
    Match match = scene.match;
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < match.status.size(); ++i) {
      if (match.status_of(i) == SampleStatus::outward) found.push_back(i);
    }
    const Case& one = cases[*rc::gen::inRange<std::size_t>(0, cases.size())];
    one.apply(match, found[*rc::gen::inRange<std::size_t>(0, found.size())]);
    const std::vector<std::function<void()>> ways = {
        [&] { validate(match); }, [&] { bake(match, scene.source, scene.mesh, scene.options); },
        [&] { bake_attribute(match, scene.source, values, 1); },
        [&] { save_match(match, "/nonexistent/match.exr"); }};
    const auto& way = ways[*rc::gen::inRange<std::size_t>(0, ways.size())];
    RC_ASSERT(id_of(way) == one.id);
  });
  EXPECT_TRUE(passed);
}

TEST(Validate, AMatchOfOtherMeshesIsNamedByItsId) {
  KILN_REQUIRE_DEVICE();
  const Matched scene;
  Mesh moved = scene.mesh;
  moved.positions[0].x += 0.001F;
  const Source other(*test::device(), moved);
  const Source larger(*test::device(), test::icosphere(2));
  const auto baked = [&](const Source& source, const Mesh& low, BakeOptions options) {
    return id_of([&] { bake(scene.match, source, low, options); });
  };
  EXPECT_EQ(baked(scene.source, scene.mesh, scene.options), "");
  EXPECT_EQ(baked(other, scene.mesh, scene.options), "match-source");
  EXPECT_EQ(baked(larger, scene.mesh, scene.options), "match-source");
  EXPECT_EQ(baked(scene.source, moved, scene.options), "match-low");
  EXPECT_EQ(baked(scene.source, scene.mesh, {.width = 32, .height = 16}), "match-size");
  const std::vector<float> values(12);
  EXPECT_EQ(id_of([&] { bake_attribute(scene.match, other, std::span(values).first(8), 1); }),
            "match-source");
}

TEST(Validate, EveryErrorHasAnId) {
  EXPECT_STREQ(Error(ErrorCode::internal, "x").id(), "internal");
  EXPECT_STREQ(Error(ErrorCode::usage, "x").id(), "usage");
  EXPECT_STREQ(Error(ErrorCode::input, "x").id(), "input");
  EXPECT_STREQ(Error(ErrorCode::device, "x").id(), "device");
  EXPECT_STREQ(Error(ErrorCode::output, "x").id(), "output");
  EXPECT_STREQ(Error(ErrorCode::output, "x", "disk-full").id(), "disk-full");
}

}  // namespace
}  // namespace kiln
