// Sessions: whatever changes, the maps are those of a fresh bake.
#include "kiln/session.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <random>
#include <utility>

#include "accel/bvh.h"
#include "kiln/progress.h"
#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {

extern std::chrono::milliseconds min_progress_interval;

namespace {

Mesh bumpy_plane(std::uint32_t n, bool with_normals) {
  Mesh mesh = test::plane(n, n);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  for (Vec3& p : mesh.positions) {
    p.z = static_cast<float>(0.01 * std::sin(9.0 * p.x) * std::cos(7.0 * p.y));
    if (with_normals) mesh.normals.push_back({p.z * 5, p.x / 4, 1});
  }
  if (with_normals) mesh.normal_triangles = mesh.triangles;
  return mesh;
}

BakeOptions small(MatchMethod method) {
  BakeOptions options;
  options.width = 70;
  options.height = 45;
  options.samples = 2;
  options.encoding.gutter = 5;
  options.match.method = method;
  options.match.visibility.directions = 32;
  options.match.visibility.view_size = 64;
  options.maps = {MapKind::normal, MapKind::mask};
  options.match.max_distance.reset();
  if (method != MatchMethod::uv) options.match.max_distance = Length::share(0.05);
  return options;
}

/// A light plane that leaves a border around its layout, so that there is a gutter.
Mesh inset_plane() {
  Mesh low = test::plane(2, 2);
  for (Vec2& uv : low.uvs) uv = {0.1F + 0.8F * uv.x, 0.1F + 0.8F * uv.y};
  return low;
}
Mesh inset(Mesh dense) {
  for (Vec2& uv : dense.uvs) uv = {0.1F + 0.8F * uv.x, 0.1F + 0.8F * uv.y};
  return dense;
}

bool same(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

/// To the bit. \returns what differs first, or nothing
std::string difference(BakeSession& session, const Mesh& low, const BakeOptions& options,
                       RayTraversal traversal = RayTraversal::automatic) {
  const BakeResult& ours = session.bake();
  const BakeResult fresh =
      bake(Source(*test::device(), session.high(), traversal, session.bounds()), low, options);
  if (ours.coverage != fresh.coverage) return "coverage";
  if (ours.maps.size() != fresh.maps.size()) return "maps";
  for (std::size_t m = 0; m < fresh.maps.size(); ++m) {
    if (!same(ours.maps[m].image.pixels, fresh.maps[m].image.pixels)) {
      return "map " + std::string(fresh.maps[m].kind.name);
    }
    for (std::size_t c = 0; c < fresh.maps[m].ranges.size(); ++c) {
      if (ours.maps[m].ranges[c].high != fresh.maps[m].ranges[c].high) return "range";
    }
    if (ours.maps[m].mips.size() != fresh.maps[m].mips.size()) return "levels";
    for (std::size_t i = 0; i < fresh.maps[m].mips.size(); ++i) {
      if (!same(ours.maps[m].mips[i].pixels, fresh.maps[m].mips[i].pixels)) return "level";
    }
  }
  if (ours.report.gutter_texels != fresh.report.gutter_texels) return "gutter count";
  if (fresh.match) {
    if (ours.match->triangle != fresh.match->triangle) return "triangles";
    if (!same(ours.match->u, fresh.match->u) || !same(ours.match->v, fresh.match->v)) return "uv";
    if (!same(ours.match->distance, fresh.match->distance)) return "distances";
    if (ours.match->source_hash != fresh.match->source_hash) return "hash";
    if (ours.match->low_hash != fresh.match->low_hash) return "low hash";
  }
  return {};
}

/// Moves vertices [first, first + count) a little.
void shake(BakeSession& session, std::uint32_t first, std::uint32_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<Vec3> positions(session.high().positions.begin() + first,
                              session.high().positions.begin() + first + count);
  for (Vec3& p : positions) p.z += static_cast<float>(random() % 1000) * 1e-5F - 0.005F;
  session.set_positions(first, positions);
}

TEST(Session, FirstBakeIsABake) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = inset_plane();
  for (const MatchMethod method :
       {MatchMethod::uv, MatchMethod::ray, MatchMethod::closest, MatchMethod::views,
        MatchMethod::visibility, MatchMethod::hybrid}) {
    BakeOptions options = small(method);
    options.report.keep_match = true;
    const Mesh dense = inset(bumpy_plane(30, false));
    BakeSession session(*test::device(), dense, low, options);
    EXPECT_EQ(difference(session, low, options), "") << method.name;
    const BakeResult plain = bake(Source(*test::device(), dense), low, options);
    EXPECT_TRUE(same(plain.maps[0].image.pixels, session.bake().maps[0].image.pixels));
    EXPECT_EQ(plain.report.samples, session.bake().report.samples);
    EXPECT_EQ(plain.report.missed, session.bake().report.missed);
    EXPECT_EQ(plain.report.mean_abs_distance, session.bake().report.mean_abs_distance);
    EXPECT_EQ(plain.report.warnings.size(), session.bake().report.warnings.size());
    EXPECT_EQ(session.last_update().texels, 0U);  // nothing had changed
  }
}

TEST(Session, RandomUpdatesEqualFreshBakes) {
  KILN_REQUIRE_DEVICE();
  EXPECT_TRUE(rc::check("all methods", [] {
    const auto method =
        *rc::gen::element(MatchMethod::uv, MatchMethod::uv, MatchMethod::ray, MatchMethod::closest,
                          MatchMethod::views, MatchMethod::visibility);
    const bool with_normals = *rc::gen::arbitrary<bool>();
    BakeOptions options = small(method);
    options.samples = *rc::gen::inRange(1U, 4U);
    options.report.keep_match = *rc::gen::arbitrary<bool>();
    options.encoding.mips = *rc::gen::inRange(0, 4) == 0;
    options.encoding.gutter = *rc::gen::element(0, 3, -1);
    options.encoding.miss = *rc::gen::element(MissPolicy::keep, MissPolicy::fill, MissPolicy::mark);
    options.encoding.space = *rc::gen::element(NormalMapSpace::tangent, NormalMapSpace::object);
    options.encoding.two_component =
        options.encoding.space == NormalMapSpace::tangent && *rc::gen::arbitrary<bool>();
    if (method == MatchMethod::views) options.match.views.size = 64;
    const Mesh low = inset_plane();
    Mesh dense = inset(bumpy_plane(24, with_normals));
    if (*rc::gen::arbitrary<bool>()) {  // a hole, so that samples are missed
      dense.triangles.resize(900);
      dense.uv_triangles.resize(900);
      if (with_normals) dense.normal_triangles.resize(900);
    }
    BakeSession session(*test::device(), dense, low, options);
    const int steps = *rc::gen::inRange(1, 5);
    for (int step = 0; step < steps; ++step) {
      const int edits = *rc::gen::inRange(1, 3);
      for (int edit = 0; edit < edits; ++edit) {
        const std::uint32_t first = *rc::gen::inRange(0U, 625U);
        const std::uint32_t count = *rc::gen::inRange(0U, 626U - first);
        if (with_normals && *rc::gen::arbitrary<bool>()) {
          std::vector<Vec3> normals(count);
          for (Vec3& n : normals) {
            n = {static_cast<float>(*rc::gen::inRange(-5, 6)), 1, 7};
          }
          session.set_normals(first, normals);
        } else {
          shake(session, first, count, *rc::gen::arbitrary<std::uint32_t>());
        }
      }
      RC_ASSERT(difference(session, low, options) == "");
    }
  }));
}

/// All maps that a match allows.
std::vector<MapKind> many_maps(MatchMethod method) {
  std::vector<MapKind> kinds;
  for (const MapInfo& info : maps()) {
    const std::string_view name = info.kind.name;
    const bool reads_match = name == "visibility" || name == "deviation";
    if (!reads_match || method == MatchMethod::visibility) kinds.push_back(info.kind);
  }
  return kinds;
}

TEST(Session, EveryMapFollowsTheMesh) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = inset_plane();
  for (const MatchMethod method : {MatchMethod::uv, MatchMethod::ray, MatchMethod::visibility}) {
    for (const bool with_normals : {false, method == MatchMethod::uv}) {
      BakeOptions options = small(method);
      options.maps = many_maps(method);
      options.occlusion.rays = 4;
      Mesh dense = inset(bumpy_plane(24, with_normals));
      // The last two rows are apart, but where they lie.
      const auto rest = static_cast<std::uint32_t>(dense.positions.size());
      for (std::size_t t = dense.triangles.size() - 96; t < dense.triangles.size(); ++t) {
        for (std::uint32_t& corner : dense.triangles[t]) {
          dense.positions.push_back(dense.positions[corner]);
          corner = static_cast<std::uint32_t>(dense.positions.size() - 1);
        }
      }
      for (std::size_t i = 0; i < dense.positions.size(); ++i) {
        const auto level = static_cast<std::uint8_t>(i * 7 % 256);
        dense.colors.push_back({level, 90, static_cast<std::uint8_t>(255 - level), level});
      }
      BakeSession session(*test::device(), dense, low, options);
      shake(session, 200, 100, 5);
      EXPECT_EQ(difference(session, low, options), "") << method.name;
      // They part from the others, one triangle after another, and facets are larger by far.
      std::vector<Vec3> apart(session.high().positions);
      for (std::size_t i = rest; i < apart.size(); ++i) apart[i].z += 0.001F * (i - rest) / 3;
      for (std::size_t i = 0; i < rest; ++i) apart[i].z = 6 * apart[i].z;
      session.set_positions(0, apart);
      EXPECT_EQ(difference(session, low, options), "") << method.name;
    }
  }
}

TEST(Session, ABakeThatWasStoppedLeavesTheNextOneWhole) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = inset_plane();
  BakeOptions options = small(MatchMethod::uv);
  options.maps = {MapKind::normal, MapKind{"ao"}, MapKind{"position"}};
  options.occlusion.rays = 4;
  const std::chrono::milliseconds pause = std::exchange(min_progress_interval, {});
  BakeSession session(*test::device(), inset(bumpy_plane(24, true)), low, options);
  session.bake();
  int stopped = 0;
  for (int last = 0; last < 1000; last = last * 5 / 4 + 1) {
    if (stopped % 3 != 0) shake(session, 10U * static_cast<std::uint32_t>(stopped), 100, 7);
    if (stopped % 3 != 1) {
      const Vec3 normal = {0.01F * static_cast<float>(stopped), 0.3F, 1};
      session.set_normals(100, std::vector<Vec3>(300, normal));
    }
    int told = 0;
    try {
      const ProgressScope scope([&](double, std::string_view) { return told++ < last; });
      session.bake();
      break;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::cancelled);
      ++stopped;
    }
    if (stopped % 5 == 0) shake(session, 300, 200, 8);
    EXPECT_EQ(difference(session, low, options), "") << "stopped at " << last;
  }
  min_progress_interval = pause;
  EXPECT_GT(stopped, 5);
}

TEST(Session, TouchesOnlyWhatChanged) {
  KILN_REQUIRE_DEVICE();
  BakeOptions options = small(MatchMethod::uv);
  options.width = options.height = 128;
  options.samples = 1;
  const Mesh low = inset_plane();
  BakeSession session(*test::device(), inset(bumpy_plane(64, false)), low, options);
  session.bake();
  EXPECT_TRUE(session.last_update().matched);
  const std::uint64_t all = session.last_update().texels;
  // A vertex of the middle: its 6 triangles, their 7 vertices' normals, all triangles around these.
  shake(session, 65 * 32 + 32, 1, 1);
  EXPECT_EQ(difference(session, low, options), "");
  EXPECT_FALSE(session.last_update().matched);
  EXPECT_EQ(session.last_update().triangles, 24U);
  EXPECT_GT(session.last_update().texels, 20U);
  EXPECT_LT(session.last_update().texels, 80U);
  // The same positions again: nothing.
  session.set_positions(7, std::span(session.high().positions).subspan(7, 50));
  session.bake();
  EXPECT_EQ(session.last_update().texels, 0U);
  shake(session, 0, 65 * 65, 2);
  EXPECT_EQ(difference(session, low, options), "");
  EXPECT_EQ(session.last_update().texels, all);
}

TEST(Session, TheGutterFollowsTheTexelsThatItCopies) {
  KILN_REQUIRE_DEVICE();
  const BakeOptions options = small(MatchMethod::uv);
  const Mesh low = inset_plane();
  BakeSession session(*test::device(), inset(bumpy_plane(24, false)), low, options);
  const std::vector<float> before = session.bake().maps[0].image.pixels;
  shake(session, 0, 20, 4);  // of the lower border
  EXPECT_EQ(difference(session, low, options), "");
  EXPECT_FALSE(session.last_update().matched);
  EXPECT_LT(session.last_update().texels, 70U * 45 / 4);
  const BakeResult& after = session.bake();
  std::uint64_t changed = 0;
  for (std::size_t i = 0; i < after.coverage.size(); ++i) {
    if (after.coverage[i] != 3) continue;
    changed += after.maps[0].image.pixels[3 * i] != before[3 * i] ? 1 : 0;
  }
  EXPECT_GT(changed, 100U);
}

TEST(Session, VerticesThatMeetOrPartAreWeldedAnew) {
  KILN_REQUIRE_DEVICE();
  const BakeOptions options = small(MatchMethod::uv);
  const Mesh low = inset_plane();
  Mesh dense = inset(bumpy_plane(20, false));
  // Two triangles get vertices of their own where they were.
  for (const std::size_t t : {100, 301}) {
    for (std::uint32_t& corner : dense.triangles[t]) {
      dense.positions.push_back(dense.positions[corner]);
      corner = static_cast<std::uint32_t>(dense.positions.size() - 1);
    }
  }
  BakeSession session(*test::device(), dense, low, options);
  session.bake();
  const auto last = static_cast<std::uint32_t>(dense.positions.size() - 1);
  shake(session, last - 5, 6, 3);
  EXPECT_EQ(difference(session, low, options), "");
  session.set_positions(last - 5, std::span(dense.positions).subspan(last - 5, 6));
  EXPECT_EQ(difference(session, low, options), "");
  // A triangle that folds up has no normal, and one side of it then no area.
  const Triangle& t = dense.triangles[222];
  const std::vector<Vec3> corner = {dense.positions[t[0]]};
  session.set_positions(t[1], corner);
  EXPECT_EQ(difference(session, low, options), "");
}

TEST(Session, TrianglesThatLoseTheirAreaLeaveTheHierarchy) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = test::plane(1, 1);
  for (const RayTraversal traversal : {RayTraversal::cpu, RayTraversal::gpu}) {
    const BakeOptions options = small(MatchMethod::ray);
    SessionOptions how;
    how.traversal = traversal;
    const Mesh dense = bumpy_plane(20, false);
    BakeSession session(*test::device(), dense, low, options, how);
    session.bake();
    const Triangle& t = dense.triangles[222];
    const std::vector<Vec3> corner = {dense.positions[t[0]]};
    session.set_positions(t[1], corner);
    EXPECT_EQ(difference(session, low, options, traversal), "");
    const std::vector<Vec3> before = {dense.positions[t[1]]};
    session.set_positions(t[1], before);
    EXPECT_EQ(difference(session, low, options, traversal), "");
  }
}

TEST(Session, RefittedBoxesAreAsTightAsFreshOnes) {
  const Mesh soup = test::random_soup(3000, 5);
  Mesh moved = soup;
  std::mt19937 random(1);
  for (Vec3& p : moved.positions) p.x += static_cast<float>(random() % 1000) * 1e-3F;
  Bvh bvh = build_bvh(soup.positions, soup.triangles);
  refit_bvh(bvh, moved.positions, moved.triangles);
  // Every box is exactly that of what it holds, widened.
  const auto box_of = [&](const auto& self, std::uint32_t child, float* lo, float* hi) -> void {
    if ((child & KILN_BVH_LEAF) == 0) {
      const kiln_bvh_node& node = bvh.nodes()[child];
      for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
        if (node.planes[0][0][c] <= node.planes[0][1][c]) self(self, node.child[c], lo, hi);
      }
      return;
    }
    const kiln_bvh_block& block = bvh.blocks()[child & ~KILN_BVH_LEAF];
    for (std::size_t lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
      if (block.triangle[lane] == KILN_NO_TRIANGLE) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3& p = moved.positions[moved.triangles[block.triangle[lane]][k]];
        const float xyz[3] = {p.x, p.y, p.z};
        for (std::size_t a = 0; a < 3; ++a) {
          lo[a] = std::min(lo[a], xyz[a]);
          hi[a] = std::max(hi[a], xyz[a]);
          ASSERT_EQ(block.corner[k][a][lane], xyz[a]);
        }
      }
    }
  };
  for (const kiln_bvh_node& node : bvh.nodes()) {
    for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
      if (node.planes[0][0][c] > node.planes[0][1][c]) continue;
      float lo[3] = {1e9F, 1e9F, 1e9F};
      float hi[3] = {-1e9F, -1e9F, -1e9F};
      box_of(box_of, node.child[c], lo, hi);
      for (std::size_t a = 0; a < 3; ++a) {
        ASSERT_EQ(node.planes[a][0][c], lo[a] - KILN_BVH_EPSILON);
        ASSERT_EQ(node.planes[a][1][c], hi[a] + KILN_BVH_EPSILON);
      }
    }
  }
}

TEST(Session, WithinBoundsEqualsABakeWithoutThem) {
  KILN_REQUIRE_DEVICE();
  // The border stays where it is, and so do the mesh's own bounds.
  const BakeOptions options = small(MatchMethod::ray);
  const Mesh low = test::plane(1, 1);
  Mesh dense = bumpy_plane(20, false);
  dense.positions[210].z = 0.02F;
  dense.positions[231].z = -0.02F;
  BakeSession session(*test::device(), dense, low, options);
  session.bake();
  shake(session, 232, 30, 9);
  const BakeResult fresh = bake(Source(*test::device(), session.high()), low, options);
  EXPECT_TRUE(same(fresh.maps[0].image.pixels, session.bake().maps[0].image.pixels));
}

TEST(Session, RefusesWhatItCannotDo) {
  KILN_REQUIRE_DEVICE();
  const Mesh low = inset_plane();
  const BakeOptions options = small(MatchMethod::uv);
  const Mesh dense = inset(bumpy_plane(8, true));
  BakeSession session(*test::device(), dense, low, options);
  const std::vector<Vec3> far = {{50, 0, 0}};
  const std::vector<Vec3> none = {{std::nanf(""), 0, 0}};
  const std::vector<Vec3> zero = {{0, 0, 0}};
  EXPECT_THROW(session.set_positions(0, far), Error);
  EXPECT_THROW(session.set_positions(0, none), Error);
  EXPECT_THROW(session.set_positions(81, zero), Error);
  EXPECT_THROW(session.set_normals(0, zero), Error);
  EXPECT_THROW(session.set_normals(81, std::vector<Vec3>{{0, 0, 1}}), Error);
  EXPECT_EQ(difference(session, low, options), "");
  BakeSession plain(*test::device(), inset(bumpy_plane(8, false)), low, options);
  EXPECT_THROW(plain.set_normals(0, std::vector<Vec3>{{0, 0, 1}}), Error);
  Mesh broken = dense;
  broken.positions[3].x = std::nanf("");
  EXPECT_THROW(BakeSession(*test::device(), broken, low, options), Error);
  SessionOptions flat;
  flat.bounds = Bounds{};
  EXPECT_THROW(BakeSession(*test::device(), dense, low, options, flat), Error);
  BakeOptions parted = small(MatchMethod::visibility);
  parted.match.visibility.clusters = 2;
  EXPECT_THROW(BakeSession(*test::device(), dense, low, parted), Error);
  BakeOptions blended = options;
  blended.match.fallback = {MatchMethod::ray};
  blended.match.fallback_blend = 4;
  EXPECT_THROW(BakeSession(*test::device(), dense, low, blended), Error);
  BakeOptions measured = options;
  measured.report.errors = true;
  EXPECT_THROW(BakeSession(*test::device(), dense, low, measured), Error);
  SessionOptions elsewhere;
  elsewhere.bounds = Bounds{{5, 5, 5}, {6, 6, 6}};
  EXPECT_THROW(BakeSession(*test::device(), dense, low, options, elsewhere), Error);
  EXPECT_THROW(Source(*test::device(), dense, RayTraversal::automatic, elsewhere.bounds), Error);
  BakeOptions watched = options;
  watched.progress = [](double, std::string_view) { return true; };
  EXPECT_THROW(BakeSession(*test::device(), dense, low, watched), Error);
}

/// Vertices may lie outside of bounds by as much as the frame of searches holds: up to the diagonal, rounded up to a power of
/// two, from the middle along each axis.
TEST(Session, VerticesMayLeaveBoundsUpToALimit) {
  KILN_REQUIRE_DEVICE();
  const Bounds bounds{{-1, -1, -1}, {1, 1, 1}};
  const double limit = 4;  // the diagonal is 3.46
  const auto made = [&](const Vec3& last) {
    Mesh high;
    high.positions = {{0, 0, 0}, {1, 0, 0}, last};
    high.triangles = {{0, 1, 2}};
    Source(*test::device(), high, RayTraversal::automatic, bounds);
  };
  for (const double sign : {-1.0, 1.0}) {
    for (const int axis : {0, 1, 2}) {
      const auto at = [&](double share) {
        const auto far = static_cast<float>(sign * share * limit);
        Vec3 p{0.5F, 0.5F, 0.5F};
        (axis == 0 ? p.x : axis == 1 ? p.y : p.z) = far;
        return p;
      };
      EXPECT_NO_THROW(made(at(0.98)));
      EXPECT_THROW(made(at(1.02)), Error);
    }
  }
  // A mesh that is none is refused with bounds, too.
  Mesh high;
  high.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  high.triangles = {{0, 1, 2}};
  high.uvs = {{0, 0}};
  high.uv_triangles = {{0, 0, 5}};
  EXPECT_THROW(Source(*test::device(), high, RayTraversal::automatic, bounds), Error);
}

}  // namespace
}  // namespace kiln
