#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Texels of a map.
struct Rectangle {
  std::uint32_t x = 0;       ///< First column
  std::uint32_t y = 0;       ///< First row, from the top
  std::uint32_t width = 0;   ///< Columns
  std::uint32_t height = 0;  ///< Rows
  friend bool operator==(const Rectangle&, const Rectangle&) = default;
};

/// Settings of a session: space for the high poly to move in, and ray casting.
struct SessionOptions {
  /// The box that the high poly moves in. None given: its own at first. Decides rounding and what a share
  /// of the diagonal is; positions may leave it, but not by more than about its size.
  std::optional<Bounds> bounds = {};
  RayTraversal traversal = RayTraversal::automatic;  ///< As for Source
};

/// A bake of a high poly that changes (Gumbau, Gonzalez, Chover 2006).
///
/// Everything stays on the device: samples of the low poly, their correspondences, the high poly, its
/// hierarchy. After positions or normals change, only what depends on them is done again:
///   - MatchMethod::uv without a fallback: correspondences stay, since UVs do; the texels whose triangles'
///     normals changed are read anew, and their gutter.
///   - Other matches: the hierarchy's boxes are fitted to the new positions (its topology stays); all
///     samples are matched anew. Where only normals change, the correspondences stay, as above.
/// The maps are, to the bit, what bake() makes of Source(device, high(), traversal, bounds()).
///
/// Conditions of MatchOptions::uv are checked at the first bake. Counts and distances in the report are of
/// the last time that samples were matched.
/// Memory: 69 bytes a sample on the device and 20 on the host, beside what a bake needs.
/// Thread safety: one thread at a time for each session; sessions of one Device may run beside each other.
/// Lifetimes: the meshes are its own (move them in) and it holds the Device. Parts of the options must outlive
/// it. Tangents and welding as bake(); positions that were equal at first stay welded only while they are.
class BakeSession {
 public:
  /// \param options  as for bake(), but `match.saved` and `progress` must be empty. Clusters of visibility,
  ///                 blending with a fallback and `report.errors` are refused
  /// \throws Error as bake(); Error(input) for a high poly with a corner that is not finite
  BakeSession(const Device& device, Mesh high, Mesh low, const BakeOptions& options = {},
              const SessionOptions& session = {});
  ~BakeSession();
  BakeSession(BakeSession&&) noexcept;  ///< The other may then only be assigned to or destroyed
  BakeSession& operator=(BakeSession&&) noexcept;  ///< As the constructor

  /// Changes positions of the high poly's vertices [first, first + count), in its units. Where the mesh
  /// has no normals of its own, those around them follow. The span is not kept.
  /// \throws Error(usage) for a range beyond the mesh's, a position that is not finite or too far out of
  ///         the bounds; nothing is changed then
  void set_positions(std::uint32_t first, std::span<const Vec3> positions);

  /// Changes entries [first, first + count) of the high poly's pool of normals; of any length above 0. The
  /// span is not kept.
  /// \throws Error(usage) for a range beyond the pool (a mesh without normals has none), or a normal
  ///         without direction; nothing is changed then
  void set_normals(std::uint32_t first, std::span<const Vec3> normals);

  /// Bakes what is not up to date. No callback comes. \returns all maps; good until the next bake()
  /// \throws Error as bake(), Error(cancelled) where a ProgressScope says stop. The next bake() makes all anew then
  const BakeResult& bake();

  /// Work of the last bake().
  struct Update {
    std::uint64_t triangles =
        0;                     ///< Triangles of the high poly whose corners or normals had changed
    std::uint64_t texels = 0;  ///< Read anew
    bool matched = false;      ///< Samples were matched
    /// Rectangle of all texels that changed: nothing outside is another byte than
    /// after the bake before. Without area where nothing changed.
    Rectangle dirty = {};
    double seconds_source = 0;  ///< Normals, hierarchy, upload
    double seconds_match = 0;   ///< The match and its fallbacks
    double seconds_detail = 0;  ///< Reading of the maps' values
    double seconds_image = 0;   ///< Padding and encoding
    /// Time of all steps.
    double seconds() const {
      return seconds_source + seconds_match + seconds_detail + seconds_image;
    }
  };
  const Update& last_update() const;  ///< Empty before the first bake()

  const Mesh& high() const;      ///< As it is now
  const Bounds& bounds() const;  ///< SessionOptions::bounds, or what was taken
  /// Warnings of the high poly as it was given, see Source::warnings(). Good until the next bake()
  const std::vector<Warning>& warnings() const;

 private:
  struct KILN_OPAQUE Impl;
  Impl* impl_;
};

/// Matching by depth views one view at a time, as in an interactive session (Wang et al., section 2): each
/// view improves the correspondence that is there, and none is drawn twice. After any views the match is,
/// to the bit, what bake() finds with the same directions in the same order.
/// Thread safety: one thread at a time for each session; sessions of one Source may run beside each other.
/// Lifetimes: it holds the Source and a copy of the low poly. The progress callback is not called.
class ViewSession {
 public:
  /// \param options  size, samples, max_distance, two_sided and of the views size (0: by the mesh's
  ///                 density), criterion and refine count; maps, methods, fallback and directions do not
  /// \throws Error as bake()
  ViewSession(const Source& source, const Mesh& low, const BakeOptions& options = {});
  ~ViewSession();
  ViewSession(ViewSession&&) noexcept;  ///< The other may then only be assigned to or destroyed
  ViewSession& operator=(ViewSession&&) noexcept;  ///< As the constructor

  /// Gain by one view.
  struct Step {
    std::uint64_t samples = 0;  ///< Samples of the low poly
    std::uint64_t decided = 0;  ///< By any view so far
    std::uint64_t changed = 0;  ///< That this view newly decided, or decided better
  };
  /// Adds a view. \param toward  from the mesh to the viewer, of any length above 0
  /// \throws Error(usage) for another direction; Error(cancelled) where a ProgressScope says stop: then some samples
  ///         have seen the view, and adding it again shows it to the others
  Step add(const Vec3& toward);

  /// The correspondence so far, for bake(), save_match() or measuring: the caller's own.
  Match match() const;

 private:
  struct KILN_OPAQUE Impl;
  Impl* impl_;
};

}  // namespace kiln
