// Selects the places that pictures show on both meshes.
#include <algorithm>
#include <cmath>
#include <span>

#include "base/parallel.h"
#include "measure/normal_probe.h"
#include "measure/probe_parts.h"

namespace kiln {
namespace {

constexpr std::size_t kPlaceGrain = 1 << 12;
/// Stands for the triangle in pixels in which the low poly is seen from behind, if the high poly is rasterized.
constexpr std::uint32_t kUnseenTriangle = KILN_NO_TRIANGLE - 1;

}  // namespace

NormalProbe::NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage)
    : source_(source),
      reads_(context_of(source.device)),
      light_(context_of(source.device), source.frame.to_frame(low), low.triangles,
             source.traversal),
      low_(source.low_surface(low, cage, UvCopies::plain)),
      surface_(*low_),
      cage_(context_of(source.device), source.frame, surface_),
      shading_(low_shading(surface_)) {
  double radius = 1;
  for (const std::size_t t : surface_.usable_triangles()) {
    for (const LowSurface::Corner& corner : surface_.triangles[t]) {
      radius = std::max(radius, length(to_double(corner.position)));
    }
  }
  start_ = 1.5 * radius;
}

NormalProbe::NormalProbe(const Source::Impl& source, const Mesh& low, const Mesh* cage,
                         const std::vector<ViewAngles>& views, std::uint32_t pixels, bool raster)
    : NormalProbe(source, low, cage) {
  cl::Context& context = context_of(source.device);
  const std::vector<Picture> pictures = pictures_of(source, views, {.pixels = pixels});
  PictureHits shown = hits_by_rays(context, light_, pictures, start_);
  if (!raster) {
    select_places(pictures, shown, hits_by_rays(context, source.rays(), pictures, start_));
    return;
  }
  // Rasterization draws front faces only. Pictures of an open mesh from below would show the few triangles that face
  // down, so they are left out.
  std::vector<bool> needed(pictures.size());
  const std::uint32_t each = pictures[0].points();
  for (std::size_t i = 0; i < shown.triangle.size(); ++i) {
    if (shown.triangle[i] == KILN_NO_TRIANGLE) continue;
    const Picture& picture = pictures[i / each];
    if (from_behind(shown.triangle[i], picture)) {
      shown.triangle[i] = kUnseenTriangle;
    } else {
      needed[i / each] = true;
    }
  }
  select_places(pictures, shown, hits_by_raster(source, pictures, needed));
}

NormalProbe::NormalProbe(const Source::Impl& source, const Mesh& low, const HighPolyView& dense)
    : NormalProbe(source, low, nullptr) {
  worst_where_unseen_ = true;
  select_places(dense.pictures,
                hits_by_rays(context_of(source.device), light_, dense.pictures, start_),
                dense.hits);
}

bool NormalProbe::from_behind(std::uint32_t triangle, const Picture& picture) const {
  const auto& [a, b, c] = surface_.triangles[triangle];
  const Vec3d origin = to_double(a.position);
  return dot(cross(to_double(b.position) - origin, to_double(c.position) - origin),
             picture.toward) < 0;
}

/// Points of pixels that both meshes cover completely. Triangles without UVs, such as those of other texture sets, show
/// no map, so they are skipped.
std::vector<std::uint32_t> NormalProbe::points_on_both(const PictureHits& shown,
                                                       const PictureHits& dense) {
  std::vector<std::uint32_t> points_on_both_meshes;
  for (std::size_t first = 0; first < shown.triangle.size(); first += points_a_pixel_) {
    std::uint32_t points_of_both = 0, of_one = 0;
    for (std::size_t i = first; i < first + points_a_pixel_; ++i) {
      if (shown.triangle[i] == kUnseenTriangle) continue;
      const bool light_hit = shown.triangle[i] != KILN_NO_TRIANGLE;
      if (light_hit && !std::isfinite(surface_.triangles[shown.triangle[i]][0].uv.x)) continue;
      const bool dense_hit = dense.triangle[i] != KILN_NO_TRIANGLE;
      if (light_hit != dense_hit) ++of_one;
      if (light_hit && dense_hit) ++points_of_both;
    }
    if (of_one > 0) ++one_sided_;
    points_of_one_ += of_one;
    points_of_both_ += points_of_both;
    if (points_of_both < points_a_pixel_) continue;
    for (std::size_t i = first; i < first + points_a_pixel_; ++i) {
      points_on_both_meshes.push_back(static_cast<std::uint32_t>(i));
    }
  }
  return points_on_both_meshes;
}

void NormalProbe::select_places(const std::vector<Picture>& pictures, const PictureHits& shown,
                                const PictureHits& dense) {
  for (const Picture& picture : pictures) toward_.push_back(picture.toward);
  points_a_pixel_ = pictures[0].subpixels * pictures[0].subpixels;
  const std::size_t count = shown.triangle.size();
  const std::uint32_t each = pictures[0].points();
  const std::vector<std::uint32_t>& normal_indices =
      reads_.read_source(source_.attributes.normal_indices);
  const std::vector<float>& normals = reads_.read_source(source_.attributes.normals);
  const std::vector<std::uint32_t> points_on_both_meshes = points_on_both(shown, dense);
  places_.resize(points_on_both_meshes.size());
  for (std::size_t i = 0; i <= pictures.size(); ++i) {
    const auto begin =
        std::lower_bound(points_on_both_meshes.begin(), points_on_both_meshes.end(), i * each);
    picture_begins_.push_back(static_cast<std::uint32_t>(begin - points_on_both_meshes.begin()) /
                              points_a_pixel_);
  }
  reference_ = {static_cast<std::uint32_t>(points_on_both_meshes.size()), 1, 3,
                std::vector<float>(std::size_t{3} * points_on_both_meshes.size())};
  parallel_for(points_on_both_meshes.size(), kPlaceGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t at = points_on_both_meshes[i];
      const Picture& picture = pictures[at / each];
      encode(dense_normal(source_, normal_indices, normals, picture, picture.point(at % each),
                          dense.triangle[at]),
             &reference_.pixels[3 * i]);
      Place& place = places_[i];
      place.triangle = shown.triangle[at];
      place.u = shown.barycentric[at];
      place.v = shown.barycentric[at + count];
      place.back = from_behind(place.triangle, picture);
    }
  });
  if (points_a_pixel_ > 1) reference_ = pixel_means(reference_, points_a_pixel_);
  band_ = band_of_all();
}

TexelBand NormalProbe::band_of_all() const {
  return band_of_points(context_of(source_.device), surface_, places_.size(),
                        [&](std::size_t i) -> LowPolyPoint { return places_[i]; });
}

Image NormalProbe::pixel_means(const Image& points, std::uint32_t each) {
  Image means{points.width / each, 1, 3, std::vector<float>(points.pixels.size() / each)};
  parallel_for(means.width, kPlaceGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Vec3d sum{};
      for (std::size_t k = i * each; k < (i + 1) * each; ++k) {
        const float* p = &points.pixels[3 * k];
        sum += Vec3d(p[0], p[1], p[2]) + Vec3d(-0.5, -0.5, -0.5);
      }
      encode(sum, &means.pixels[3 * i]);
    }
  });
  return means;
}

}  // namespace kiln
