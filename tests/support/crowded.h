// Generates meshes whose bounding boxes overlap heavily, which stress the limits of tree searches.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "kiln/render.h"
#include "kiln/types.h"

namespace kiln::test {

/// A random number generator with equal results on every machine.
class PortableRandom {
 public:
  explicit PortableRandom(unsigned seed) : engine_(seed) {}
  float unit() { return static_cast<float>(engine_() >> 8) * 0x1p-24F; }
  float within(float a) { return (2 * unit() - 1) * a; }
  Vec3 point(float a) {
    const float x = within(a), y = within(a);
    return {x, y, within(a)};
  }

 private:
  std::mt19937 engine_;
};

/// Triangles without common corners.
struct Soup {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
  void add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const auto first = static_cast<std::uint32_t>(positions.size());
    positions.insert(positions.end(), {a, b, c});
    triangles.push_back({first, first + 1, first + 2});
  }
};

/// Makes n large, almost coincident triangles, each shifted by a tiny amount.
template <typename Scene>
Scene shifted(std::uint32_t n) {
  Scene scene;
  PortableRandom random(4);
  for (std::uint32_t i = 0; i < n; ++i) {
    const float z = 1e-7F * static_cast<float>(i);
    const auto at = [&](float x, float y) {
      const Vec3 off = random.point(1e-3F);
      return Vec3{x + off.x, y + off.y, z};
    };
    const Vec3 a = at(-0.4F, -0.4F), b = at(0.4F, -0.4F);
    scene.add(a, b, at(-0.4F, 0.4F));
  }
  return scene;
}

/// Makes n large, almost coincident triangles, each rotated by a small angle.
template <typename Scene>
Scene turned(std::uint32_t n) {
  Scene scene;
  PortableRandom random(5);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 turn = random.point(0.05F);
    const auto at = [&](float x, float y) {
      return Vec3{x - turn.z * y, y + turn.z * x, turn.x * x + turn.y * y};
    };
    scene.add(at(-0.4F, -0.4F), at(0.4F, -0.4F), at(-0.4F, 0.4F));
  }
  return scene;
}

/// Makes n slivers that all pass through one point.
template <typename Scene>
Scene slivers(std::uint32_t n) {
  Scene scene;
  PortableRandom random(6);
  for (std::uint32_t i = 0; i < n; ++i) {
    const Vec3 way = random.point(1), beside = random.point(3e-4F);
    const float size = 0.4F / std::sqrt(way.x * way.x + way.y * way.y + way.z * way.z);
    const Vec3 d{size * way.x, size * way.y, size * way.z};
    scene.add({-d.x, -d.y, -d.z}, d, {d.x + beside.x, d.y + beside.y, d.z + beside.z});
  }
  return scene;
}

/// Makes a disc of n needles around one vertex.
template <typename Scene>
Scene fan(std::uint32_t n) {
  Scene scene;
  const auto at = [n](std::uint32_t i) {
    const float angle = 6.2831853F * static_cast<float>(i) / static_cast<float>(n);
    return Vec3{0.45F * std::cos(angle), 0.45F * std::sin(angle), 0};
  };
  for (std::uint32_t i = 0; i < n; ++i) scene.add({0, 0, 0}, at(i), at(i + 1));
  return scene;
}

}  // namespace kiln::test
