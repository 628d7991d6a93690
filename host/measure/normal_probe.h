// Compares rendered normals of low polys with the high poly's. Rays are cast once, and shared by all maps.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bake/match_stage.h"
#include "detail/band_reads.h"
#include "kiln/image.h"
#include "kiln/measure.h"
#include "match/cage_reach.h"
#include "match/surface_places.h"
#include "measure/probe_pictures.h"
#include "source/high_poly.h"

namespace kiln {

/// Pictures of the high poly, shared by any number of low polys.
struct HighPolyView {
  std::vector<Picture> pictures;
  PictureHits hits;
};

/// Directions of a plan's pictures: kPlanViews unit vectors towards the eye.
std::vector<Vec3> plan_directions();

/// Pictures of the high poly from some directions.
/// \param screen  pixels that the high poly covers, the greater of width and height; 0: unlimited resolution
/// \param coarse  two thirds of the pixels a side: enough to compare low polys, but not to report errors
HighPolyView shown_from(const Source::Impl& source, std::uint32_t screen,
                        const std::vector<Vec3>& toward, bool coarse = false);

/// Adds arbitrary UVs to a mesh without, for probes that do not read them.
Mesh with_any_uvs(Mesh mesh);

/// Places that pictures from many sides show on both meshes: points of the low poly with their texture coordinates, and
/// the high poly's normal in the same pixel. A low poly with a map is rendered by looking up the map at these places
/// (bilinear, as kernels/render/render.cl does). So each further map is measured without casting rays. Pixels are point
/// samples, so a few of them estimate the same mean.
///
/// The same places measure the best that a match can reach, without baking: the match of the places themselves is what
/// a map of infinite size would show.
class NormalProbe {
 public:
  /// \param views   directions of the pictures, which the high poly fills
  /// \param pixels  a side of each picture, a multiple of 8
  /// \param raster  true: rasterizes the high poly instead of casting rays, for sources without a BVH. Then back faces
  ///     of the low poly do not count
  /// \throws Error(input) as LowSurface::of
  NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage,
              const std::vector<ViewAngles>& views, std::uint32_t pixels, bool raster);

  /// Uses pictures for which the high poly's hits are known. If pixels have several points, their mean normals are
  /// compared, over pixels that both meshes cover completely. Without any such pixel, as for parts smaller than a
  /// pixel, errors are 180 degrees, the greatest possible.
  NormalProbe(const Source::Impl& source, const Mesh& low, const HighPolyView& dense);

  /// Error of the low poly's own normals.
  NormalError without_map() const;

  /// \param map  normals as n/2 + 1/2, as in Scene
  NormalError with_map(const Image& map, const BakeOptions& baked) const;

  /// Error of given normals at each place, in the mesh's space, such as matched ones.
  NormalError with_normals(const std::vector<float>& normals) const;

  /// Errors of a match with a map of infinite size.
  struct InfiniteMap {
    NormalError error;
    double missed = 0;           ///< Share of the places that the match misses
    std::vector<float> normals;  ///< Matched normals, in the mesh's space
  };
  /// Error of a match with a map of infinite size. For matches by UVs, layouts are not checked.
  /// \param field  of visibility: computed if null, otherwise reused
  /// \throws as make_matcher
  InfiniteMap infinite_map(const BakeOptions& options,
                           std::shared_ptr<const VisibilityField>& field) const;

  /// Lower bound on the error of any map, as a share of a match's error. A place of the low poly shows one normal to
  /// all directions, but the high poly has a different one behind it from each. The bound is the mean error of each
  /// place's best normal, over that of the matched normals. Estimated at some places, from the pictures' directions
  /// that see them; slightly too low where few directions see a place.
  double least_share(const InfiniteMap& endless) const;

  std::uint32_t places() const { return band_.sample_count; }

 private:
  struct Place : LowPlace {
    bool back = false;  ///< Seen from behind: its normal is flipped
  };
  NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage);
  bool from_behind(std::uint32_t triangle, const Picture& picture) const;
  std::vector<std::uint32_t> points_on_both(const PictureHits& shown, const PictureHits& dense);
  void select_places(const std::vector<Picture>& pictures, const PictureHits& shown,
                     const PictureHits& dense);
  TexelBand band_of_all() const;
  void match_places(const BakeOptions& options, std::shared_ptr<const VisibilityField>& field,
                    DeviceCorrespondence& match) const;
  void match_by_uv(const BakeOptions& options, std::shared_ptr<const VisibilityField>& field,
                   DeviceCorrespondence& match) const;
  NormalError compare(const Image& shown) const;
  /// The mean normal of each group of points.
  static Image pixel_means(const Image& points, std::uint32_t each);

  const Source::Impl& source_;
  mutable BandReads reads_;  ///< Reads the high poly's normals
  RayCaster light_;
  std::vector<Vec3d> toward_;  ///< Directions of the pictures
  double start_ = 0;           ///< Distance of rays' origins from the centre
  std::shared_ptr<LowSurface> low_;
  LowSurface& surface_;
  CageReach cage_;
  std::vector<kiln_low_shading> shading_;
  std::vector<Place> places_;
  std::uint32_t points_a_pixel_ = 1;
  std::vector<std::uint32_t>
      picture_begins_;               ///< First place of each picture, and the end of the last one
  bool worst_where_unseen_ = false;  ///< Without any place, errors are the greatest
  Image reference_;                  ///< The high poly's normals, as an image of one row
  std::uint64_t one_sided_ = 0;      ///< Pixels covered by one mesh only
  std::uint64_t points_of_one_ = 0, points_of_both_ = 0;
  TexelBand band_;  ///< The places as samples of a map with one row
};

}  // namespace kiln
