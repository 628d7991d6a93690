#include "accel/raster.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "accel/raster_chunks.h"
#include "base/parallel.h"
#include "cl/tuning.h"
#include "kiln/error.h"

namespace kiln {
namespace {

// Bounds the duration of a launch.
constexpr std::uint32_t kItemsPerLaunch = 1U << 22;
constexpr std::size_t kViewsPerLaunch = 16;
// Maximum memory of one launch's boxes: meshes with very many chunks use fewer views per launch.
constexpr std::size_t kMaxBoxBytes = 32U << 20;

/// Two unit vectors perpendicular to `toward`, the second one pointing up (+Y) if possible.
void make_basis(const Vec3d& toward, Vec3d& right, Vec3d& up) {
  const Vec3d pole = std::abs(toward.y) < 0.99 ? Vec3d{0, 1, 0} : Vec3d{0, 0, -1};
  right = cross(pole, toward);
  right = right * (1 / length(right));
  up = cross(toward, right);
}

void store_vector(const Vec3d& from, kiln_float to[3]) {
  to[0] = static_cast<float>(from.x);
  to[1] = static_cast<float>(from.y);
  to[2] = static_cast<float>(from.z);
}

RasterPath choose_path(const cl::Context& context, RasterPath requested_path) {
  const DeviceInfo& info = context.info();
  // On Mesa's rusticl, tiles.cl draws incorrect pictures and is 160 times slower (40 KiB of private
  // memory per item); in the other paths its 64-bit arithmetic is incorrect for large triangles.
  const bool is_mesa = info.platform.find("rusticl") != std::string::npos;
  if (requested_path == RasterPath::automatic && !info.is_gpu && !is_mesa) return RasterPath::tiles;
  if (requested_path == RasterPath::automatic || requested_path == RasterPath::atomics) {
    return info.has_atomics_64 ? RasterPath::atomics : RasterPath::two_passes;
  }
  return requested_path;
}

}  // namespace

double radius_in_views(const TriangleBlocks& mesh) {
  std::vector<double> largest_of_blocks(mesh.size() + 1, 0.0);
  mesh.for_each([&](std::size_t block, std::span<const Triangle> triangles) {
    double largest_squared = 0;
    for (const Triangle& triangle : triangles) {
      for (const std::uint32_t i : triangle) {
        const Vec3& position = mesh.positions()[i];
        const Vec3d p = to_double(position);
        const double squared = dot(p, p);
        if (is_in_views(position)) largest_squared = std::max(largest_squared, squared);
      }
    }
    largest_of_blocks[block] = largest_squared;
  });
  return std::sqrt(*std::max_element(largest_of_blocks.begin(), largest_of_blocks.end()));
}

std::vector<std::uint64_t> DepthKeys::picture(cl::Context& context, const kiln_view& view) const {
  const std::uint64_t stored = count(view.width, view.height);
  std::vector<std::uint64_t> tile_keys(stored);
  std::vector<std::uint8_t> is_tile_drawn(stored / KILN_RASTER_TILE_PIXELS);
  keys.read(context, tile_keys, view.first);
  drawn.read(context, is_tile_drawn, view.first / KILN_RASTER_TILE_PIXELS);
  std::vector<std::uint64_t> result(std::size_t{view.width} * view.height);
  constexpr std::uint32_t kTileSide = KILN_RASTER_TILE;
  for (std::uint32_t y = 0; y < view.height; ++y) {
    for (std::uint32_t x = 0; x < view.width; ++x) {
      const std::size_t tile =
          std::size_t{y / kTileSide} * KILN_RASTER_TILES(view.width) + x / kTileSide;
      result[std::size_t{y} * view.width + x] =
          is_tile_drawn[tile] != 0
              ? tile_keys[(tile * kTileSide + y % kTileSide) * kTileSide + x % kTileSide]
              : KILN_RASTER_EMPTY;
    }
  }
  return result;
}

kiln_view make_view(const Vec3d& toward, double radius, std::uint32_t size, const Vec3d& center) {
  Vec3d right{};
  Vec3d up{};
  make_basis(toward, right, up);
  kiln_view view{};
  store_vector(right, view.right);
  store_vector(up, view.up);
  store_vector(toward, view.toward);
  // A margin of one pixel on each side allows for snapping, and for samples just outside the silhouette.
  const double inner_size = size > 4 ? size - 2.0 : size;
  const double scale = inner_size / (2 * radius);
  view.scale = static_cast<float>(scale);
  view.left = static_cast<float>(size / 2.0 - dot(right, center) * scale);
  view.top = static_cast<float>(size / 2.0 + dot(up, center) * scale);
  view.width = view.height = size;
  return view;
}

Rasterizer::Rasterizer(cl::Context& context, std::span<const Vec3> positions,
                       std::span<const Triangle> triangles, RasterPath path)
    : context_(context),
      vertex_count_(static_cast<std::uint32_t>(positions.size())),
      triangle_count_(static_cast<std::uint32_t>(triangles.size())),
      radius_(radius_in_views({positions, triangles})),
      path_(choose_path(context, path)) {
  static_assert(sizeof(Vec3) == 12 && sizeof(Triangle) == 12);
  mesh_->positions = cl::Array<float>(
      context, std::span(reinterpret_cast<const float*>(positions.data()), positions.size() * 3));
  mesh_->triangles = cl::Array<std::uint32_t>(
      context,
      std::span(reinterpret_cast<const std::uint32_t*>(triangles.data()), triangles.size() * 3));
  if (path_ == RasterPath::tiles) {
    upload_chunks(positions, triangles);
  } else {
    projected_ = cl::Array<std::int32_t>(context, positions.size() * 4);
    queue_size_ = cl::Array<std::uint32_t>(context, 1);
    queue_ = cl::Array<std::uint32_t>(context, triangles.size() * 4);
  }
}

void Rasterizer::upload_chunks(std::span<const Vec3> positions,
                               std::span<const Triangle> triangles) {
  const std::vector<RasterChunks> pieces = make_raster_chunks(positions, triangles);
  std::size_t groups = 0;
  for (const RasterChunks& piece : pieces) groups += piece.bounds.size();
  chunks_ = cl::Array<kiln_raster_chunk>(context_, groups * KILN_RASTER_BOXES);
  bounds_ = cl::Array<kiln_raster_bounds>(context_, groups);
  std::size_t first = 0;
  for (const RasterChunks& piece : pieces) {
    chunks_.write(context_, piece.chunks, first * KILN_RASTER_BOXES);
    bounds_.write(context_, piece.bounds, first);
    first += piece.bounds.size();
  }
}

void Rasterizer::draw(std::span<const kiln_view> views, const DepthKeys& keys) {
  for (const kiln_view& view : views) {
    if (view.width > KILN_RASTER_LARGEST || view.height > KILN_RASTER_LARGEST ||
        view.width != views.front().width || view.height != views.front().height ||
        view.first % KILN_RASTER_TILE_PIXELS != 0 ||
        view.first + DepthKeys::count(view.width, view.height) > keys.keys.size()) {
      throw Error(ErrorCode::internal,
                  "The array of keys is smaller than a depth view, or the views differ in size.");
    }
  }
  const std::lock_guard lock(drawing_mutex_);
  if (path_ == RasterPath::tiles) {
    draw_tiles(views, keys);
  } else {
    for (const kiln_view& view : views) draw_triangles(view, keys);
  }
}

void Rasterizer::draw_tiles(std::span<const kiln_view> views, const DepthKeys& keys) {
  if (views.empty()) return;
  const auto groups = static_cast<std::uint32_t>(bounds_.size());
  const std::uint32_t padded =
      (groups + KILN_RASTER_BOXES - 1) / KILN_RASTER_BOXES * KILN_RASTER_BOXES;
  const std::size_t view_bytes = std::max<std::size_t>(groups, 1) * sizeof(kiln_raster_boxes);
  const std::size_t batch = std::min(
      views.size(), std::clamp<std::size_t>(kMaxBoxBytes / view_bytes, 1, kViewsPerLaunch));
  if (boxes_.size() < batch * groups) {
    boxes_ = cl::Array<kiln_raster_boxes>(context_, batch * groups);
    group_boxes_ = cl::Array<kiln_raster_boxes>(context_, batch * padded / KILN_RASTER_BOXES);
  }
  const auto tiles = static_cast<std::uint32_t>(
      DepthKeys::count(views.front().width, views.front().height) / KILN_RASTER_TILE_PIXELS);
  for (std::size_t first = 0; first < views.size(); first += batch) {
    const auto count = static_cast<std::uint32_t>(std::min(batch, views.size() - first));
    const cl::Array<kiln_view> batch_views(context_, views.subspan(first, count));
    context_.launch(context_.kernel("tiles", "kiln_tiles_compute_bounds"),
                    std::size_t{count} * padded, kLocal, count, groups, padded, batch_views,
                    bounds_, boxes_, group_boxes_);
    context_.launch(context_.kernel("tiles", "kiln_tiles_draw"), std::size_t{count} * tiles, 1,
                    count * tiles, groups, padded, batch_views, boxes_, group_boxes_, chunks_,
                    keys.keys, keys.drawn);
    context_.finish();  // waits, since the device still reads `batch_views`
  }
}

void Rasterizer::draw_triangles(const kiln_view& view, const DepthKeys& keys) {
  const bool atomic64 = path_ == RasterPath::atomics;
  const std::string defines = atomic64 ? "-DKILN_RASTER_ATOMIC64=1" : "";
  const auto kernel = [&](const char* name) { return context_.kernel("raster", name, defines); };
  const auto count = static_cast<std::uint32_t>(DepthKeys::count(view.width, view.height));
  context_.launch(kernel("kiln_raster_clear"), count / 8, kLocal, view.first, count, keys.keys,
                  keys.drawn);
  context_.launch(kernel("kiln_raster_project"), vertex_count_, kLocal, view, vertex_count_,
                  mesh_->positions, projected_);
  context_.fill(queue_size_, std::uint32_t{0});
  // Without 64-bit atomics, one pass writes the nearest depths, a second one the lowest triangle index at each depth.
  for (std::uint32_t pass = 0; pass < (atomic64 ? 1U : 2U); ++pass) {
    for (std::uint32_t first = 0; first < triangle_count_; first += kItemsPerLaunch) {
      const std::uint32_t batch_count = std::min(kItemsPerLaunch, triangle_count_ - first);
      const cl::Kernel small = kernel("kiln_raster_draw_small");
      context_.launch(small, batch_count,
                      context_.group_size(small, context_.tuning().raster_group, kLocal), view,
                      first, batch_count, pass, mesh_->triangles, projected_, keys.keys,
                      queue_size_, queue_);
    }
    context_.launch(kernel("kiln_raster_draw_large"), kLocal * KILN_RASTER_BANDS, kLocal, view,
                    pass, mesh_->triangles, projected_, keys.keys, queue_size_, queue_);
  }
}

}  // namespace kiln
