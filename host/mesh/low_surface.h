// A low poly that is prepared for sampling.
#pragma once

#include <memory>
#include <vector>

#include "base/lazy_value.h"
#include "kiln/mesh.h"
#include "kiln/types.h"
#include "mesh/cage.h"
#include "mesh/frame.h"

namespace kiln {

/// The data of a low poly at its corners, in the high poly's working frame. Vectors have one entry per triangle, in the
/// order of the mesh's triangles; corner data has three corners per entry.
struct LowSurface {
  class UsableTriangles;
  struct Corner {
    Vec3 position;
    /// Direction of rays: a unit vector of a continuous field. With a cage of CageKind::offsets, it is instead the
    /// offset from the surface to the cage, not normalized
    Vec3 direction;
    Vec3 normal;     ///< Unit shading normal of this corner (split at hard edges)
    Vec3 tangent;    ///< Unit tangent by MikkTSpace
    float sign = 1;  ///< Bitangent = sign * cross(normal, tangent)
    Vec2 uv;
    float straight = 0;  ///< Red of the vertex colour, 0 to 1 (for RayDirection::painted)
    /// With CageKind::shells: distance outside at which rays start, frame units
    float outward = 0;
    float inward = 0;  ///< With CageKind::shells: distance inside at which rays end, frame units
  };
  std::vector<std::array<Corner, 3>> triangles;
  /// 1 for each usable triangle; 0 if a triangle is not finite or degenerate
  std::vector<std::uint8_t> usable;
  /// Triangles with finite UVs, which are few in a texture set. All other triangles have NaN as UVs and undefined
  /// tangents.
  std::vector<std::uint32_t> with_uvs;
  static constexpr std::uint32_t kNoCopy = 0xFFFFFFFFU;
  /// For each triangle that is a UV copy, the triangle that is baked for both, since they share texels; kNoCopy for
  /// triangles that are baked. Empty if there are no UV copies.
  std::vector<std::uint32_t> copy_of;
  bool has_cage_mesh = false;
  CageKind cage_kind = CageKind::offsets;     ///< Kind of the cage mesh, if there is one
  std::shared_ptr<const CageHull> cage_hull;  ///< The hull, for CageKind::hull
  /// Default length of rays that start on a cage mesh. For hulls, CageReach computes the length instead.
  double cage_length = 0;
  /// Cached arrays that depend on everything except the UVs. Copies of this struct share them, even if their UVs
  /// differ.
  std::shared_ptr<LazyValue> made = std::make_shared<LazyValue>();

  /// Prepares a mesh: continuous directions, corner normals and tangents, all in `frame`.
  /// \param copies  which one of several UV copies is baked
  /// \param cage  a cage of any CageKind; may be null
  /// \throws Error(input) if the mesh has no UVs or no usable triangle
  static LowSurface of(const Mesh& low, const Frame& frame, const Mesh* cage = nullptr,
                       UvCopies copies = UvCopies::plain);
  // The steps of LowSurface::of() one by one, for texture sets, whose meshes only differ in UVs and tangents. check()
  // validates a mesh.
  // \throws Error(input) for an invalid mesh, or one without UVs
  static void check(const Mesh& low);
  /// The first step: computes everything except UVs, tangents and UV copies.
  static LowSurface without_uvs(const Mesh& low, const Frame& frame, const Mesh* cage = nullptr);
  /// The triangles of a valid mesh that have finite UVs.
  static std::vector<std::uint32_t> find_with_uvs(const Mesh& low);
  /// Replaces UVs and tangents by those of a valid mesh. find_uv_copies() must be called afterwards.
  /// \param laid_out  result of find_with_uvs(low)
  void lay_out(const Mesh& low, std::vector<std::uint32_t> laid_out);

  /// With CageKind::shells: six values for each triangle. These are its unit normal, and for each corner the distance
  /// along the normal to the inner or outer shell.
  std::vector<float> shell(bool inner) const;
  /// The indices of usable triangles, as a range in ascending order.
  UsableTriangles usable_triangles() const;
  bool is_copy(std::size_t triangle) const {
    return !copy_of.empty() && copy_of[triangle] != kNoCopy;
  }
};

/// The range that LowSurface::usable_triangles() returns. The surface must outlive it.
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
