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
  std::uint32_t x = 0;       ///< First column
  std::uint32_t y = 0;       ///< First row, from the top
  std::uint32_t width = 0;   ///< Columns
  std::uint32_t height = 0;  ///< Rows
  friend bool operator==(const Rectangle&, const Rectangle&) = default;
};

/// Settings of a session: bounds of the high poly's motion, and ray casting.
struct SessionOptions {
  /// The box within which the high poly moves. None given: its own at the start. It defines rounding and
  /// the diagonal of relative lengths; positions may leave it by up to about its size.
  std::optional<Bounds> bounds = {};
  RayTraversal traversal = RayTraversal::automatic;  ///< As for Source
};

/// A bake of a high poly that changes (Gumbau, Gonzalez, Chover 2006).
///
/// Everything stays on the device: samples of the low poly, their correspondences, the high poly, its
/// hierarchy. After positions or normals change, only dependent results are recomputed:
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
  BakeSession(BakeSession&&) noexcept;  ///< The source may then only be assigned to or destroyed
  BakeSession& operator=(BakeSession&&) noexcept;  ///< The source may then only be assigned to or
                                                   ///< destroyed

  /// Changes positions of the high poly's vertices [first, first + count), in its units. If the mesh has
  /// no normals of its own, normals around them are recomputed. The span is not kept.
  /// \throws Error(usage) for a range beyond the mesh's, a position that is not finite or too far out of
  ///         the bounds; the session is unchanged then
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

  /// Work of the last bake().
  struct Update {
    std::uint64_t triangles = 0;  ///< Triangles of the high poly with changed corners or normals
    std::uint64_t texels = 0;     ///< Texels that were baked again
    bool matched = false;         ///< Samples were matched again
    /// Rectangle around all texels that changed since the bake before. Without area if nothing
    /// changed.
    Rectangle dirty = {};
    double seconds_source = 0;  ///< Normals, BVH, upload
    double seconds_match = 0;   ///< The match and its fallbacks
    double seconds_detail = 0;  ///< Reading of the maps' values
    double seconds_image = 0;   ///< Padding and encoding
    /// Sum of all steps.
    double seconds() const {
      return seconds_source + seconds_match + seconds_detail + seconds_image;
    }
  };
  const Update& last_update() const;  ///< Empty before the first bake()

  const Mesh& high() const;      ///< Current positions and normals
  const Bounds& bounds() const;  ///< SessionOptions::bounds, or the derived box
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
  /// \param options  uses size, samples, max_distance, two_sided and, of the views, size (0: by the
  ///                 mesh's density), criterion and refine; maps, methods, fallback and directions are
  ///                 ignored
  /// \throws Error as bake()
  ViewSession(const Source& source, const Mesh& low, const BakeOptions& options = {});
  ~ViewSession();
  ViewSession(ViewSession&&) noexcept;  ///< The source may then only be assigned to or destroyed
  ViewSession& operator=(ViewSession&&) noexcept;  ///< The source may then only be assigned to or
                                                   ///< destroyed

  /// Effect of one view.
  struct Step {
    std::uint64_t samples = 0;  ///< Samples of the low poly
    std::uint64_t decided = 0;  ///< Samples that any view has decided so far
    std::uint64_t changed = 0;  ///< Samples that this view decided for the first time, or better
  };
  /// Adds a view. \param toward  from the mesh to the viewer, of any length above 0
  /// \throws Error(usage) for an invalid direction; Error(cancelled) if a ProgressScope cancels: the view was then
  ///         applied to some samples, and adding it again completes it
  Step add(const Vec3& toward);

  /// Copies the current correspondence, for bake(), save_match() or measuring.
  Match match() const;

 private:
  struct KILN_OPAQUE Impl;
  Impl* impl_;
};

}  // namespace kiln
