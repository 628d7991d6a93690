// The cost of a search grows no faster than it should, whatever the mesh: nodes and leaves that a search
// visits are counted, not seconds.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "accel/bvh.h"
#include "kiln/render.h"
#include "support/crowded.h"

namespace kiln {
namespace {

using Scene = test::Soup;
using Random = test::PortableRandom;

constexpr float kPi = 3.14159265F;

/// n copies of one triangle.
Scene stacked(std::uint32_t n) {
  Scene scene;
  for (std::uint32_t i = 0; i < n; ++i)
    scene.add({-0.4F, -0.4F, 0}, {0.4F, -0.4F, 0}, {0, 0.4F, 0});
  return scene;
}

/// n thin triangles of a fifth of the scene's length, as needles of a tree lie.
Scene needles(std::uint32_t n) {
  Scene scene;
  Random random(1);
  const float width = 0.1F / std::sqrt(static_cast<float>(n));
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 a = random.point(0.4F);
    const float angle = 2 * kPi * random.unit(), length = 0.2F;
    scene.add(a, {a.x + length * std::cos(angle), a.y + length * std::sin(angle), a.z + 0.01F},
              {a.x + width, a.y + width, a.z + width});
  }
  return scene;
}

/// 16 spheres within one another.
Scene shells(std::uint32_t n) {
  Scene scene;
  constexpr std::uint32_t kShells = 16;
  const auto rings = static_cast<std::uint32_t>(
      std::max(3.0, std::sqrt(static_cast<double>(n) / (2 * kShells) / 2)));
  const std::uint32_t slices = 2 * rings;
  for (std::uint32_t shell = 0; shell < kShells; ++shell) {
    const float radius = 0.45F * (1 - 0.01F * static_cast<float>(shell));
    const auto at = [&](std::uint32_t y, std::uint32_t x) {
      const float down = kPi * static_cast<float>(y) / static_cast<float>(rings);
      const float round = 2 * kPi * static_cast<float>(x % slices) / static_cast<float>(slices);
      return Vec3{radius * std::sin(down) * std::cos(round), radius * std::cos(down),
                  radius * std::sin(down) * std::sin(round)};
    };
    for (std::uint32_t y = 0; y < rings; ++y) {
      for (std::uint32_t x = 0; x < slices; ++x) {
        if (y != 0) scene.add(at(y, x), at(y + 1, x), at(y, x + 1));
        if (y + 1 != rings) scene.add(at(y, x + 1), at(y + 1, x), at(y + 1, x + 1));
      }
    }
  }
  return scene;
}

/// A flat sheet, cell by cell.
Scene grid(std::uint32_t n) {
  Scene scene;
  const auto side = static_cast<std::uint32_t>(std::sqrt(n / 2.0));
  const auto at = [side](std::uint32_t i) {
    return 0.9F * static_cast<float>(i) / static_cast<float>(side) - 0.45F;
  };
  for (std::uint32_t y = 0; y < side; ++y) {
    for (std::uint32_t x = 0; x < side; ++x) {
      scene.add({at(x), at(y), 0}, {at(x + 1), at(y), 0}, {at(x), at(y + 1), 0});
      scene.add({at(x + 1), at(y), 0}, {at(x + 1), at(y + 1), 0}, {at(x), at(y + 1), 0});
    }
  }
  return scene;
}

/// n / 4 tetrahedra strewn about, a hundredth as wide as the gaps between them.
Scene parts(std::uint32_t n) {
  Scene scene;
  Random random(2);
  const float size = 0.01F / std::cbrt(static_cast<float>(n));
  for (std::uint32_t i = 0; i < n / 4; ++i) {
    const Vec3 p = random.point(0.45F);
    const Vec3 a{p.x + size, p.y, p.z}, b{p.x, p.y + size, p.z}, c{p.x, p.y, p.z + size};
    scene.add(p, b, a);
    scene.add(p, a, c);
    scene.add(p, c, b);
    scene.add(a, b, c);
  }
  return scene;
}

/// A Sierpinski tetrahedron: parts of parts, at every scale.
Scene sierpinski(std::uint32_t n) {
  Scene scene;
  const std::function<void(const std::array<Vec3, 4>&, std::uint32_t)> divide =
      [&](const std::array<Vec3, 4>& c, std::uint32_t left) {
        if (left < 16) {
          scene.add(c[0], c[2], c[1]);
          scene.add(c[0], c[1], c[3]);
          scene.add(c[0], c[3], c[2]);
          scene.add(c[1], c[2], c[3]);
          return;
        }
        for (const Vec3& corner : c) {
          std::array<Vec3, 4> part = c;
          for (Vec3& p : part) {
            p = {(p.x + corner.x) / 2, (p.y + corner.y) / 2, (p.z + corner.z) / 2};
          }
          divide(part, left / 4);
        }
      };
  constexpr float kSide = 0.4F;
  divide({Vec3{kSide, kSide, kSide}, Vec3{kSide, -kSide, -kSide}, Vec3{-kSide, kSide, -kSide},
          Vec3{-kSide, -kSide, kSide}},
         n);
  return scene;
}

/// Triangles around one centre, each a little larger than the one before.
Scene concentric(std::uint32_t n) {
  Scene scene;
  for (std::uint32_t i = 0; i < n; ++i) {
    const float r = 0.4F * static_cast<float>(i + 1) / static_cast<float>(n);
    const float z = 0.1F * static_cast<float>(i) / static_cast<float>(n);
    scene.add({-r, -r, -z}, {r, -r, z}, {0, r, 0});
  }
  return scene;
}

/// Counts what kernels do: nodes opened, bounding prisms asked and leaves tested.
class Walker {
 public:
  explicit Walker(const Bvh& bvh) : bvh_(bvh) {}
  std::uint64_t visits() const { return visits_; }

  /// The nearest hit of a ray, nearest child first.
  void ray(const Vec3& origin, const Vec3& direction) {
    const auto entry = [&](const kiln_bvh_node& node, std::size_t child) {
      float from = 0, to = 2;
      const float o[] = {origin.x, origin.y, origin.z},
                  d[] = {direction.x, direction.y, direction.z};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float inverse = 1 / (std::abs(d[axis]) < 1e-18F ? 1e-18F : d[axis]);
        const float a = (node.planes[axis][0][child] - o[axis]) * inverse;
        const float b = (node.planes[axis][1][child] - o[axis]) * inverse;
        from = std::max(from, std::min(a, b));
        to = std::min(to, std::max(a, b));
      }
      return from <= to ? from : std::numeric_limits<float>::infinity();
    };
    const auto meets = [&](const kiln_bvh_prism& prism, float best) {
      const double o[] = {origin.x, origin.y, origin.z},
                   d[] = {direction.x, direction.y, direction.z};
      double from = 0, to = 2, slack = double{best};
      for (std::size_t k = 0; k <= KILN_BVH_PRISM_ROOF; ++k) {
        double beyond = -double{prism.plane[3][k]}, along = 0;
        for (std::size_t a = 0; a < 3; ++a) {
          beyond += double{prism.plane[a][k]} * o[a];
          along += double{prism.plane[a][k]} * d[a];
        }
        if (along == 0 && beyond > 0) return false;
        if (along > 0) to = std::min(to, -beyond / along);
        if (along < 0) from = std::max(from, -beyond / along);
        const double least = std::abs(along) - double{prism.tilt};
        if (k == KILN_BVH_PRISM_ROOF && least >= 0.125) slack = double{prism.slack} / least;
      }
      return from <= to && from - slack <= double{best};
    };
    walk(entry, meets, [&](const kiln_bvh_block& block, std::size_t lane) {
      return hit(block, lane, origin, direction);
    });
  }

  /// The nearest point of the boxes: corners stand for triangles, which are small beside their distance.
  void nearest(const Vec3& from) {
    const auto distance = [&](const kiln_bvh_node& node, std::size_t child) {
      const float p[] = {from.x, from.y, from.z};
      float squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float beside = std::max(
            {node.planes[axis][0][child] - p[axis], 0.0F, p[axis] - node.planes[axis][1][child]});
        squared += beside * beside;
      }
      return squared;
    };
    const auto near = [&](const kiln_bvh_prism& prism, float best) {
      float beyond = 0;
      for (std::size_t k = 0; k <= KILN_BVH_PRISM_ROOF; ++k) {
        beyond = std::max(beyond, prism.plane[0][k] * from.x + prism.plane[1][k] * from.y +
                                      prism.plane[2][k] * from.z - prism.plane[3][k]);
      }
      return beyond * beyond <= best;
    };
    walk(distance, near, [&](const kiln_bvh_block& block, std::size_t lane) {
      float best = std::numeric_limits<float>::infinity();
      for (const auto& corner : block.corner) {
        const float x = corner[0][lane] - from.x, y = corner[1][lane] - from.y,
                    z = corner[2][lane] - from.z;
        best = std::min(best, x * x + y * y + z * z);
      }
      return best;
    });
  }

 private:
  static float hit(const kiln_bvh_block& block, std::size_t lane, const Vec3& o, const Vec3& d) {
    const auto corner = [&](std::size_t k) {
      return std::array<double, 3>{block.corner[k][0][lane] - double{o.x},
                                   block.corner[k][1][lane] - double{o.y},
                                   block.corner[k][2][lane] - double{o.z}};
    };
    const auto cross = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
      return std::array<double, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                   a[0] * b[1] - a[1] * b[0]};
    };
    const auto dot = [](const std::array<double, 3>& a, const std::array<double, 3>& b) {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const std::array<double, 3> a = corner(0), b = corner(1), c = corner(2), way{d.x, d.y, d.z};
    const double u = dot(way, cross(c, b)), v = dot(way, cross(a, c)), w = dot(way, cross(b, a));
    const bool within = (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
    const double sum = u + v + w;
    if (!within || sum == 0) return std::numeric_limits<float>::infinity();
    const double t = (u * dot(a, way) + v * dot(b, way) + w * dot(c, way)) / sum / dot(way, way);
    return t >= 0 ? static_cast<float>(t) : std::numeric_limits<float>::infinity();
  }

  template <typename Rank, typename Meets, typename Test>
  void walk(const Rank& rank, const Meets& meets, const Test& test) {
    struct Open {
      float at;
      std::uint32_t child;
    };
    std::vector<Open> stack{{0, 0}};
    float best = std::numeric_limits<float>::infinity();
    while (!stack.empty()) {
      const Open next = stack.back();
      stack.pop_back();
      if (next.at > best) continue;
      ++visits_;
      if ((next.child & KILN_BVH_LEAF) != 0) {
        const kiln_bvh_block& block = bvh_.blocks()[next.child & ~KILN_BVH_LEAF];
        for (std::size_t lane = 0; lane < KILN_BVH_LEAF_TRIANGLES; ++lane) {
          if (block.triangle[lane] != KILN_NO_TRIANGLE) best = std::min(best, test(block, lane));
        }
        continue;
      }
      if ((next.child & KILN_BVH_PRISM) != 0) {
        kiln_bvh_prism prism;
        std::memcpy(&prism, &bvh_.nodes()[node_of_child(next.child) - 1], sizeof prism);
        ++visits_;
        if (!meets(prism, best)) continue;
      }
      const kiln_bvh_node& node = bvh_.nodes()[node_of_child(next.child)];
      const std::size_t first = stack.size();
      for (std::size_t c = 0; c < KILN_BVH_WIDTH; ++c) {
        if (node.planes[0][0][c] > node.planes[0][1][c]) continue;
        const float at = rank(node, c);
        if (at <= best && at < std::numeric_limits<float>::infinity()) {
          stack.push_back({at, node.child[c]});
        }
      }
      std::sort(stack.begin() + static_cast<std::ptrdiff_t>(first), stack.end(),
                [](const Open& a, const Open& b) { return a.at > b.at; });
    }
  }

  const Bvh& bvh_;
  std::uint64_t visits_ = 0;
};

/// Mean visits of a search, by rays from all around or by nearest points.
double mean_visits(const Scene& scene, bool rays) {
  constexpr int kSearches = 256;
  const Bvh bvh = build_bvh(scene.positions, scene.triangles);
  Walker walker(bvh);
  Random random(3);
  for (int i = 0; i < kSearches; ++i) {
    const Vec3 to = random.point(0.4F);
    Vec3 from = random.point(1);
    const float length = std::sqrt(from.x * from.x + from.y * from.y + from.z * from.z);
    from = {from.x / length, from.y / length, from.z / length};
    if (rays) {
      walker.ray(from, {to.x - from.x, to.y - from.y, to.z - from.z});
    } else {
      walker.nearest(to);
    }
  }
  return static_cast<double>(walker.visits()) / kSearches;
}

/// \param rays, nearest  at most this power of the triangles is visited by one search
struct Family {
  const char* name;
  Scene (*make)(std::uint32_t n);
  double rays, nearest;
};

class Growth : public ::testing::TestWithParam<Family> {};

// A map of fixed size makes a fixed number of searches: no family may take more than n^1.2 then, and none
// takes more than n. (Building takes n log n whatever the mesh: each level of nodes sorts its triangles
// 7 times at most, and levels are bounded.) Most families take far less, which their own bounds hold:
//   stacked            one triangle is left of all
//   parts              a ray passes n^(1/3) gaps
//   needles            as long as they are, boxes along the axes overlap: n^(2/3)
//   fan, shifted, slivers  boxes along the axes cannot part them: bounding prisms do, for rays
//   turned             a ray in their midst crosses all; bounding prisms tell those before it from those behind
//   concentric         the same, and none is like another
TEST_P(Growth, OfASearchIsBounded) {
  constexpr std::uint32_t kFew = 1 << 10, kMany = 1 << 15;
  const Scene few = GetParam().make(kFew), many = GetParam().make(kMany);
  const double times =
      static_cast<double>(many.triangles.size()) / static_cast<double>(few.triangles.size());
  for (const bool rays : {true, false}) {
    const double before = mean_visits(few, rays), after = mean_visits(many, rays);
    const double power = std::log(after / before) / std::log(times);
    const std::string name = rays ? "rays" : "nearest";
    RecordProperty(name + "_visits_of_few", std::to_string(before));
    RecordProperty(name + "_visits_of_many", std::to_string(after));
    EXPECT_LE(power, rays ? GetParam().rays : GetParam().nearest)
        << name << ": " << before << " of " << few.triangles.size() << ", " << after << " of "
        << many.triangles.size();
  }
}

INSTANTIATE_TEST_SUITE_P(All, Growth,
                         ::testing::Values(Family{"stacked", stacked, 0.01, 0.01},
                                           Family{"fan", test::fan<Scene>, 0.2, 1.02},
                                           Family{"needles", needles, 0.67, 0.67},
                                           Family{"shells", shells, 0.1, 0.1},
                                           Family{"grid", grid, 0.15, 0.15},
                                           Family{"parts", parts, 0.45, 0.2},
                                           Family{"sierpinski", sierpinski, 0.1, 0.3},
                                           Family{"concentric", concentric, 1.02, 1.02},
                                           Family{"shifted", test::shifted<Scene>, 0.2, 1.02},
                                           Family{"turned", test::turned<Scene>, 0.75, 1.02},
                                           Family{"slivers", test::slivers<Scene>, 0.65, 1.02}),
                         [](const auto& family) { return std::string(family.param.name); });

}  // namespace
}  // namespace kiln
