#include "measure/probe_pictures.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/parallel.h"
#include "mesh/box.h"

namespace kiln {
namespace {

constexpr std::uint32_t kTileSide = PictureGrid::kPictureTile;
constexpr std::size_t kPointsPerTask = 1 << 12;

/// The high poly's bounding box as a mesh, so that pictures of both meshes have the same frame.
Mesh bounding_box_mesh(const Source::Impl& source) {
  Box<Vec3d> bounds;
  for (const Triangle& triangle : source.triangles) {
    for (const std::uint32_t i : triangle) {
      const Vec3& p = source.positions[i];
      if (is_finite(p)) bounds.add(to_double(p));
    }
  }
  const auto& [low, high] = bounds;
  Mesh box;
  box.name = "box";
  box.origin = source.frame.center;
  for (int i = 0; i < 8; ++i) {
    const Vec3d corner = {(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                          (i & 4) != 0 ? high.z : low.z};
    box.positions.push_back(to_float(corner * (1 / source.frame.scale)));
  }
  // The camera's framing only reads corners, so these triangles suffice.
  box.triangles = {{0, 1, 2}, {3, 4, 5}, {5, 6, 7}};
  return box;
}

/// Positions of finite triangles.
std::vector<Vec3d> used_positions(const Source::Impl& source) {
  std::vector<std::uint8_t> is_used_vertex(source.positions.size(), 0);
  for (const Triangle& triangle : source.triangles) {
    const bool finite = std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t i) {
      return is_finite(source.positions[i]);
    });
    if (!finite) continue;
    for (const std::uint32_t i : triangle) is_used_vertex[i] = 1;
  }
  std::vector<Vec3d> positions;
  for (std::size_t i = 0; i < is_used_vertex.size(); ++i) {
    if (is_used_vertex[i] != 0) positions.push_back(to_double(source.positions[i]));
  }
  return positions;
}

/// Fits a picture to its contents without a margin: a size on screen refers to the mesh, not to its bounding box.
void fit_closely(const std::vector<Vec3d>& positions, Picture& picture) {
  double left = 1e300, right = -1e300, bottom = 1e300, top = -1e300;
  for (const Vec3d& p : positions) {
    const double x = dot(p, picture.right), y = dot(p, picture.up);
    left = std::min(left, x);
    right = std::max(right, x);
    bottom = std::min(bottom, y);
    top = std::max(top, y);
  }
  const double side = std::max(right - left, top - bottom);
  if (!(side > 0) || side > 2 * picture.half_side) return;
  picture.half_side = side / 2;
  picture.center = picture.right * ((left + right) / 2) + picture.up * ((bottom + top) / 2) +
                   picture.toward * dot(picture.center, picture.toward);
}

}  // namespace

Picture::Picture(const Camera& camera, const Frame& frame, std::uint32_t size)
    : right(camera.right),
      up(camera.up),
      toward(camera.toward),
      center(Vec3d(camera.center[0] - frame.center[0], camera.center[1] - frame.center[1],
                   camera.center[2] - frame.center[2]) *
             frame.scale),
      half_side(camera.half_side * frame.scale),
      pixels(size) {}

Vec3d Picture::point(std::uint32_t index) const {
  const std::uint32_t points_per_pixel = subpixels * subpixels;
  const std::uint32_t pixel = index / points_per_pixel, subpixel = index % points_per_pixel;
  const std::uint32_t tile = pixel / (kTileSide * kTileSide),
                      index_in_tile = pixel % (kTileSide * kTileSide);
  const std::uint32_t x = tile % (pixels / kTileSide) * kTileSide + index_in_tile % kTileSide;
  const std::uint32_t y = tile / (pixels / kTileSide) * kTileSide + index_in_tile / kTileSide;
  const double step = 2 * half_side / pixels;
  const std::uint32_t subpixel_column = subpixel % subpixels, subpixel_row = subpixel / subpixels;
  const double offset_right = ((subpixel_column + 0.5) / subpixels - 0.5) * pixel_footprint;
  const double offset_down = ((subpixel_row + 0.5) / subpixels - 0.5) * pixel_footprint;
  return center + right * ((x + 0.5) * step - half_side + offset_right) +
         up * (half_side - (y + 0.5) * step - offset_down);
}

kiln_view Picture::view(std::uint32_t first) const {
  kiln_view to{};
  const auto store_vector = [](const Vec3d& source, kiln_float(&vector)[3]) {
    const Vec3 v = to_float(source);
    vector[0] = v.x;
    vector[1] = v.y;
    vector[2] = v.z;
  };
  store_vector(right, to.right);
  store_vector(up, to.up);
  store_vector(toward, to.toward);
  const double scale = pixels / (2 * half_side);
  to.scale = static_cast<float>(scale);
  to.left = static_cast<float>(pixels / 2.0 - dot(center, right) * scale);
  to.top = static_cast<float>(pixels / 2.0 + dot(center, up) * scale);
  to.width = to.height = pixels;
  to.first = first;
  return to;
}

std::vector<Picture> make_pictures(const Source::Impl& source, const std::vector<ViewAngles>& views,
                                   const PictureGrid& grid) {
  const Mesh box = bounding_box_mesh(source);
  const CameraTarget target = CameraTarget::of(box);
  std::vector<Picture> pictures;
  for (const ViewAngles& view : views) {
    RenderOptions options;
    options.azimuth_degrees = view.azimuth_degrees;
    options.elevation_degrees = view.elevation_degrees;
    pictures.emplace_back(Camera::fit(target, options), source.frame, grid.pixels);
  }
  if (grid.pixels_on_screen == 0) return pictures;
  const std::vector<Vec3d> positions = used_positions(source);
  parallel_for(pictures.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Picture& picture = pictures[i];
      fit_closely(positions, picture);
      picture.subpixels = kScreenSubpixels;
      picture.pixel_footprint = 2 * picture.half_side / grid.pixels_on_screen;
    }
  });
  return pictures;
}

/// The nearest triangle of a mesh at every point.
PictureHits cast_hits(cl::Context& context, const RayCaster& rays,
                      const std::vector<Picture>& pictures, double start) {
  const std::uint32_t points_per_picture = pictures[0].points();
  const auto count = static_cast<std::uint32_t>(points_per_picture * pictures.size());
  std::vector<float> points(std::size_t{7} * count, 0.0F);
  parallel_for(count, kPointsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Picture& picture = pictures[i / points_per_picture];
      const Vec3d point = picture.point(static_cast<std::uint32_t>(i % points_per_picture));
      const Vec3 p = to_float(point + picture.toward * (start - dot(point, picture.toward)));
      const Vec3 d = to_float(picture.toward * -1.0);
      const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
      for (std::size_t c = 0; c < 6; ++c) points[c * count + i] = values[c];
    }
  });
  const cl::Array<float> device_points(context, std::span<const float>(points));
  DeviceCorrespondence match(context, count);
  RayQuery query;
  query.t_max = static_cast<float>(2 * start);
  query.two_sided = true;
  rays.intersect(device_points, count, count, query, match);
  PictureHits hits{std::vector<std::uint32_t>(count), std::vector<float>(std::size_t{2} * count)};
  match.triangle.read(context, hits.triangle);
  match.barycentric.read(context, hits.barycentric);
  return hits;
}

/// Computes the hits of the high poly by rasterization, without barycentric coordinates, which follow from the pixel.
/// \param needed  true for each picture that is rasterized; the others remain empty
PictureHits rasterize_hits(const Source::Impl& source, const std::vector<Picture>& pictures,
                           const std::vector<bool>& needed) {
  cl::Context& context = context_of(source.device);
  const std::uint32_t pixels = pictures[0].pixels;
  const auto keys_each = static_cast<std::uint32_t>(DepthKeys::count(pixels, pixels));
  std::vector<kiln_view> views;
  std::vector<std::size_t> picture_of_raster_view;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (!needed[i]) continue;
    views.push_back(pictures[i].view(static_cast<std::uint32_t>(views.size()) * keys_each));
    picture_of_raster_view.push_back(i);
  }
  PictureHits hits;
  const std::size_t points_per_picture = std::size_t{pixels} * pixels;
  hits.triangle.assign(points_per_picture * pictures.size(), KILN_NO_TRIANGLE);
  if (views.empty()) return hits;
  const DepthKeys keys(context, std::uint64_t{keys_each} * views.size());
  source.raster().draw(views, keys);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const std::vector<std::uint64_t> rows = keys.picture(context, views[v]);
    for (std::uint32_t i = 0; i < points_per_picture; ++i) {
      const std::uint32_t tile = i / (kTileSide * kTileSide),
                          index_in_tile = i % (kTileSide * kTileSide);
      const std::uint32_t x = tile % (pixels / kTileSide) * kTileSide + index_in_tile % kTileSide;
      const std::uint32_t y = tile / (pixels / kTileSide) * kTileSide + index_in_tile / kTileSide;
      const std::uint64_t key = rows[std::size_t{y} * pixels + x];
      if (key == KILN_RASTER_EMPTY) continue;
      hits.triangle[points_per_picture * picture_of_raster_view[v] + i] =
          static_cast<std::uint32_t>(key);
    }
  }
  return hits;
}

/// The high poly's shading normal where a pixel's ray hits a triangle, flipped towards the viewer.
Vec3d high_poly_normal(const Source::Impl& source, const std::vector<std::uint32_t>& normal_indices,
                       const std::vector<float>& normals, const Picture& picture,
                       const Vec3d& pixel, std::uint32_t triangle) {
  std::array<Vec3d, 3> corners{};
  std::array<std::array<double, 2>, 3> projected_corners;
  for (std::size_t k = 0; k < 3; ++k) {
    corners[k] = to_double(source.positions[source.triangles[triangle][k]]) - pixel;
    projected_corners[k] = {dot(corners[k], picture.right), dot(corners[k], picture.up)};
  }
  const auto area = [&](std::size_t a, std::size_t b) {
    return projected_corners[a][0] * projected_corners[b][1] -
           projected_corners[b][0] * projected_corners[a][1];
  };
  const double weights[3] = {area(1, 2), area(2, 0), area(0, 1)};
  const double weight_sum = weights[0] + weights[1] + weights[2];
  const Vec3d face = cross(corners[1] - corners[0], corners[2] - corners[0]);
  Vec3d sum{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float* n = &normals[3 * std::size_t{normal_indices[3 * std::size_t{triangle} + k]}];
    sum += Vec3d(n[0], n[1], n[2]) * (weights[k] / weight_sum);
  }
  double size = length(sum);
  if (!(size > 0)) {
    sum = face;
    size = length(face);
  }
  return sum * ((dot(face, picture.toward) < 0 ? -1 : 1) / size);
}

}  // namespace kiln
