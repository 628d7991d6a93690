#include "match/view_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "accel/raster_chunks.h"
#include "base/parallel.h"
#include "mesh/box.h"

namespace kiln {
namespace {

// maximum cosine between a steep face and the view: 84 degrees
constexpr double kMaxSteepCosine = 0.1;
constexpr double kMaxSteepAreaShare =
    0.02;  // maximum share of the low poly's area that may be steep

// Number of pixels in the area of the median triangle. With 4, the triangle under a sample is nearly always
// among those of the four surrounding pixels.
constexpr double kPixelsPerTriangle = 4;
// Number of candidate directions: one of them is within 15 degrees of any direction.
constexpr std::uint32_t kCandidateViews = 96;
constexpr std::uint32_t kProbeViewSide = 512;

/// Area of a triangle; 0 for triangles that views ignore.
double area_of(std::span<const Vec3> positions, const Triangle& triangle) {
  if (!is_in_views(positions[triangle[0]]) || !is_in_views(positions[triangle[1]]) ||
      !is_in_views(positions[triangle[2]])) {
    return 0;
  }
  const Vec3d a = to_double(positions[triangle[0]]);
  const Vec3d n =
      cross(to_double(positions[triangle[1]]) - a, to_double(positions[triangle[2]]) - a);
  const double area = length(n) / 2;
  return std::isfinite(area) ? area : 0;
}

/// Histogram of the surface's area by the logarithm of the triangles' areas.
struct AreaHistogram {
  static constexpr int kBins = 256;
  std::array<double, kBins> sum{};
  double histogram_area = 0;

  static int area_bin(double area) {
    return std::clamp(static_cast<int>(std::floor(2 * std::log2(area))) + 200, 0, kBins - 1);
  }
  /// Lower bound of a bin's areas.
  static double area_at(int bin) { return std::exp2((bin - 200) / 2.0); }

  explicit AreaHistogram(const TriangleBlocks& mesh) {
    std::vector<std::array<double, kBins>> block_histograms(mesh.size());
    mesh.for_each([&](std::size_t number, std::span<const Triangle> triangles) {
      auto& block = block_histograms[number];
      for (const Triangle& triangle : triangles) {
        const double area = area_of(mesh.positions(), triangle);
        if (area > 0) block[static_cast<std::size_t>(area_bin(area))] += area;
      }
    });
    for (const auto& block : block_histograms) {
      for (std::size_t i = 0; i < kBins; ++i) sum[i] += block[i];
    }
    histogram_area = std::accumulate(sum.begin(), sum.end(), 0.0);
  }

  /// Share of the surface whose triangles are smaller than a pixel of this side.
  double area_share_below(double pixel) const {
    double small_area = 0;
    for (int i = 0; i < kBins; ++i) {
      if (area_at(i) < pixel * pixel) small_area += sum[static_cast<std::size_t>(i)];
    }
    return histogram_area > 0 ? small_area / histogram_area : 0;
  }
};

}  // namespace

double undersampled_share(const TriangleBlocks& mesh, double radius, std::uint32_t size) {
  return AreaHistogram(mesh).area_share_below(2 * radius / size);
}

ViewSize choose_view_size(const TriangleBlocks& mesh, double radius, std::uint32_t limit) {
  const AreaHistogram area_histogram(mesh);
  // Finds the area-weighted median triangle.
  double area_below = 0;
  int median = 0;
  for (; median < AreaHistogram::kBins - 1; ++median) {
    area_below += area_histogram.sum[static_cast<std::size_t>(median)];
    if (area_below * 2 >= area_histogram.histogram_area) break;
  }
  const double target_size =
      2 * radius * std::sqrt(kPixelsPerTriangle / AreaHistogram::area_at(median));
  const double rounded = std::ceil(std::min(target_size, 65536.0) / 256) * 256;
  ViewSize result;
  result.size = std::min(limit, static_cast<std::uint32_t>(std::max(1024.0, rounded)));
  result.undersampled = area_histogram.area_share_below(2 * radius / result.size);
  return result;
}

ViewArea view_area(const LowSurface& surface, double reach, double dense_radius) {
  Box<Vec3d> box;
  const auto for_each_corner = [&](const auto& body) {
    for (const std::size_t i : surface.usable_triangles()) {
      for (const LowSurface::Corner& corner : surface.triangles[i])
        body(to_double(corner.position));
    }
  };
  for_each_corner([&](const Vec3d& p) { box.add(p); });
  ViewArea area{box.center(), 0};
  for_each_corner(
      [&](const Vec3d& p) { area.radius = std::max(area.radius, length(p - area.center)); });
  area.radius += reach;
  // Usually both meshes have the same extent, and the pictures then show all of the high poly for any reach.
  if (area.radius > 0.8 * dense_radius) return {{}, dense_radius};
  return area;
}

void widen_view_area(ViewArea& area, double dense_radius, std::uint32_t size) {
  const double min_radius = dense_radius * size / 60000;
  area.radius = std::max(area.radius, min_radius);
}

std::optional<Vec3d> height_field_direction(const TriangleBlocks& mesh, const LowSurface& surface) {
  const std::span<const Vec3> positions = mesh.positions();
  const auto normal_of = [&](const Triangle& t) {
    const Vec3d a = to_double(positions[t[0]]);
    const Vec3d n = cross(to_double(positions[t[1]]) - a, to_double(positions[t[2]]) - a);
    return std::isfinite(dot(n, n)) ? n : Vec3d{};
  };
  // Sums are computed per block, so that they do not depend on the number of threads.
  std::vector<Vec3d> sums(mesh.size());
  mesh.for_each([&](std::size_t block, std::span<const Triangle> triangles) {
    for (const Triangle& triangle : triangles) sums[block] += normal_of(triangle);
  });
  Vec3d mean{};
  for (const Vec3d& sum : sums) mean += sum;
  if (!(length(mean) > 0)) return std::nullopt;
  mean = mean * (1 / length(mean));
  // Directions that are almost along an axis are snapped to it.
  for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
    if (std::abs(dot(axis, mean)) > 0.99) mean = axis * std::copysign(1.0, dot(axis, mean));
  }
  std::vector<std::uint8_t> has_turned_away(mesh.size(), 0);
  mesh.for_each([&](std::size_t block, std::span<const Triangle> triangles) {
    const auto is_turned_away = [&](const Triangle& t) { return dot(normal_of(t), mean) < 0; };
    if (std::any_of(triangles.begin(), triangles.end(), is_turned_away)) has_turned_away[block] = 1;
  });
  if (std::find(has_turned_away.begin(), has_turned_away.end(), 1) != has_turned_away.end())
    return std::nullopt;
  // A single view shows all of a height field, but resolves steep walls badly, so steep walls may
  // only have a small share of the area.
  double steep_area = 0, total_area = 0;
  for (const std::size_t i : surface.usable_triangles()) {
    const auto& [a, b, c] = surface.triangles[i];
    const Vec3d face = cross(to_double(b.position) - to_double(a.position),
                             to_double(c.position) - to_double(a.position));
    double min_cosine = dot(face, mean) / length(face);
    for (const LowSurface::Corner& corner : surface.triangles[i]) {
      min_cosine = std::min(min_cosine, dot(to_double(corner.normal), mean));
    }
    if (!(min_cosine > 0)) return std::nullopt;
    if (min_cosine < kMaxSteepCosine) steep_area += length(face);
    total_area += length(face);
  }
  return steep_area <= kMaxSteepAreaShare * total_area ? std::optional(mean) : std::nullopt;
}

ViewPlan plan_views(const Source::Impl& source, const cl::Array<float>& points, std::uint32_t count,
                    std::uint32_t capacity, const ViewQuery& query,
                    const std::vector<Vec3d>& given_views, double least_gain, std::uint32_t limit) {
  cl::Context& context = context_of(source.device);
  std::vector<Vec3d> candidates = given_views;
  const std::vector<Vec3d> spread = spread_directions(kCandidateViews);
  candidates.insert(candidates.end(), spread.begin(), spread.end());

  // quality[k * count + i]: the cosine between candidate k and the direction of sample i if the
  // candidate sees the sample, else 0.
  std::vector<float> view_quality(candidates.size() * count);
  ViewedSurface& surface = source.viewed_surface();
  // A streamed surface is read once for each batch.
  const std::uint32_t batch = std::min({source.is_streamed() ? kCandidateViews : 32U,
                                        DepthViews::batch_size(context, kProbeViewSide),
                                        surface.views_at_once(kProbeViewSide)});
  const cl::Array<float> found(context, std::size_t{batch} * count);
  for (std::size_t first = 0; first < candidates.size(); first += batch) {
    const std::size_t last = std::min(candidates.size(), first + batch);
    const DepthViews views(context, surface,
                           {candidates.begin() + static_cast<std::ptrdiff_t>(first),
                            candidates.begin() + static_cast<std::ptrdiff_t>(last)},
                           kProbeViewSide, query.two_sided, query.area, ViewUse::probe);
    views.probe(points, count, capacity, query, found);
    found.read(context, std::span(view_quality).subspan(first * count, (last - first) * count));
  }

  std::vector<float> best(count, 0.0F);
  std::vector<bool> is_view_used(candidates.size(), false);
  std::vector<double> view_gains(candidates.size());
  double max_total_quality = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    float max_gain = 0;
    for (std::size_t k = 0; k < candidates.size(); ++k)
      max_gain = std::max(max_gain, view_quality[k * count + i]);
    max_total_quality += max_gain;
  }
  ViewPlan plan;
  while (plan.directions.size() < limit && max_total_quality > 0) {
    parallel_for(candidates.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        double gain = 0;
        for (std::uint32_t i = 0; i < count; ++i) {
          gain += std::max(0.0F, view_quality[k * count + i] - best[i]);
        }
        view_gains[k] = is_view_used[k] ? 0 : gain;
      }
    });
    // The caller's own views come first, regardless of their gain.
    const std::size_t next =
        plan.directions.size() < given_views.size()
            ? plan.directions.size()
            : static_cast<std::size_t>(std::max_element(view_gains.begin(), view_gains.end()) -
                                       view_gains.begin());
    if (plan.directions.size() >= given_views.size() &&
        view_gains[next] < least_gain * max_total_quality)
      break;
    is_view_used[next] = true;
    plan.directions.push_back(candidates[next]);
    std::uint32_t seen = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      best[i] = std::max(best[i], view_quality[next * count + i]);
      seen += best[i] > 0 ? 1 : 0;
    }
    plan.coverage.push_back(static_cast<double>(seen) / count);
  }
  return plan;
}

}  // namespace kiln
