// Tangent frames in MikkTSpace's convention.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kiln/types.h"

namespace kiln {

/// Tangent of a triangle's corner, for which bitangent = sign * cross(normal, tangent).
struct CornerTangent {
  Vec3 tangent{1, 0, 0};
  float sign = 1;
};

/// Computes per-corner tangents in MikkTSpace's convention (Mikkelsen 2008, "Simulation of Wrinkled Surfaces
/// Revisited"): corners with equal position, normal and UV share a vertex; groups grow across edges whose triangles
/// have the same UV orientation; tangents are projected on the corner's normal plane and weighted by the corner's
/// angle.
///
///
/// \param positions  [3 * triangles] corner positions
/// \param normals    [3 * triangles] unit corner normals
/// \param uvs        [3 * triangles]
/// \returns [3 * triangles]
/// Degenerate triangles copy the tangent of a valid corner at the same position; if there is none, they get a unit
/// vector perpendicular to the normal. Never NaN. Deterministic.
std::vector<CornerTangent> mikk_tangents(std::span<const Vec3> positions,
                                         std::span<const Vec3> normals, std::span<const Vec2> uvs);

}  // namespace kiln
