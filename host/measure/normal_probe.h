// Compares rendered normals of low polys with the high poly's. Rays are cast once, for any number of maps.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "bake/match_stage.h"
#include "detail/band_reads.h"
#include "kiln/image_data.h"
#include "kiln/measure.h"
#include "match/cage_reach.h"
#include "match/surface_places.h"
#include "measure/probe_pictures.h"
#include "source/high_poly.h"

namespace kiln {

/// Pictures of the high poly and the ray hits of their pixels, shared by the probes of any number of low polys.
struct HighPolyView {
  std::vector<Picture> pictures;
  PictureHits hits;
};

/// Directions of the pictures by which plans measure errors: kPlanViews unit vectors towards the
/// viewer.
std::vector<Vec3> plan_directions();

/// Makes pictures of the high poly from the given directions.
/// \param screen  size of the high poly on screen in pixels, the larger of width and height; 0 for unlimited resolution
/// \param coarse  true: two thirds of the pixels along each side, which suffices to compare low polys, but not to
/// report errors
HighPolyView make_high_poly_view(const Source::Impl& source, std::uint32_t screen,
                                 const std::vector<Vec3>& toward, bool coarse = false);

/// Gives a mesh without UVs arbitrary ones, for probes that require UVs but do not use them.
Mesh add_placeholder_uvs(Mesh mesh);

/// Places that pictures from many sides show on both meshes: points of the low poly with their texture coordinates, and
/// the high poly's normal in the same pixel. A low poly with a map is rendered by looking up the map at these places
/// (bilinear, as kernels/render/render.cl does). So any further map is measured without casting rays. Pixels are point
/// samples, so a small number of them estimates the same mean.
///
/// The places also give the smallest error that a match can reach, without a bake: their matched normals are what a map
/// of infinite resolution would hold.
class NormalProbe {
 public:
  /// \param views   directions of the pictures. The high poly fills each picture from side to side
  /// \param pixels  side of each picture in pixels, a multiple of 8
  /// \param raster  true: rasterizes the high poly instead of casting rays, for sources without a BVH. In this case,
  ///     back faces of the low poly do not count
  /// \throws Error(input) as LowSurface::of
  NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage,
              const std::vector<ViewAngles>& views, std::uint32_t pixels, bool raster);

  /// Constructs a probe from pictures for which the high poly's hits are known. If a pixel has several points, the mean
  /// normals of its points are compared, at pixels that both meshes cover completely. If there is no such pixel, as for
  /// meshes smaller than a pixel, errors are 180 degrees, the greatest possible.
  NormalProbe(const Source::Impl& source, const Mesh& low, const HighPolyView& dense);

  /// Error of the low poly's own normals, without a map.
  NormalError without_map() const;

  /// \param map  map of normals n, encoded as n/2 + 1/2 as in Scene
  NormalError with_map(const Image& map, const BakeOptions& baked) const;

  /// Error of given normals, such as matched ones.
  /// \param normals  x, y, z of one normal per place, in the mesh's space
  NormalError error_with_normals(const std::vector<float>& normals) const;

  /// Errors of a match with a map of infinite resolution.
  struct InfiniteMap {
    NormalError error;
    double missed = 0;           ///< Share of the places for which the match finds no point
    std::vector<float> normals;  ///< Matched normals, in the mesh's space
  };
  /// Error of a match with a map of infinite resolution. For matches by UVs, layouts are not checked.
  /// \param field  [in, out] visibility field; computed if null, otherwise reused
  /// \throws as make_matcher
  InfiniteMap infinite_map(const BakeOptions& options,
                           std::shared_ptr<const VisibilityField>& field) const;

  /// Lower bound on the error of all maps, as a share of a match's error. A place of the low poly has the same normal
  /// from all directions, but the point of the high poly behind it differs between directions. The bound is the mean
  /// error of each place's best normal, divided by the mean error of the matched normals. It is estimated at a sample
  /// of the places, from the pictures that show them. For places that few pictures show, it is slightly too low.
  double min_error_share(const InfiniteMap& infinite_map_result) const;

  std::uint32_t places() const { return band_.sample_count; }

 private:
  struct Place : LowPolyPoint {
    bool seen_from_behind =
        false;  ///< True if the low poly is seen from behind, so that its normal is flipped
  };
  NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage);
  bool is_seen_from_behind(std::uint32_t triangle, const Picture& picture) const;
  std::vector<std::uint32_t> find_points_on_both(const PictureHits& shown,
                                                 const PictureHits& dense);
  void select_places(const std::vector<Picture>& pictures, const PictureHits& shown,
                     const PictureHits& dense);
  TexelBand copy_band() const;
  void match_places(const BakeOptions& options, std::shared_ptr<const VisibilityField>& field,
                    DeviceCorrespondence& match) const;
  void match_by_uv(const BakeOptions& options, std::shared_ptr<const VisibilityField>& field,
                   DeviceCorrespondence& match) const;
  NormalError compare(const Image& shown) const;
  /// The mean normal of each group of points.
  static Image pixel_means(const Image& points, std::uint32_t points_per_pixel);

  const Source::Impl& source_;
  mutable BandReads normal_reads_;  ///< Reads the high poly's normals
  RayCaster low_poly_rays_;
  std::vector<Vec3d> picture_directions_;  ///< Directions of the pictures
  double ray_start_distance_ = 0;          ///< Distance of rays' origins from the centre
  std::shared_ptr<LowSurface> low_;
  LowSurface& surface_;
  CageReach cage_;
  std::vector<kiln_low_shading> shading_;
  std::vector<Place> places_;
  std::uint32_t points_per_pixel_ = 1;
  std::vector<std::uint32_t>
      /// Index of each picture's first place; the extra last entry is the number of places
      picture_begins_;
  /// True if a low poly without places counts as having the largest possible error; false if it counts as having none
  bool is_error_max_if_no_places_ = false;
  Image high_poly_normals_;  ///< The high poly's normals, as an image of one row
  std::uint64_t pixels_on_one_mesh_only_ =
      0;  ///< Number of pixels that only one of the meshes covers
  std::uint64_t points_on_one_mesh_ = 0, points_on_both_meshes_ = 0;
  TexelBand band_;  ///< The places, as the samples of a map with one row
};

}  // namespace kiln
