#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

struct KILN_OPAQUE SourceAccess;

/// Which ray kernels run: explicit vectors for CPU devices, one ray a work-item for GPUs, or by the
/// device's type.
enum class RayTraversal { automatic, cpu, gpu };

/// A box that a mesh's positions lie in, in its own units (its origin left out).
struct Bounds {
  std::array<double, 3> low{};   ///< Its least corner
  std::array<double, 3> high{};  ///< Its greatest corner
  /// Bounds of the finite triangles that have an area: other vertices stretch nothing. Any thread may call it.
  /// \throws Error(input) where there are none, or what validate() names
  static Bounds of(const Mesh& mesh);
};

/// The high poly on the device: triangles, hierarchy, normals. Built once, baked from many times,
/// immutable. Cheap to copy (shared). Structures that only some matches need are made by the first
/// thread that needs one; others wait for it. Such is the BVH, which rays and nearest points walk.
///
/// Thread safety: any number of threads may bake from one Source, or copies of it, at the same time. Maps
/// are the same bytes as one after another.
/// Lifetimes: it copies what it needs of the mesh and holds the Device; both may go.
/// Welding: vertices of exactly equal positions count as one where it computes normals, smooth ones: see Mesh, shade_high().
/// Mesh::tangents of the high poly are not read: for its normal textures MikkTSpace computes them.
class Source {
 public:
  /// \param traversal  which ray kernels to use; all give the same answer to the bit
  /// \param bounds  the box that takes the place of the mesh's own: "the diagonal" is then its diagonal,
  ///                and meshes that move within it are rounded alike. About the mesh's own size
  /// \throws Error(input) where no triangle is usable, Error(usage) for a box without size or one that the mesh lies
  ///         far out of, Error(device) where memory runs out
  /// Thread safety: may be called from several threads, also with one Device.
  explicit Source(const Device& device, const Mesh& high,
                  RayTraversal traversal = RayTraversal::automatic,
                  const std::optional<Bounds>& bounds = std::nullopt);

  /// The same with signs of life, and with the hierarchy made now and not at its first use: worth it for
  /// millions of triangles.
  /// \param progress  comes on this thread, ten times a second; see Progress. Empty: none
  /// \returns nothing where the callback said stop, within 0.3 s
  /// \throws as the constructor, and what the callback throws
  static std::optional<Source> build(const Device& device, const Mesh& high,
                                     const Progress& progress,
                                     RayTraversal traversal = RayTraversal::automatic,
                                     const std::optional<Bounds>& bounds = std::nullopt);

  /// Sizes of a source.
  struct Stats {
    std::uint64_t triangles = 0;          ///< Triangles of the mesh
    std::uint64_t skipped_triangles = 0;  ///< Non-finite or without area
    std::uint64_t device_bytes = 0;       ///< Memory on the device
    double build_seconds = 0;             ///< Hierarchy and other structures made so far
    /// Diagonal of Bounds::of(), without vertices over 100,000 times farther out than most; or of the box given, world units
    double diagonal = 0;
  };
  Stats stats() const;  ///< As of now: structures are made when they are needed
  /// Warnings of imperfect data that was handled. Good as long as any copy of this Source.
  const std::vector<Warning>& warnings() const;

  /// \cond The library's own.
  struct KILN_OPAQUE Impl;
  /// \endcond

 private:
  friend SourceAccess;  // the library's own parts
  std::shared_ptr<const Impl> impl_;
};

}  // namespace kiln
