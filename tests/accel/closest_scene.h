// Ways to find closest points, for tests of their kernels.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "accel/closest.h"
#include "kiln/render.h"
#include "support/ray_scene.h"

namespace kiln::test {

inline constexpr double kU = 0x1p-24;  // half a unit in the last place of 1

inline std::shared_ptr<const Tree> tree_of(const Scene& scene) {
  return std::make_shared<const Tree>(context_of(*device()), scene.positions, scene.triangles);
}

inline ClosestFinder finder_of(const Scene& scene, Traversal traversal) {
  return ClosestFinder(context_of(*device()), tree_of(scene), traversal);
}

inline Cast find(const ClosestFinder& finder, const std::vector<Ray>& samples,
                 const ClosestQuery& query) {
  return match_of(samples, [&](const cl::Array<float>& points, std::uint32_t count,
                               std::uint32_t capacity, DeviceCorrespondence& result) {
    finder.find(points, count, capacity, query, result);
  });
}

}  // namespace kiln::test
