// Oracle for Tarini's measures (2003, section 4): every triangle against every viewing ray, in double
// precision.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/match.h"
#include "kiln/mesh.h"

namespace kiln::reference {

using Place = std::array<double, 3>;

/// A texel of a match: where its centre lies on the low poly, and F of that.
struct AssessTexel {
  std::size_t element = 0;  ///< Of the match
  std::uint32_t triangle = 0;
  Place position{}, normal{}, match{};  ///< World units; the light face's unit normal
  double area = 0;                      ///< Of the light surface
  bool found = false;
};

/// The texels whose centres lie in a UV triangle, of the lowest triangle each, in the match's order.
std::vector<AssessTexel> assess_texels(const Mesh& high, const Mesh& low, const Match& match);

/// Sums over viewing rays, each weighing its cosine to the light face.
struct RaySums {
  double seen = 0;                              ///< Rays that show the texel
  double across = 0, across_square = 0;         ///< Times the distance from F(p) to the ray
  double met = 0, apart = 0, apart_square = 0;  ///< Those that meet a front face of the high poly
  bool near_edge = false;  ///< A ray passes an edge so closely that it may go either way
};

/// Figures of one texel over all directions.
RaySums view_texel(const Mesh& high, const Mesh& low, const AssessTexel& texel,
                   std::span<const Vec3> directions);

/// Mean of | |F(a) - F(b)| / |a - b| - 1 | in %, over texels above and beside each other.
/// \param chart  of each light triangle
double uniformity_percent(const std::vector<AssessTexel>& texels, const Match& match,
                          std::span<const std::uint32_t> chart, std::uint64_t& pairs);

}  // namespace kiln::reference
