// The low poly made ready for sampling.
#pragma once

#include <memory>
#include <vector>

#include "base/made_once.h"
#include "kiln/mesh.h"
#include "kiln/types.h"
#include "mesh/cage.h"
#include "mesh/frame.h"

namespace kiln {

/// Per-corner data of the low poly, in the frame of the high poly. All vectors have one entry a
/// triangle, three corners each, in the mesh's triangle order.
struct LowSurface {
  class UsableTriangles;
  struct Corner {
    Vec3 position;
    Vec3 direction;  ///< Unit: the continuous field along which rays leave; or, with a cage mesh of
                     ///< CageKind::offsets, the (unnormalised) offset from the surface to the cage.
    Vec3 normal;     ///< Unit shading normal of this corner (split at hard edges).
    Vec3 tangent;    ///< Unit, MikkTSpace
    float sign = 1;  ///< Bitangent = sign * cross(normal, tangent)
    Vec2 uv;
    float straight = 0;  ///< Red of the vertex's colour, 0 to 1 (RayDirection::painted)
    float outward = 0;   ///< With CageKind::shells: how far out rays start, frame units
    float inward = 0;    ///< ... and how far in they end
  };
  std::vector<std::array<Corner, 3>> triangles;
  std::vector<std::uint8_t> usable;  ///< 0 for triangles with a non-finite or degenerate position.
  /// Triangles whose UVs are finite: few, of a texture set. Those of all others are NaN, and their tangents say nothing.
  std::vector<std::uint32_t> with_uvs;
  static constexpr std::uint32_t kNoCopy = 0xFFFFFFFFU;
  /// For each triangle that shares its texels with another one, which is baked for both: that one; else
  /// kNoCopy. Empty where no triangle shares any.
  std::vector<std::uint32_t> copy_of;
  bool has_cage_mesh = false;
  CageKind cage_kind = CageKind::offsets;     ///< Kind of its cage, if it has one
  std::shared_ptr<const CageHull> cage_hull;  ///< Set for CageKind::hull
  /// With a cage mesh: how long rays are where nobody says. Of a hull CageReach finds it out.
  double cage_length = 0;
  /// Arrays made of all this but the UVs. Copies share them, which may have other UVs.
  std::shared_ptr<MadeOnce> made = std::make_shared<MadeOnce>();

  /// Prepares a mesh: continuous directions, corner normals, tangents, everything in `frame`.
  /// \param copies  which of several triangles of the same UVs is baked
  /// \param cage  null, or a cage of any kind: see CageKind
  /// \throws Error(input) where the mesh has no UVs or no usable triangle
  static LowSurface of(const Mesh& low, const Frame& frame, const Mesh* cage = nullptr,
                       UvCopies copies = UvCopies::plain);
  // of() step by step, for meshes that differ in UVs and tangents alone: texture sets.
  /// \throws Error(input) for a mesh that does not hold together, or has no UVs
  static void check(const Mesh& low);
  /// All but UVs, tangents and copies.
  static LowSurface without_uvs(const Mesh& low, const Frame& frame, const Mesh* cage = nullptr);
  /// Triangles of a checked mesh whose UVs are finite.
  static std::vector<std::uint32_t> find_with_uvs(const Mesh& low);
  /// UVs and tangents of a checked mesh, in place of any there are; then find_uv_copies().
  void lay_out(const Mesh& low);

  /// Distances of shells from their triangles, with CageKind::shells: six values a triangle: its unit
  /// normal; how far out along it the outer shell lies over each corner, or how far in the inner one.
  std::vector<float> shell(bool inner) const;
  /// Indices of usable triangles, in order, for a range-based loop.
  UsableTriangles usable_triangles() const;
  bool is_copy(std::size_t triangle) const {
    return !copy_of.empty() && copy_of[triangle] != kNoCopy;
  }
};

/// Made by LowSurface::usable_triangles(); the surface must outlive it.
class LowSurface::UsableTriangles {
 public:
  class Iterator {
   public:
    Iterator(const std::vector<std::uint8_t>& usable, std::size_t at) : usable_(usable), at_(at) {
      skip();
    }
    std::size_t operator*() const { return at_; }
    Iterator& operator++() {
      ++at_;
      skip();
      return *this;
    }
    bool operator!=(const Iterator& other) const { return at_ != other.at_; }

   private:
    void skip() {
      while (at_ < usable_.size() && usable_[at_] == 0) ++at_;
    }
    const std::vector<std::uint8_t>& usable_;
    std::size_t at_;
  };

  explicit UsableTriangles(const std::vector<std::uint8_t>& usable) : usable_(usable) {}
  Iterator begin() const { return {usable_, 0}; }
  Iterator end() const { return {usable_, usable_.size()}; }

 private:
  const std::vector<std::uint8_t>& usable_;
};

inline LowSurface::UsableTriangles LowSurface::usable_triangles() const {
  return UsableTriangles(usable);
}

}  // namespace kiln
