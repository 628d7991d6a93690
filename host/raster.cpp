#include "raster.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "kiln/error.h"
#include "parallel.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;
// Bounds the work of one launch.
constexpr std::uint32_t kPerLaunch = 1U << 22;

/// Any two unit vectors across `toward`, the second upwards (+Y) where there is such a direction.
void basis(const Vec3d& toward, Vec3d& right, Vec3d& up) {
  const Vec3d pole = std::abs(toward.y) < 0.99 ? Vec3d{0, 1, 0} : Vec3d{0, 0, -1};
  right = cross(pole, toward);
  right = right * (1 / length(right));
  up = cross(toward, right);
}

void store(const Vec3d& from, kiln_float to[3]) {
  to[0] = static_cast<float>(from.x);
  to[1] = static_cast<float>(from.y);
  to[2] = static_cast<float>(from.z);
}

double squared_radius(std::span<const Vec3> positions, std::span<const Triangle> triangles) {
  std::vector<double> parts((triangles.size() >> 16) + 1, 0.0);
  parallel_for(triangles.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    double largest = 0;
    for (std::size_t t = begin; t < end; ++t) {
      for (const std::uint32_t i : triangles[t]) {
        const Vec3d p(positions[i]);
        const double squared = dot(p, p);
        if (std::isfinite(squared)) largest = std::max(largest, squared);
      }
    }
    parts[begin >> 16] = largest;
  });
  return *std::max_element(parts.begin(), parts.end());
}

}  // namespace

kiln_view make_view(const Vec3d& toward, double radius, std::uint32_t size) {
  Vec3d right;
  Vec3d up;
  basis(toward, right, up);
  kiln_view view{};
  store(right, view.right);
  store(up, view.up);
  store(toward, view.toward);
  // A pixel of margin on each side, for the snapping and for samples just beside the silhouette.
  const double inner = size > 4 ? size - 2.0 : size;
  view.scale = static_cast<float>(inner / (2 * radius));
  view.left = view.top = static_cast<float>(size) / 2;
  view.width = view.height = size;
  return view;
}

Rasterizer::Rasterizer(cl::Context& context, std::span<const Vec3> positions,
                       std::span<const Triangle> triangles, bool two_passes)
    : context_(context),
      vertex_count_(static_cast<std::uint32_t>(positions.size())),
      triangle_count_(static_cast<std::uint32_t>(triangles.size())),
      radius_(std::sqrt(squared_radius(positions, triangles))),
      atomic64_(context.info().has_atomics_64 && !two_passes) {
  static_assert(sizeof(Vec3) == 12 && sizeof(Triangle) == 12);
  positions_ = cl::Array<float>(
      context, std::span(reinterpret_cast<const float*>(positions.data()), positions.size() * 3));
  triangles_ = cl::Array<std::uint32_t>(
      context,
      std::span(reinterpret_cast<const std::uint32_t*>(triangles.data()), triangles.size() * 3));
  projected_ = cl::Array<std::int32_t>(context, positions.size() * 4);
  queue_size_ = cl::Array<std::uint32_t>(context, 1);
  queue_ = cl::Array<std::uint32_t>(context, triangles.size() * 4);
}

void Rasterizer::draw(const kiln_view& view, const cl::Array<std::uint64_t>& keys) {
  const std::size_t pixels = std::size_t{view.width} * view.height;
  if (view.width > KILN_RASTER_LARGEST || view.height > KILN_RASTER_LARGEST ||
      view.first + pixels > keys.size()) {
    throw Error(ErrorCode::internal, "A depth view does not fit its keys.");
  }
  const std::string defines = atomic64_ ? "-DKILN_RASTER_ATOMIC64=1" : "";
  const auto kernel = [&](const char* name) { return context_.kernel("raster", name, defines); };
  const auto pixel_count = static_cast<std::uint32_t>(pixels);
  context_.launch(kernel("kiln_raster_clear"), (pixels + 7) / 8, kLocal, view.first, pixel_count,
                  keys);
  context_.launch(kernel("kiln_raster_project"), vertex_count_, kLocal, view, vertex_count_,
                  positions_, projected_);
  context_.fill(queue_size_, std::uint32_t{0});
  // Without 64-bit atomics: depths first, then the triangles that have them.
  for (std::uint32_t pass = 0; pass < (atomic64_ ? 1U : 2U); ++pass) {
    for (std::uint32_t first = 0; first < triangle_count_; first += kPerLaunch) {
      const std::uint32_t count = std::min(kPerLaunch, triangle_count_ - first);
      context_.launch(kernel("kiln_raster_small"), count, kLocal, view, first, count, pass,
                      triangles_, projected_, keys, queue_size_, queue_);
    }
    context_.launch(kernel("kiln_raster_large"), kLocal * KILN_RASTER_BANDS, kLocal, view, pass,
                    triangles_, projected_, keys, queue_size_, queue_);
  }
}

}  // namespace kiln
