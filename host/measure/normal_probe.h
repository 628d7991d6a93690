// Rendered normals of a low poly against the high poly's, again and again: what does not depend on the
// map is found once.
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

/// Pictures of the high poly: made once for any number of low polys.
struct HighPolyView {
  std::vector<Picture> pictures;
  PictureHits hits;
};

/// Directions that plans look from: kPlanViews unit vectors towards the eye.
std::vector<Vec3> plan_directions();

/// Pictures of the high poly from some directions.
/// \param screen  pixels that the high poly covers, the longer of width and height; 0: endlessly many
/// \param coarse  two thirds of the pixels a side: enough to compare low polys, not to say what one reaches
HighPolyView shown_from(const Source::Impl& source, std::uint32_t screen,
                        const std::vector<Vec3>& toward, bool coarse = false);

/// A mesh with UVs, though they say nothing: probes of surfaces do not read them.
Mesh with_any_uvs(Mesh mesh);

/// Places that pictures from many sides show on both meshes: points of the low poly with their texture
/// coordinates, and the high poly's normal in the same pixel. What a picture of the low poly would show
/// is looked up there (bilinear, as kernels/render/render.cl does it). So measuring one more map casts no ray. Pixels are point samples, so fewer of them estimate the same mean.
///
/// The same pixels tell how good a way to match can get without baking any map: its matches of these very
/// points are what a map of endless size would show.
class NormalProbe {
 public:
  /// \param views   where pictures are taken from; the high poly fills them
  /// \param pixels  a side of each, a multiple of 8
  /// \param raster  find the high poly's pixels by drawing it, and not by rays: where there is no hierarchy.
  ///                Then what is seen from behind does not count
  /// \throws Error(input) as LowSurface::of
  NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage,
              const std::vector<ViewAngles>& views, std::uint32_t pixels, bool raster);

  /// In pictures of which the high poly's side is known. Where a pixel has several points, normals are
  /// compared by their means over each pixel that both meshes cover whole. Where there is none, as of parts smaller
  /// than a pixel, nothing can be said: errors are 180 degrees, as large as any.
  NormalProbe(const Source::Impl& source, const Mesh& low, const HighPolyView& dense);

  /// Error of the low poly's own normals.
  NormalError without_map() const;

  /// \param map  n/2 + 1/2, as Scene takes it
  NormalError with_map(const Image& map, const BakeOptions& baked) const;

  /// Error of normals in the mesh's space at each place, for example those that are matched there.
  NormalError with_normals(const std::vector<float>& normals) const;

  /// Errors of a match with a map of endless size.
  struct InfiniteMap {
    NormalError error;
    double missed = 0;           ///< Share of the places
    std::vector<float> normals;  ///< Normals found there, in the mesh's space
  };
  /// Error that a map of endless size would reach with a way to match. By UVs nothing is checked of the layouts.
  /// \param field  of visibility: made where it is null, and taken where it is not
  /// \throws as make_matcher
  InfiniteMap infinite_map(const BakeOptions& options,
                           std::shared_ptr<const VisibilityField>& field) const;

  /// The share of a way's error that no map whatever can get below, however it is matched. A place of the low
  /// poly shows one normal to all directions. The high poly has another behind it from each. It is the mean
  /// error of each place's best normal, over that of the normals that the way found. Some places are asked, from
  /// the pictures' directions that see them. A little too low where few directions see a place.
  double least_share(const InfiniteMap& endless) const;

  std::uint32_t places() const { return band_.sample_count; }

 private:
  struct Place : LowPlace {
    bool back = false;  ///< Seen from behind: its normal is turned round
  };
  NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage);
  bool from_behind(std::uint32_t triangle, const Picture& picture) const;
  std::vector<std::uint32_t> points_on_both(const PictureHits& shown, const PictureHits& dense);
  void take_places(const std::vector<Picture>& pictures, const PictureHits& shown,
                   const PictureHits& dense);
  TexelBand band_of_all() const;
  void match_places(const BakeOptions& options, std::shared_ptr<const VisibilityField>& field,
                    DeviceCorrespondence& match) const;
  void match_by_uv(const BakeOptions& options, std::shared_ptr<const VisibilityField>& field,
                   DeviceCorrespondence& match) const;
  NormalError compare(const Image& shown) const;
  /// The mean normal of each run of points.
  static Image pixel_means(const Image& points, std::uint32_t each);

  const Source::Impl& source_;
  mutable BandReads reads_;  ///< Reads the high poly's normals
  RayCaster light_;
  std::vector<Vec3d> toward_;  ///< Directions of the pictures
  double start_ = 0;           ///< Distance from the middle at which their rays start
  std::shared_ptr<LowSurface> low_;
  LowSurface& surface_;
  CageReach cage_;
  std::vector<kiln_low_shading> shading_;
  std::vector<Place> places_;
  std::uint32_t points_a_pixel_ = 1;
  std::vector<std::uint32_t>
      picture_begins_;  ///< Pixels of each picture begin there, and where the last one ends
  bool worst_where_unseen_ = false;  ///< Errors without any place
  Image reference_;                  ///< The high poly's normals, one row
  std::uint64_t one_sided_ = 0;      ///< Pixels
  std::uint64_t points_of_one_ = 0, points_of_both_ = 0;
  TexelBand band_;  ///< The places as samples of a map of one row
};

}  // namespace kiln
