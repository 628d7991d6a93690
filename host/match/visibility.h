// From where each place of the low poly is seen, past the mesh itself (Tarini, Cignoni, Scopigno,
// "Visibility Based Methods and Assessment for Detail-Recovery", 2003, section 3.3).
//
// The forms used here follow the method's description, and were not checked against the equations as
// printed. d is a direction of likelihood w, c(d) the pixels or cosines by which a place is seen. V are the
// directions that see it:
//   face    v_f = sum over V of w c_f(d) d / sum of w c_f(d); a vertex takes the mean of its faces' v_f,
//           weighted by their angles there
//   vertex  v_v = the same over the pixels of its faces, each by its barycentric weight. Not over what sees
//           the vertex itself: where faces meet at a fold, most of it is hidden though they are not
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
#include "kiln/bake.h"
#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"
#include "mesh/vector.h"
#include "texel/texels.h"

namespace kiln {

struct PartedTexel;

/// A direction that the mesh may be seen from.
struct ProbeDirection {
  Vec3d toward;      ///< Unit, from the mesh to the viewer
  float weight = 1;  ///< Likelihood of the view
};

/// Called with the share done; false: stop. May be empty.
using KeepOn = std::function<bool(double)>;

/// The directions that the options ask for, those without weight left out. \throws Error(usage)
std::vector<ProbeDirection> probe_directions(const VisibilityOptions& options);

/// Checks what needs no mesh. \throws Error(usage)
void check_visibility(const VisibilityOptions& options);

/// Adds up the directions that see places of a mesh.
///
/// Each direction counts with its weight times the cosine at which it sees the place's face. Directions
/// are added in their order, whichever test is used, so the sums do not depend on threads.
class VisibilityProbe {
 public:
  /// \param surface    in the frame, of any size
  /// \param traversal  of rays; also chooses vectors or single samples for pictures
  VisibilityProbe(cl::Context& context, const LowSurface& surface,
                  std::vector<ProbeDirection> directions, std::uint32_t view_size,
                  Traversal traversal = Traversal::automatic);
  ~VisibilityProbe();
  VisibilityProbe(VisibilityProbe&&) noexcept;

  /// Places and the normals of their faces, and sums of directions and weights, on the device.
  struct Places {
    std::uint32_t count = 0;
    std::uint32_t capacity = 0;  ///< A multiple of 64: elements of one plane
    cl::Array<float> points;  ///< 6 planes: position in the probe's scale, unit normal of the face
    cl::Array<float> sums;    ///< 4 planes: weighted sum of directions x y z, sum of weights
    cl::Array<std::int32_t>
        seen;  ///< Set where asked for, planes of 32 bits: which directions see a place
  };

  /// A band's samples, with the normals of their triangles.
  Places places(const TexelBand& band) const;
  /// Any places. \param positions,normals  in the surface's frame
  Places places(std::span<const Vec3> positions, std::span<const Vec3> normals) const;

  /// Asked several times a second in what follows. \throws Cancelled where it says stop
  void ask(KeepOn keep_on);

  /// Makes room for which directions see the places.
  void note_seen(Places& places) const;

  /// Adds all directions to the places' sums: by pictures, or by rays.
  void add_by_views(Places& places);
  void add_by_rays(Places& places);

  /// By pictures whose pixels name the triangle they show: for every triangle's corner x y z of the sum of
  /// directions and the sum of weights. Each visible pixel counts once, shared among the corners by its
  /// barycentric weights. [12 * triangles]
  std::vector<float> corners();

  const std::vector<ProbeDirection>& directions() const;

  /// Unit normals of the surface's triangles, [3 * triangles], on the device.
  const cl::Array<float>& normals() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The directions of a whole map.
class VisibilityField {
 public:
  /// \param width,height  of the map; a field of texels has at most 2048 a side, and is enlarged for larger
  ///                      maps
  /// \throws Cancelled
  VisibilityField(cl::Context& context, const LowSurface& surface, std::uint32_t width,
                  std::uint32_t height, const VisibilityOptions& options, Traversal traversal,
                  VisibilityReport& report, KeepOn keep_on = {});

  /// Copies a band's samples, with new directions: never below
  /// KILN_VISIBILITY_LEAST_RISE over their faces. Places without any keep their own.
  ///
  /// The hybrid (section 3.4) is (1 - s) v + s n, made unit: v from visibility, made unit, n the band's, s
  /// the standard deviation sqrt(1 - |mean|^2) of the directions that see the place (equation 3). On an
  /// open plane s is 0.745: the mean has the length 2/3 there.
  /// \param cluster  which of the parted directions
  /// \param samples  N of the map's N x N
  /// \param directed  7 planes of `capacity`
  void direct(const TexelBand& band, std::uint32_t samples, bool hybrid,
              const cl::Array<float>& directed, std::uint32_t capacity,
              std::uint32_t cluster = 0) const;

  /// Writes the mean of the directions that see each of a band's samples: what direct() goes by.
  /// \param seen  3 planes of `capacity`
  void means(const TexelBand& band, std::uint32_t samples, const cl::Array<float>& seen,
             std::uint32_t capacity, std::uint32_t cluster = 0) const;

  /// The clusters; none where no more than one was asked for.
  const std::optional<VisibilityClusters>& clusters() const { return clusters_; }

  /// True if directions are those of texels, and interpolated between these; else those of corners.
  bool is_of_texels() const { return field_width_ != 0; }

  /// Means of directions per texel (or corner), 4 floats each, for tests.
  const cl::Array<float>& field() const { return field_; }
  std::uint32_t field_width() const { return field_width_; }
  std::uint32_t field_height() const { return field_height_; }

 private:
  void make_texels(const LowSurface& surface, VisibilityProbe& probe,
                   const VisibilityOptions& options, VisibilityReport& report);
  void store_clusters(const std::vector<PartedTexel>& parted, std::uint32_t count,
                      std::vector<std::array<float, 4>>& means);
  void make_corners(const LowSurface& surface, VisibilityProbe& probe,
                    const VisibilityOptions& options, VisibilityReport& report);
  kiln_visibility_band band_params(const TexelBand& band, std::uint32_t samples,
                                   std::uint32_t capacity) const;

  cl::Context& context_;
  std::uint32_t width_, height_;
  std::uint32_t field_width_ = 0, field_height_ = 0;  // 0: corners
  cl::Array<float> normals_;
  cl::Array<float> field_;
  std::vector<cl::Array<float>> further_;  // the field for clusters 1 and on
  std::optional<VisibilityClusters> clusters_;
  cl::Array<std::uint32_t> field_triangle_;
  cl::Array<std::uint32_t> chart_;
  cl::Array<std::uint32_t> border_;  // of each pixel: its place among the links
  cl::Array<std::uint32_t> links_;
};

}  // namespace kiln
