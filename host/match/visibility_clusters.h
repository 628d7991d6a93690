// Clusters the directions that see a point (Tarini, Cignoni, Scopigno 2003, section 6).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/vector.h"

namespace kiln {

/// A direction from which a point is seen, and its weight.
struct SeenDirection {
  Vec3d toward{};
  double weight = 1;
};

/// Unit mean directions of the clusters: as many as requested, but not more than there are directions.
///
/// k-means on the sphere. Initial centres are the direction farthest from the mean, then repeatedly
/// the one farthest from all centres; 16 iterations; ties go to the lower index. Thus equal directions give equal
/// clusters. They are ordered along a fixed axis, so that neighbouring points mostly have the same order of
/// clusters.
std::vector<Vec3d> cluster_directions(std::span<const SeenDirection> directions,
                                      std::uint32_t count);

/// A texel of the visibility field whose directions are split into clusters.
struct ClusteredTexel {
  std::uint32_t pixel = 0;
  std::vector<Vec3d> directions;  ///< Mean direction of each of the texel's clusters; 2 or more
};

}  // namespace kiln
