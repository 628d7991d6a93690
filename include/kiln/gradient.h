#pragma once

#include <cstdint>
#include <vector>

#include "kiln/contour.h"
#include "kiln/export.h"
#include "kiln/image_data.h"
#include "kiln/mesh.h"
#include "kiln/volume.h"

namespace KILN_PUBLIC kiln {

/// Error of a map's normals against a volume's gradient, over the comparable texels. Percentiles
/// are exact, by nearest rank. All degrees are 0 if no texel was compared.
struct GradientError {
  std::uint64_t texels = 0;  ///< Number of compared texels
  /// Compared texels at which the map has no direction; the low poly's normal is compared instead
  std::uint64_t empty = 0;
  double mean_degrees = 0;    ///< Mean angle over the compared texels
  double rms_degrees = 0;     ///< Root mean square of the error
  double median_degrees = 0;  ///< Angle that half of the texels do not exceed
  double p95_degrees = 0;     ///< Angle that 95% of the texels do not exceed
  double p99_degrees = 0;     ///< Angle that 99% of the texels do not exceed
  double max_degrees = 0;     ///< Largest angle
};

/// Line through a point of the low poly along which its surface point is searched.
enum class GradientLine {
  shading,  ///< Along the interpolated, normalised corner normals, like the rays of a bake
  face,     ///< Along the triangle's normal, like the projection of extract()'s own normal map
};

/// Settings of the search for the surface.
struct GradientOptions {
  std::uint32_t size = 1024;  ///< Texels a side of the maps, 1 to 16384
  /// Search distance in both directions, world units, above 0
  double reach = 0;
  GradientLine line = GradientLine::shading;  ///< Line along which the surface point is searched
};

/// Reference for a normal map of a volume's surface: at each texel of a low poly the normal of the
/// volume's own field.
///
/// A texel counts if its centre lies in a UV triangle (the first, if several overlap); it represents the triangle's
/// point at its centre. From there the line is marched in both directions at once, in steps of a quarter of a cell,
/// to the nearest point where it leaves the solid in the outward direction. Regula falsi refines this root of the
/// trilinearly interpolated field in double precision (Illinois variant; Dowell and Jarratt 1971). The normal there
/// is the field's gradient by central differences at the voxels, interpolated like the field; one-sided at the
/// volume's border. This shares no code with contour(). Away from creases both agree on edges between voxels; at
/// sharp creases of the data this reference is smoother.
///
/// Excluded and counted are texels without a surface within reach; texels where a closed border cuts the solid (the
/// normal is the border's); and texels with a zero gradient. With ContourOptions::outer_only, inner surfaces and caps
/// of closed gaps do not count as surface.
///
/// Immutable; may be used by several threads. Keeps neither volume nor mesh. Memory: 28 bytes per texel. The same on
/// every run and number of threads; needs no device.
class GradientReference {
 public:
  /// \param contour  settings of the contour that the low poly was made from
  /// \param low  with UVs; its normals are used if they are complete
  /// \throws Error(usage) for an option out of range; Error(input) for a mesh without UVs or with
  ///         normals missing; or for a volume whose size or axes contour() refuses
  GradientReference(const Volume& volume, const ContourOptions& contour, const Mesh& low,
                    const GradientOptions& options);

  std::uint64_t covered() const { return covered_; }  ///< Number of texels that the low poly covers
  /// Number of texels without a surface within GradientOptions::reach
  std::uint64_t no_surface() const { return no_surface_; }
  /// Number of texels where the volume's closed border cuts the solid
  std::uint64_t cut() const { return cut_; }
  /// Number of texels with a zero gradient
  std::uint64_t no_gradient() const { return no_gradient_; }

  /// Error of an object-space normal map of the low poly.
  /// \param map  object space, n/2 + 1/2 in the first three channels, GradientOptions::size texels
  ///             a side
  /// \throws Error(input) for another size or too few channels
  GradientError compare(const Image& map) const;
  /// Error of the low poly's own interpolated normals, without a map.
  GradientError compare_without_map() const;

 private:
  struct Texel {
    std::uint32_t place;   ///< Index of the texel in the map
    Vec3 wanted, shading;  ///< Unit normals: of the field, and interpolated on the low poly
  };
  template <typename Normal>
  GradientError compare_with(const Normal& normal) const;

  std::uint32_t size_;
  std::vector<Texel> texels_;  ///< Compared texels
  std::uint64_t covered_ = 0, no_surface_ = 0, cut_ = 0, no_gradient_ = 0;
};

}  // namespace kiln
