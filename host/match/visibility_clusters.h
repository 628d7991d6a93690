// Parting the directions that see a place into clusters (Tarini, Cignoni, Scopigno 2003, section 6).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/vector.h"

namespace kiln {

/// A direction that sees a place, by how much.
struct SeeingDirection {
  Vec3d toward;
  double weight = 1;
};

/// Unit mean directions of the clusters; as many as asked for, or as there are directions.
///
/// k-means on the sphere. It begins from the direction farthest from the mean, then each time from
/// the one farthest from all so far; 16 rounds; ties go to the lower index. So the same directions
/// give the same clusters. They come ordered along a fixed axis, so that neighbouring places agree
/// on which is which wherever that can be.
std::vector<Vec3d> part_directions(std::span<const SeeingDirection> directions,
                                   std::uint32_t count);

/// A texel of the field whose directions scatter.
struct PartedTexel {
  std::uint32_t pixel = 0;
  std::vector<Vec3d> directions;  ///< Mean directions of its clusters, 2 or more
};

}  // namespace kiln
