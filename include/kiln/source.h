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

/// Variants of the ray kernels: explicit vectors for CPU devices, one ray per work-item for GPUs,
/// or chosen by the device's type.
enum class RayTraversal { automatic, cpu, gpu };

/// Axis-aligned bounding box of a mesh's positions, in the mesh's units, relative to Mesh::origin.
struct Bounds {
  std::array<double, 3> low{};   ///< Minimum corner
  std::array<double, 3> high{};  ///< Maximum corner
  /// Bounds of the finite triangles with an area; other vertices are ignored. Any thread may call it.
  /// \throws Error(input) if there are none, or as validate()
  static Bounds of(const Mesh& mesh);
};

/// The high poly on the device: triangles, BVH, normals. Built once, used by any number of bakes, immutable. Copies
/// share the data and are cheap. Structures that only some matches need, such as the BVH for rays and nearest points,
/// are built by the first thread that needs one; others wait for it.
///
/// Thread safety: any number of threads may bake from one Source, or copies of it, at the same time. Maps are the same
/// bytes as in sequential bakes.
/// Lifetimes: it copies the needed data of the mesh and holds the Device; both may be destroyed. Welding: vertices of
/// exactly equal positions count as one where smooth normals are computed; see Mesh and shade_high(). Mesh::tangents
/// of the high poly are not read; its normal textures use tangents that MikkTSpace computes.
class Source {
 public:
  /// \param traversal  which ray kernels to use; all give the same results to the bit
  /// \param bounds  replaces the mesh's own bounding box: it defines the diagonal, and the rounding of positions, so
  ///                that a mesh that moves within it is always rounded alike. It should be about as large as
  ///                the mesh
  /// \throws Error(input) if no triangle is usable, Error(usage) for a box without size or far from the mesh,
  ///         Error(device) if memory runs out
  /// Thread safety: may be called from several threads, also with one Device.
  explicit Source(const Device& device, const Mesh& high,
                  RayTraversal traversal = RayTraversal::automatic,
                  const std::optional<Bounds>& bounds = std::nullopt);

  /// Like the constructor, with progress, and with the BVH built now instead of at its first use:
  /// worthwhile for millions of triangles.
  /// \param progress  called on this thread, ten times a second; see Progress. Empty: none
  /// \returns nothing if the callback cancels, within 0.3 s
  /// \throws as the constructor; exceptions of the callback
  static std::optional<Source> build(const Device& device, const Mesh& high,
                                     const Progress& progress,
                                     RayTraversal traversal = RayTraversal::automatic,
                                     const std::optional<Bounds>& bounds = std::nullopt);

  /// Sizes of a source.
  struct Stats {
    std::uint64_t triangles = 0;          ///< Number of triangles of the mesh
    std::uint64_t skipped_triangles = 0;  ///< Triangles that are not finite or have no area
    std::uint64_t device_bytes = 0;       ///< Memory on the device
    double build_seconds = 0;  ///< Seconds spent so far on building the BVH and other structures
    /// Diagonal of the given box, or of Bounds::of() without vertices that are over 100,000 times farther out than
    /// most; world units
    double diagonal = 0;
  };
  Stats stats() const;  ///< Current sizes, which grow as structures are built
  /// Warnings of imperfect data that was handled. Valid as long as any copy of this Source.
  const std::vector<Warning>& warnings() const;

  /// \cond Internal.
  struct KILN_OPAQUE Impl;
  /// \endcond

 private:
  friend SourceAccess;  // internal access
  explicit Source(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
  std::shared_ptr<const Impl> impl_;
};

}  // namespace kiln
