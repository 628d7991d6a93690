// The high poly: on the host in the working frame, and on the device as its users need it.
#pragma once

#include <array>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "accel/closest.h"
#include "accel/raster.h"
#include "accel/ray.h"
#include "cl/context.h"
#include "kiln/bake.h"
#include "mesh/frame.h"
#include "mesh/low_surface.h"
#include "mesh/normals.h"

namespace kiln {

/// The high poly's attributes on the device. Both arrays end in one number more, for kernels that read four
/// at a time.
struct SourceAttributes {
  cl::Array<std::uint32_t> normal_indices;  ///< [3 * triangles + 1]
  cl::Array<float> normals;                 ///< [3 * pool + 1]

  SourceAttributes() = default;
  SourceAttributes(cl::Context& context, const CornerNormals& normals);
};

/// The internal name of what the caller wants.
Traversal traversal_of(RayTraversal wanted);

struct KILN_HIDDEN Source::Impl {
  Impl(const Device& opened, const Mesh& high, Traversal wanted,
       const std::optional<Bounds>& bounds = std::nullopt);
  /// Some triangles of another one, in its frame, to search in; without attributes. They are numbered by
  /// their places in the list.
  Impl(const Impl& whole, const std::vector<std::uint32_t>& some);

  Device device;
  Frame frame;
  Traversal traversal;
  std::vector<Vec3> positions;  ///< In the frame
  std::vector<Triangle> triangles;
  std::vector<Vec2> uvs;  ///< UVs of corners, where the mesh has any
  std::vector<Triangle> uv_triangles;
  std::uint32_t uv_set = 0;      ///< The file's number of `uvs`
  std::vector<UvSet> other_uvs;  ///< By the same uv_triangles
  SourceAttributes attributes;
  std::vector<std::array<std::uint8_t, 4>> colors;  ///< Colours of vertices, where the mesh has any
  /// Names of triangles, as Mesh has them: indices, or none, and what they stand for.
  struct Names {
    std::vector<std::uint32_t> of;
    std::vector<std::string> names;
  };
  Names materials, groups, objects;
  std::vector<Warning> warnings;

  /// Made when first asked for: what is not used costs nothing.
  RayCaster& rays() const;
  ClosestFinder& closest() const;
  Rasterizer& raster() const;
  /// facet_size(), frame units: of the mesh as it is when first asked for.
  double facets() const;

  /// LowSurface::of() in this one's frame. The last one is kept: of a mesh that differs from it in UVs and tangents
  /// alone, such as another texture set of the same low poly, only these are looked at. Others may have it, too: it is
  /// not to be changed. With a cage it is the caller's alone.
  std::shared_ptr<LowSurface> low_surface(const Mesh& low, const Mesh* cage, UvCopies copies) const;

  /// For whoever owns this one alone: takes over positions of vertices [first, first + count), and fits
  /// the hierarchy, where there is one, to them. The triangles with a moved corner are given.
  void move(std::uint32_t first, std::span<const Vec3> moved,
            std::span<const std::uint32_t> triangles_moved);
  /// Before anything is made: keep on the host what move() needs.
  bool will_move = false;

  Stats stats() const;
  /// Triangles that the hierarchy left out, since others are the same; 0 before there is one.
  std::uint64_t duplicates() const;

 private:
  const std::shared_ptr<Tree>& tree() const;  ///< The mutex is held

  mutable std::mutex mutex_;
  mutable std::shared_ptr<Tree> tree_;
  mutable std::unique_ptr<RayCaster> rays_;
  mutable std::unique_ptr<ClosestFinder> closest_;
  mutable std::unique_ptr<Rasterizer> raster_;
  mutable std::optional<double> facets_;
  struct LastLow {
    std::uint64_t shape = 0, layout = 0;  ///< Hashes: of all but UVs and tangents, and of these
    std::shared_ptr<LowSurface> surface;
  };
  mutable LastLow last_low_;
  mutable Stats stats_;
};

/// Access to the parts that Source hides from its users.
struct KILN_HIDDEN SourceAccess {
  static const Source::Impl& impl(const Source& source) { return *source.impl_; }
};

inline const Source::Impl& impl_of(const Source& source) { return SourceAccess::impl(source); }

}  // namespace kiln
