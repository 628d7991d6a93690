#pragma once

#include <cstdint>
#include <vector>

#include "kiln/contour.h"
#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/mesh.h"
#include "kiln/volume.h"

namespace KILN_PUBLIC kiln {

/// Error of a map's normals against a volume's gradient, over the texels that could be compared.
/// Percentiles are exact, by nearest rank. All degrees are 0 where nothing was compared.
struct GradientError {
  std::uint64_t texels = 0;  ///< Compared
  std::uint64_t empty =
      0;  ///< ... where the map has no direction: the low poly's own normal counts
  double mean_degrees = 0;    ///< Over the compared texels
  double rms_degrees = 0;     ///< Root of the mean square
  double median_degrees = 0;  ///< Half of the texels are not above
  double p95_degrees = 0;     ///< 95% of the texels are not above
  double p99_degrees = 0;     ///< 99% of the texels are not above
  double max_degrees = 0;     ///< The greatest angle
};

/// Along which line through a point of the low poly its point of the surface is looked for.
enum class GradientLine {
  shading,  ///< The corners' normals, interpolated and made unit: as rays are cast
  face,     ///< The triangle's own normal: as the direct map projects
};

/// Settings of the search for the surface.
struct GradientOptions {
  std::uint32_t size = 1024;  ///< Texels a side of the maps, 1 to 16384
  double reach = 0;           ///< Length of the search each way, world units, above 0
  GradientLine line = GradientLine::shading;  ///< Line along which the surface is looked for
};

/// Reference for a normal map of a volume's surface: at each texel of a low poly the normal of the
/// volume's own field.
///
/// A texel counts where its centre lies in a UV triangle (of several, the first). It stands for the
/// point of that triangle there. From that point a line is followed both ways at once, in steps of
/// a quarter of a cell. It ends at the surface: the nearest place where one comes out of the solid
/// when going outwards. There the field, the voxels' trilinear interpolation, is 0: regula falsi
/// finds it in double precision (Illinois variant; Dowell and Jarratt 1971). The normal there is
/// the field's gradient by central differences at the voxels, interpolated like the field;
/// one-sided at the volume's border. This shares no code with contour(). Both agree along edges
/// between voxels away from creases; on sharp creases of the data this normal is rounder.
///
/// Left out, and counted: texels without such a place within reach; texels where a closed border cuts
/// the solid off (the normal is the border's); texels where the gradient is zero.
/// ContourOptions::outer_only is followed: inner surfaces, and caps of closed gaps, are no such place.
///
/// Immutable; may be used by several threads. Keeps neither volume nor mesh. Takes 28 bytes a texel. The same on every run and number of
/// threads; needs no device.
class GradientReference {
 public:
  /// \param contour  as the surface was asked for
  /// \param low  with UVs; normals too, where they are complete
  /// \throws Error(usage) for an option out of range; Error(input) for a mesh without UVs or with
  ///         normals missing; or for a volume whose size or axes contour() refuses
  GradientReference(const Volume& volume, const ContourOptions& contour, const Mesh& low,
                    const GradientOptions& options);

  std::uint64_t covered() const { return covered_; }          ///< Texels of the low poly
  std::uint64_t no_surface() const { return no_surface_; }    ///< ... without a place within reach
  std::uint64_t cut() const { return cut_; }                  ///< ... on the volume's closed border
  std::uint64_t no_gradient() const { return no_gradient_; }  ///< ... where the field is flat

  /// \param map  object space, n/2 + 1/2 in the first three channels, as large as `size` says
  /// \throws Error(input) for another size or too few channels
  GradientError compare(const Image& map) const;
  /// The low poly's own interpolated normals: no map at all.
  GradientError compare_without_map() const;

 private:
  struct Texel {
    std::uint32_t place;   ///< In the map
    Vec3 wanted, shading;  ///< Unit
  };
  template <typename Normal>
  GradientError compare_with(const Normal& normal) const;

  std::uint32_t size_;
  std::vector<Texel> texels_;  ///< Compared
  std::uint64_t covered_ = 0, no_surface_ = 0, cut_ = 0, no_gradient_ = 0;
};

}  // namespace kiln
