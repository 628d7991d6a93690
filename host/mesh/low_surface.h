// The light mesh made ready for sampling.
#pragma once

#include <vector>

#include "kiln/mesh.h"
#include "kiln/types.h"
#include "mesh/frame.h"

namespace kiln {

/// Per-corner data of the light mesh, in the frame of the dense one. All vectors have one entry a
/// triangle, three corners each, in the mesh's triangle order.
struct LowSurface {
  struct Corner {
    Vec3 position;
    Vec3 direction;  ///< Unit: the continuous field along which rays leave; or, with a cage mesh,
                     ///< the (unnormalised) offset from the surface to the cage.
    Vec3 normal;     ///< Unit shading normal of this corner (split at hard edges).
    Vec3 tangent;    ///< Unit, MikkTSpace
    float sign = 1;  ///< Bitangent = sign * cross(normal, tangent)
    Vec2 uv;
    float straight = 0;  ///< Of the vertex's colour: 1 where red is full (RayDirection::painted)
  };
  std::vector<std::array<Corner, 3>> triangles;
  std::vector<std::uint8_t> usable;  ///< 0 for triangles with a non-finite or degenerate position.
  static constexpr std::uint32_t kNoCopy = 0xFFFFFFFFU;
  /// Of each triangle that shares its texels with another one, which is baked for both: that one; else
  /// kNoCopy. Empty where no triangle shares any.
  std::vector<std::uint32_t> copy_of;
  bool has_cage_mesh = false;

  /// Prepares a mesh: continuous directions, corner normals, tangents, everything in `frame`.
  /// \param copies  which of several triangles of the same UVs is baked
  /// \param cage  null, or a mesh with the same triangles: directions are then cage - position
  /// \throws Error(input) where the mesh has no UVs, no usable triangle, or a cage of another topology
  static LowSurface of(const Mesh& low, const Frame& frame, const Mesh* cage = nullptr,
                       UvCopies copies = UvCopies::plain);
  bool is_copy(std::size_t triangle) const {
    return !copy_of.empty() && copy_of[triangle] != kNoCopy;
  }
};

}  // namespace kiln
