// Visibility directions: the mean of the directions from which each point of the low poly is seen, past
// the mesh itself (Tarini, Cignoni, Scopigno, "Visibility Based Methods and Assessment for
// Detail-Recovery", 2003, section 3.3).
//
// The equations follow the paper's description in words. d is a direction of likelihood w, c(d) the number
// of pixels, or the cosine, with which d sees a point, V the set of directions that see the point:
//   face    v_f = sum over V of w c_f(d) d / sum of w c_f(d); a vertex takes the mean of its faces' v_f,
//           weighted by their angles there
//   vertex  v_v = the same over the pixels of its faces, each by its barycentric weight; not over
//           directions that see the vertex itself, which is mostly hidden at a fold although its faces are
//           not
//   texel   v_t = the same over its own lookups or rays; sums and weights are smoothed, then divided
// The standard deviation of V is sqrt(1 - |v|^2), since the directions are unit.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "accel/device_bvh.h"
#include "base/progress_guard.h"
#include "cl/context.h"
#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {

struct ClusteredTexel;

/// A direction from which the mesh may be seen.
struct ProbeDirection {
  Vec3d toward{};    ///< Unit, from the mesh to the viewer
  float weight = 1;  ///< Likelihood that a viewer looks from this direction
};

/// Called with the completed share; returns false to cancel. May be empty.
using ShareCallback = std::function<bool(double)>;

/// Returns the directions from which the options let the probe look, without those of weight 0. \throws
/// Error(usage)
std::vector<ProbeDirection> probe_directions(const VisibilityOptions& options);

/// Checks options that are independent of the mesh. \throws Error(usage)
void check_visibility(const VisibilityOptions& options);

/// Sums the directions that see points of a mesh.
///
/// Each direction is weighted by its likelihood times its cosine to the point's face. Directions are
/// added in their order, so that sums do not depend on threads.
class VisibilityProbe {
 public:
  /// \param surface    in frame units; may be far smaller or larger than the high poly
  /// \param traversal  selects the ray kernels, and whether the kernels of depth views are vectorised
  VisibilityProbe(cl::Context& context, const LowSurface& surface,
                  std::vector<ProbeDirection> directions, std::uint32_t view_size,
                  Traversal traversal = Traversal::automatic);
  ~VisibilityProbe();
  VisibilityProbe(VisibilityProbe&&) noexcept;

  /// Points, the normals of their faces, and the sums of directions and weights, on the device.
  struct ProbedPoints {
    std::uint32_t count = 0;
    std::uint32_t capacity = 0;  ///< Number of elements in one plane, a multiple of 64
    /// Six arrays, one per component: position in the probe's scale, unit normal of the face
    cl::Array<float> points;
    /// Four arrays, one after the other: weighted sum of directions (x, y, z), sum of weights
    cl::Array<float> sums;
    cl::Array<std::int32_t>
        /// The set of directions that see each point, one bit per direction: an array of 32-bit
        /// words for every 32 directions; empty unless requested
        seen;
  };

  /// Converts a band's samples to probed points, with the normals of their triangles.
  ProbedPoints make_points(const TexelBand& band) const;
  /// Makes probed points at arbitrary positions. \param positions,normals in the surface's frame
  ProbedPoints make_points(std::span<const Vec3> positions, std::span<const Vec3> normals) const;

  /// Sets a callback that is called several times a second by the functions below, which throw
  /// Cancelled if it returns false.
  void set_progress(ShareCallback report_share);

  /// Allocates ProbedPoints::seen.
  void allocate_seen(ProbedPoints& probed) const;

  /// Adds each direction to the sums of the points that it sees, as tested by depth views or by rays.
  void add_directions_by_views(ProbedPoints& probed);
  void add_directions_by_rays(ProbedPoints& probed);

  /// Sums per triangle corner from pictures whose pixels identify triangles: x y z of the sum of
  /// directions and the sum of weights. Each visible pixel is distributed to the corners by its
  /// barycentric weights. [12 * triangles]
  std::vector<float> corners();

  const std::vector<ProbeDirection>& directions() const;

  /// Unit normals of the surface's triangles, [3 * triangles], on the device.
  const cl::Array<float>& normals() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Visibility directions of all texels of a map.
class VisibilityField {
 public:
  /// \param width,height  of the map; a field of texels has at most 2048 a side, and is upsampled for
  ///                      larger maps
  /// \throws Cancelled
  VisibilityField(cl::Context& context, const LowSurface& surface, std::uint32_t width,
                  std::uint32_t height, const VisibilityOptions& options, Traversal traversal,
                  VisibilityReport& report, ShareCallback report_share = {});

  /// Copies a band's samples with their visibility directions, at a cosine of at least
  /// KILN_VISIBILITY_LEAST_RISE to their faces. Samples without a visibility direction keep their own
  /// direction.
  ///
  /// The hybrid (section 3.4) is (1 - s) v + s n, normalised: v the unit visibility direction, n the
  /// band's normal, s the standard deviation sqrt(1 - |mean|^2) of the directions that see the place
  /// (equation 3). On an unoccluded plane s is 0.745, since the mean has length 2/3.
  /// \param cluster  index of the cluster of directions
  /// \param samples  N of the map's N x N
  /// \param directed  7 planes of `capacity`
  void write_directed_samples(const TexelBand& band, std::uint32_t samples, bool hybrid,
                              const cl::Array<float>& directed, std::uint32_t capacity,
                              std::uint32_t cluster = 0) const;

  /// Writes the mean of the directions that see each of a band's samples, from which direct()
  /// derives its directions.
  /// \param seen  3 planes of `capacity`
  void means(const TexelBand& band, std::uint32_t samples, const cl::Array<float>& seen,
             std::uint32_t capacity, std::uint32_t cluster = 0) const;

  /// The clusters; nullopt if only one was requested.
  const std::optional<VisibilityClusters>& clusters() const { return clusters_; }

  /// True if the field has directions per texel, which are interpolated; false if it has them per
  /// corner.
  bool is_of_texels() const { return field_width_ != 0; }

  /// Mean of the directions for each texel (or corner), 4 floats each. For tests.
  const cl::Array<float>& field() const { return field_; }
  std::uint32_t field_width() const { return field_width_; }
  std::uint32_t field_height() const { return field_height_; }

 private:
  void make_texels(const LowSurface& surface, VisibilityProbe& probe,
                   const VisibilityOptions& options, VisibilityReport& report);
  void store_clusters(const std::vector<ClusteredTexel>& parted, std::uint32_t count,
                      std::vector<std::array<float, 4>>& means);
  void make_corners(const LowSurface& surface, VisibilityProbe& probe,
                    const VisibilityOptions& options, VisibilityReport& report);
  kiln_visibility_band band_params(const TexelBand& band, std::uint32_t samples,
                                   std::uint32_t capacity) const;

  cl::Context& context_;
  std::uint32_t width_, height_;
  // Sides of the field in texels; 0 if directions are per corner
  std::uint32_t field_width_ = 0, field_height_ = 0;
  cl::Array<float> normals_;
  cl::Array<float> field_;
  std::vector<cl::Array<float>> other_clusters_;  // The fields of the clusters from index 1 on
  std::optional<VisibilityClusters> clusters_;
  cl::Array<std::uint32_t> field_triangle_;
  cl::Array<std::uint32_t> texel_charts_;
  cl::Array<std::uint32_t>
      chart_borders_;  // For each pixel of the field, its index in cluster_links_
  cl::Array<std::uint32_t> cluster_links_;
};

}  // namespace kiln
