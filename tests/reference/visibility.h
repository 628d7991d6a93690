// Oracle for directions of visibility: every triangle against every direction of every place, in double
// precision.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln::reference {

struct SeenDirection {
  std::array<double, 3> toward{};  ///< Unit
  double weight = 1;
};

struct SeenSum {
  std::array<double, 3> sum{};  ///< Of directions, each by its weight and its cosine to the normal
  double weight = 0;            ///< Of the same factors
  double doubtful = 0;          ///< What rays that pass an edge by less than `slack` weigh, at most
};

/// Adds up the directions that leave the place on its normal's side and meet no triangle between `start`
/// and `end`.
/// \param least_cosine  directions more aslant do not count
/// \param slack         barycentrics that are this near to 0 are in doubt, and distances this near to start
SeenSum see(std::span<const Vec3> positions, std::span<const Triangle> triangles,
            const std::array<double, 3>& place, const std::array<double, 3>& normal,
            std::span<const SeenDirection> directions, double least_cosine, double start,
            double end, double slack);

/// Directions that see the faces around each vertex (Tarini, Cignoni, Scopigno, section 3.3, per vertex): places spread over
/// each face alike see, and each counts for the face's corners by its barycentric weights. Pixels of pictures
/// do the same.
/// \param places  a face: this many squared
std::vector<SeenSum> see_around_vertices(std::span<const Vec3> positions,
                                         std::span<const Triangle> triangles,
                                         std::span<const SeenDirection> directions, int places,
                                         double least_cosine, double start, double end);

}  // namespace kiln::reference
