#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// A rectangle of texels of a map.
struct Rectangle {
  std::uint32_t x = 0;       ///< Column of its leftmost texels
  std::uint32_t y = 0;       ///< Row of its uppermost texels, from the top
  std::uint32_t width = 0;   ///< Width, texels
  std::uint32_t height = 0;  ///< Height, texels
  friend bool operator==(const Rectangle&, const Rectangle&) = default;
};

/// Settings of a session: bounds of the high poly's motion, and ray casting.
struct SessionOptions {
  /// The box within which the high poly moves. None given: the bounding box of the initial high poly. It
  /// defines the rounding of positions, and the diagonal of relative lengths. Positions may lie outside of
  /// the box by up to about its size.
  std::optional<Bounds> bounds = {};
  RayTraversal traversal = RayTraversal::automatic;  ///< Kernels for ray casting, see Source
};

/// A bake of a high poly that changes (Gumbau, Gonzalez, Chover 2006).
///
/// The samples of the low poly, their correspondences, the high poly and its BVH stay on the device. After a
/// change of positions or normals, only the results that depend on them are recomputed:
///   - MatchMethod::uv without a fallback: correspondences stay valid, since UVs do; only the texels whose
///     triangles' normals changed, and their padding, are baked again.
///   - Other matches: the BVH is refitted to the new positions (its topology stays), and all samples are
///     matched again. If only normals change, the correspondences stay valid.
/// The maps equal those of bake() with Source(device, high(), traversal, bounds()), to the bit.
///
/// Limits of MatchOptions::uv are checked at the first bake. Counts and distances in the report are those of
/// the last matching.
/// Memory: 69 bytes per sample on the device and 20 on the host, in addition to a bake's. Thread safety: one
/// thread at a time for each session; sessions of one Device may run in parallel. Lifetimes: it owns the
/// meshes (move them in) and holds the Device. MatchOptions::parts must outlive it. Tangents and welding as
/// bake(); positions that were equal at first stay welded only while they are equal.
class BakeSession {
 public:
  /// \param options  as for bake(), but `match.saved` and `progress` must be empty. Clusters of visibility,
  ///                 blending with a fallback and `report.errors` are refused
  /// \throws Error as bake(); Error(input) for a high poly with a corner that is not finite
  BakeSession(const Device& device, Mesh high, Mesh low, const BakeOptions& options = {},
              const SessionOptions& session = {});
  ~BakeSession();
  /// A session that was moved from may only be assigned to or destroyed
  BakeSession(BakeSession&&) noexcept;
  /// A session that was moved from may only be assigned to or destroyed
  BakeSession& operator=(BakeSession&&) noexcept;

  /// Changes positions of the high poly's vertices [first, first + count), in the mesh's units. If the
  /// mesh has no normals of its own, normals around them are recomputed. The span is not kept.
  /// \throws Error(usage) for a range beyond the mesh's vertices, or a position that is not finite or
  ///         too far outside of the bounds; the session is unchanged then
  void set_positions(std::uint32_t first, std::span<const Vec3> positions);

  /// Changes entries [first, first + count) of the high poly's pool of normals; each of any length above
  /// 0. The span is not kept.
  /// \throws Error(usage) for a range beyond the pool (a mesh without normals has none), or a normal
  ///         without direction; the session is unchanged then
  void set_normals(std::uint32_t first, std::span<const Vec3> normals);

  /// Bakes everything that is out of date. No callback is called. \returns all maps; valid until the next bake()
  /// \throws Error as bake(), Error(cancelled) if a ProgressScope cancels. The next bake() then recomputes
  ///         everything
  const BakeResult& bake();

  /// What the last bake() did.
  struct Update {
    /// Number of triangles of the high poly with changed corners or normals
    std::uint64_t triangles = 0;
    std::uint64_t texels = 0;  ///< Number of texels that were baked again
    bool matched = false;      ///< True if the samples were matched again
    /// Rectangle around all texels that changed since the previous bake. Its area is 0 if nothing
    /// changed.
    Rectangle dirty = {};
    double seconds_source = 0;  ///< Duration of computing normals, refitting the BVH, and uploading
    double seconds_match = 0;   ///< Duration of matching, fallbacks included
    double seconds_detail = 0;  ///< Duration of computing the maps' values at the matched points
    double seconds_image = 0;   ///< Duration of padding and encoding
    /// Sum of all steps.
    double seconds() const {
      return seconds_source + seconds_match + seconds_detail + seconds_image;
    }
  };
  const Update& last_update() const;  ///< The last update; all zero before the first bake()

  const Mesh& high() const;      ///< The high poly, with its current positions and normals
  const Bounds& bounds() const;  ///< SessionOptions::bounds, or the box of the initial high poly
  /// Warnings of the initial high poly, see Source::warnings(). Valid until the next bake()
  const std::vector<Warning>& warnings() const;

 private:
  struct KILN_OPAQUE Impl;
  Impl* impl_;
};

/// Matching by depth views one view at a time, as in an interactive session (Wang et al., section 2): each
/// view improves the current correspondence, and none is rendered twice. The match equals that of bake()
/// with the same directions in the same order, to the bit.
/// Thread safety: one thread at a time for each session; sessions of one Source may run in parallel.
/// Lifetimes: it holds the Source and a copy of the low poly. The progress callback is not called.
class ViewSession {
 public:
  /// \param options  these members are used: width, height, samples, `match.max_distance`,
  ///                 `match.two_sided`, and the views' size, criterion and refine. Maps, methods,
  ///                 fallback and directions are ignored
  /// \throws Error as bake()
  ViewSession(const Source& source, const Mesh& low, const BakeOptions& options = {});
  ~ViewSession();
  /// A session that was moved from may only be assigned to or destroyed
  ViewSession(ViewSession&&) noexcept;
  /// A session that was moved from may only be assigned to or destroyed
  ViewSession& operator=(ViewSession&&) noexcept;

  /// Effect of one view.
  struct Step {
    std::uint64_t samples = 0;  ///< Number of samples of the low poly
    std::uint64_t decided = 0;  ///< Number of samples for which any view has found a point so far
    /// Number of samples for which this view found the first point, or a better one
    std::uint64_t changed = 0;
  };
  /// Adds a view.
  /// \param toward  direction from the mesh to the viewer, of any length above 0
  /// \throws Error(usage) for an invalid direction; Error(cancelled) if a ProgressScope cancels: the view was then
  ///         applied to only some samples, and adding it again completes it
  Step add(const Vec3& toward);

  /// Copies the current correspondences, for bake(), save_match() or measurements.
  Match match() const;

 private:
  struct KILN_OPAQUE Impl;
  Impl* impl_;
};

}  // namespace kiln
