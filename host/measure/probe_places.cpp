// Selects the places that pictures show on both meshes.
#include <algorithm>
#include <cmath>
#include <span>

#include "base/parallel.h"
#include "measure/normal_probe.h"
#include "measure/probe_parts.h"

namespace kiln {
namespace {

constexpr std::size_t kPlacePointsPerTask = 1 << 12;
/// Replaces the triangle index at points that show a back face of the low poly. Only used if the pictures of the high
/// poly are rasterized, since rasterization draws front faces only.
constexpr std::uint32_t kBackFaceTriangle = KILN_NO_TRIANGLE - 1;

}  // namespace

NormalProbe::NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage)
    : source_(source),
      normal_reads_(context_of(source.device)),
      low_poly_rays_(context_of(source.device), source.frame.to_frame(low), low.triangles,
                     source.traversal),
      low_(source.low_surface(low, cage, UvCopies::plain)),
      surface_(*low_),
      cage_(context_of(source.device), source.frame, surface_),
      shading_(low_shading(surface_)) {
  double ray_radius = 1;
  for (const std::size_t t : surface_.usable_triangles()) {
    for (const LowSurface::Corner& corner : surface_.triangles[t]) {
      ray_radius = std::max(ray_radius, length(to_double(corner.position)));
    }
  }
  ray_start_distance_ = 1.5 * ray_radius;
}

NormalProbe::NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage,
                         const std::vector<ViewAngles>& views, std::uint32_t pixels, bool raster)
    : NormalProbe(source, low, cage) {
  cl::Context& context = context_of(source.device);
  const std::vector<Picture> pictures = make_pictures(source, views, {.pixels = pixels});
  PictureHits low_poly_hits = cast_hits(context, low_poly_rays_, pictures, ray_start_distance_);
  if (!raster) {
    select_places(pictures, low_poly_hits,
                  cast_hits(context, source.rays(), pictures, ray_start_distance_));
    return;
  }
  // Rasterization draws front faces only. Pictures that show no front face of the low poly, such as those of an open
  // mesh from below, are left out.
  std::vector<bool> is_rasterized(pictures.size());
  const std::uint32_t points_per_picture = pictures[0].points();
  for (std::size_t i = 0; i < low_poly_hits.triangle.size(); ++i) {
    if (low_poly_hits.triangle[i] == KILN_NO_TRIANGLE) continue;
    const Picture& picture = pictures[i / points_per_picture];
    if (is_seen_from_behind(low_poly_hits.triangle[i], picture)) {
      low_poly_hits.triangle[i] = kBackFaceTriangle;
    } else {
      is_rasterized[i / points_per_picture] = true;
    }
  }
  select_places(pictures, low_poly_hits, rasterize_hits(source, pictures, is_rasterized));
}

NormalProbe::NormalProbe(const Source::Impl& source, const Mesh& low, const HighPolyView& dense)
    : NormalProbe(source, low, nullptr) {
  is_error_max_if_no_places_ = true;
  select_places(
      dense.pictures,
      cast_hits(context_of(source.device), low_poly_rays_, dense.pictures, ray_start_distance_),
      dense.hits);
}

bool NormalProbe::is_seen_from_behind(std::uint32_t triangle, const Picture& picture) const {
  const auto& [a, b, c] = surface_.triangles[triangle];
  const Vec3d origin = to_double(a.position);
  return dot(cross(to_double(b.position) - origin, to_double(c.position) - origin),
             picture.toward) < 0;
}

/// Finds the points of pixels that both meshes cover completely. Triangles without UVs, such as those of other texture
/// sets, have no map and are skipped.
std::vector<std::uint32_t> NormalProbe::find_points_on_both(const PictureHits& low_poly_hits,
                                                            const PictureHits& dense) {
  std::vector<std::uint32_t> points_on_both_meshes;
  for (std::size_t first = 0; first < low_poly_hits.triangle.size(); first += points_per_pixel_) {
    std::uint32_t points_on_both = 0, points_on_one_mesh = 0;
    for (std::size_t i = first; i < first + points_per_pixel_; ++i) {
      if (low_poly_hits.triangle[i] == kBackFaceTriangle) continue;
      const bool low_poly_hit = low_poly_hits.triangle[i] != KILN_NO_TRIANGLE;
      if (low_poly_hit && !std::isfinite(surface_.triangles[low_poly_hits.triangle[i]][0].uv.x))
        continue;
      const bool high_poly_hit = dense.triangle[i] != KILN_NO_TRIANGLE;
      if (low_poly_hit != high_poly_hit) ++points_on_one_mesh;
      if (low_poly_hit && high_poly_hit) ++points_on_both;
    }
    if (points_on_one_mesh > 0) ++pixels_on_one_mesh_only_;
    points_on_one_mesh_ += points_on_one_mesh;
    points_on_both_meshes_ += points_on_both;
    if (points_on_both < points_per_pixel_) continue;
    for (std::size_t i = first; i < first + points_per_pixel_; ++i) {
      points_on_both_meshes.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return points_on_both_meshes;
}

void NormalProbe::select_places(const std::vector<Picture>& pictures,
                                const PictureHits& low_poly_hits, const PictureHits& dense) {
  for (const Picture& picture : pictures) picture_directions_.push_back(picture.toward);
  points_per_pixel_ = pictures[0].subpixels * pictures[0].subpixels;
  const std::size_t count = low_poly_hits.triangle.size();
  const std::uint32_t points_per_picture = pictures[0].points();
  const std::vector<std::uint32_t>& normal_indices =
      normal_reads_.read_source(source_.attributes.normal_indices);
  const std::vector<float>& normals = normal_reads_.read_source(source_.attributes.normals);
  const std::vector<std::uint32_t> points_on_both_meshes =
      find_points_on_both(low_poly_hits, dense);
  places_.resize(points_on_both_meshes.size());
  for (std::size_t i = 0; i <= pictures.size(); ++i) {
    const auto begin = std::lower_bound(points_on_both_meshes.begin(), points_on_both_meshes.end(),
                                        i * points_per_picture);
    picture_begins_.push_back(static_cast<std::uint32_t>(begin - points_on_both_meshes.begin()) /
                              points_per_pixel_);
  }
  high_poly_normals_ = {static_cast<std::uint32_t>(points_on_both_meshes.size()), 1, 3,
                        std::vector<float>(std::size_t{3} * points_on_both_meshes.size())};
  parallel_for(
      points_on_both_meshes.size(), kPlacePointsPerTask, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const std::uint32_t point = points_on_both_meshes[i];
          const Picture& picture = pictures[point / points_per_picture];
          encode_normal(
              high_poly_normal(source_, normal_indices, normals, picture,
                               picture.point(point % points_per_picture), dense.triangle[point]),
              &high_poly_normals_.pixels[3 * i]);
          Place& place = places_[i];
          place.triangle = low_poly_hits.triangle[point];
          place.u = low_poly_hits.barycentric[point];
          place.v = low_poly_hits.barycentric[point + count];
          place.seen_from_behind = is_seen_from_behind(place.triangle, picture);
        }
      });
  if (points_per_pixel_ > 1)
    high_poly_normals_ = pixel_means(high_poly_normals_, points_per_pixel_);
  band_ = copy_band();
}

TexelBand NormalProbe::copy_band() const {
  return band_of_points(context_of(source_.device), surface_, places_.size(),
                        [&](std::size_t i) -> LowPolyPoint { return places_[i]; });
}

Image NormalProbe::pixel_means(const Image& points, std::uint32_t points_per_pixel) {
  Image mean_normals{points.width / points_per_pixel, 1, 3,
                     std::vector<float>(points.pixels.size() / points_per_pixel)};
  parallel_for(mean_normals.width, kPlacePointsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Vec3d sum{};
      for (std::size_t k = i * points_per_pixel; k < (i + 1) * points_per_pixel; ++k) {
        const float* p = &points.pixels[3 * k];
        sum += Vec3d(p[0], p[1], p[2]) + Vec3d(-0.5, -0.5, -0.5);
      }
      encode_normal(sum, &mean_normals.pixels[3 * i]);
    }
  });
  return mean_normals;
}

}  // namespace kiln
