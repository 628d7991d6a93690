// The high poly: on the host in the working frame, and on the device in structures that are built on demand.
#pragma once

#include <array>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "accel/closest.h"
#include "accel/raster.h"
#include "accel/ray.h"
#include "cl/context.h"
#include "mesh/frame.h"
#include "mesh/low_surface.h"
#include "mesh/normals.h"
#include "mesh/triangle_blocks.h"
#include "source/chunked_search.h"
#include "source/chunked_views.h"
#include "source/saved_tree.h"

namespace kiln {

/// The high poly's attributes on the device. Both arrays have one extra element, for kernels that load four at a
/// time.
struct SourceAttributes {
  cl::Array<std::uint32_t> normal_indices;  ///< Normal of each corner, [3 * triangles + 1]
  cl::Array<float> normals;                 ///< Pool of normals, [3 * normals + 1]

  SourceAttributes() = default;
  SourceAttributes(cl::Context& context, const CornerNormals& normals);
};

/// Converts the public enumeration to the internal one.
Traversal traversal_of(RayTraversal wanted);

struct KILN_HIDDEN Source::Impl {
  Impl(const Device& opened, const Mesh& high, Traversal wanted,
       const std::optional<Bounds>& bounds = std::nullopt);
  /// A source for searches with a subset of another source's triangles, in the same frame and without attributes.
  /// Triangles are numbered by their index in the list.
  Impl(const Impl& whole, const std::vector<std::uint32_t>& some);

  /// A high poly that is larger than memory. It is searched chunk by chunk. `triangles` holds a single triangle that
  /// spans the mesh's box, from which maps derive their value ranges. Maps read matched_part(), which has the triangles
  /// that they need.
  Impl(const Device& opened, std::shared_ptr<const ChunkedMesh> mesh, Traversal wanted);
  /// A source of the same high poly from which maps read. It holds a single triangle until read_matched() is called.
  std::unique_ptr<Impl> matched_part() const;
  /// Called on matched_part(): replaces its triangles by those that samples matched, and changes the match to their new
  /// indices. \param match  on entry, refers to triangles of the whole mesh
  void read_matched(DeviceCorrespondence& match);
  /// True if the high poly is larger than memory.
  bool is_streamed() const { return chunks_ != nullptr; }

  Device device;
  Frame frame;
  Traversal traversal;
  std::vector<Vec3> positions;  ///< Positions in the working frame
  std::vector<Triangle> triangles;
  std::vector<Vec2> uvs;  ///< UVs of corners; may be empty
  std::vector<Triangle> uv_triangles;
  std::uint32_t uv_set = 0;      ///< Index in the file of the UV set `uvs`
  std::vector<UvSet> other_uvs;  ///< Other UV sets, indexed by the same uv_triangles
  SourceAttributes attributes;
  std::vector<std::array<std::uint8_t, 4>> colors;  ///< Colours of vertices; may be empty
  /// Names of triangles as in Mesh: a list of names, and for each triangle an index in it. The list of indices may
  /// be empty.
  struct Names {
    std::vector<std::uint32_t> of;
    std::vector<std::string> names;
  };
  Names materials, groups, objects;
  std::vector<Warning> warnings;

  /// Searches for matches.
  const RaySearch& ray_search() const;
  const ClosestSearch& closest_search() const;
  /// Searches all of the high poly; on a matched_part(), too, where ray_search() only searches the matched triangles.
  const RaySearch& occluder_search() const;
  /// The surface that depth views of all of the high poly show.
  ViewedSurface& viewed_surface() const;
  /// All triangles of the high poly, and the positions of all of its vertices.
  TriangleBlocks triangle_blocks() const;
  /// Corners of some triangles in the frame; those of KILN_NO_TRIANGLE are undefined.
  std::vector<std::array<Vec3, 3>> corners_of(std::span<const std::uint32_t> some) const;
  /// BVH and other structures for searches, each built at its first use. \throws Error(internal) if the high poly
  /// is_streamed()
  RayCaster& rays() const;
  ClosestFinder& closest() const;
  Rasterizer& raster() const;
  /// facet_size() in frame units, computed at the first call.
  double facets() const;
  /// Cached values that depend only on positions and triangles. move() replaces them.
  std::shared_ptr<LazyValue> by_positions() const;

  /// LowSurface::of() in this source's frame. The last surface is cached: if a mesh differs from it only in UVs and
  /// tangents, as another texture set of the same low poly does, only UVs and tangents are processed. The result may
  /// be shared and must not be changed. Surfaces with a cage are not cached.
  std::shared_ptr<LowSurface> low_surface(const Mesh& low, const Mesh* cage, UvCopies copies) const;
  /// A low poly whose UV layouts are known to be valid, so that low_surface() neither checks nor hashes them; set by
  /// SetLayouts.
  struct KnownLow {
    /// The mesh's address, which identifies it; null if no low poly is known
    const Mesh* mesh = nullptr;
    /// Hashes as in LastLow; `layout` is a unique number of the layout instead of a hash
    std::uint64_t shape = 0, layout = 0;
    std::vector<std::uint32_t> with_uvs;  ///< find_with_uvs()
  };
  void set_known_low(KnownLow known) const;
  /// Hash of everything except UVs and tangents.
  static std::uint64_t shape_hash(const Mesh& low);

  /// Sets the positions of vertices [first, first + count) and refits the BVH, if built. Requires exclusive ownership.
  /// The arguments include the triangles with a moved corner.
  void move(std::uint32_t first, std::span<const Vec3> moved,
            std::span<const std::uint32_t> triangles_moved);
  /// True if the data that move() needs stays in the host's memory; must be set before structures are built.
  bool will_move = false;

  /// Provides a tree of an earlier run. It is read instead of building a tree, if it was built from the same triangles.
  void offer_tree(std::shared_ptr<const SavedTree> tree) const;
  /// Writes the tree, and builds it first if it does not exist yet.
  void save_tree(const AppendBytes& append) const;

  Stats stats() const;
  /// Number of duplicate triangles that the BVH leaves out; 0 before it is built.
  std::uint64_t duplicates() const;

 private:
  const std::shared_ptr<Tree>& tree() const;  ///< The caller must hold the mutex

  void check_in_core() const;

  /// Chunks of a mesh that is larger than memory; null if the whole mesh is in memory
  std::shared_ptr<const LoadedChunks> chunks_;
  std::unique_ptr<RaySearch> chunked_rays_;
  std::unique_ptr<RaySearch> chunked_occluders_;  // Of a matched_part()
  std::unique_ptr<ClosestSearch> chunked_closest_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<Tree> tree_;
  mutable std::shared_ptr<const SavedTree> saved_tree_;
  mutable std::unique_ptr<RayCaster> rays_;
  mutable std::unique_ptr<ClosestFinder> closest_;
  mutable std::unique_ptr<Rasterizer> raster_;
  mutable std::unique_ptr<ChunkedViews> chunked_views_;
  mutable std::optional<double> facet_size_;
  std::shared_ptr<LazyValue> by_positions_ = std::make_shared<LazyValue>();
  struct LastLow {
    /// Hash of everything except UVs and tangents; hash of UVs and tangents
    std::uint64_t shape = 0, layout = 0;
    std::shared_ptr<LowSurface> surface;
  };
  mutable LastLow last_low_;
  mutable KnownLow known_low_;
  mutable Stats stats_;
};

/// Access to the internals of Source.
struct KILN_HIDDEN SourceAccess {
  static const Source::Impl& impl(const Source& source) { return *source.impl_; }
  static Source make(std::shared_ptr<const Source::Impl> impl) { return Source(std::move(impl)); }
};

/// Constructs a source of a high poly that is larger than memory; see Source::Impl.
Source streamed_source(const Device& device, std::shared_ptr<const ChunkedMesh> mesh,
                       RayTraversal traversal = RayTraversal::automatic);

inline const Source::Impl& impl_of(const Source& source) { return SourceAccess::impl(source); }

}  // namespace kiln
