#include "bake/high_coverage.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>
#include <utility>

#include "accel/closest.h"
#include "accel/depth_views.h"
#include "accel/low_tree.h"
#include "accel/ray.h"
#include "bake/coverage_slabs.h"
#include "base/byte_hash.h"
#include "base/parallel.h"
#include "match/ray.h"
#include "mesh/box.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

// Number of directions per test point, and its minimum. If rays visit more than kMaxMeanLeaves
// leaves on average, as in fans of needles, fewer directions are used, so that the cost is bounded.
constexpr std::uint32_t kDirections = 64, kMinDirections = 8;
constexpr double kMaxMeanLeaves = 1000;
constexpr double kMinFaceCosine = 0.5;  // minimum cosine between a ray and the low poly's face
// Radius around a sample in which it covers test points, in sample spacings
constexpr double kRadiusInSamples = 1.5;
// Ray origins are moved towards the centre of their triangle by this share of the distance to it
constexpr double kOriginInset = 1.0 / 256;
// Radius in frame units in which the point that the match finds for a UV copy covers test points
constexpr double kCopyRadius = 0.01;
constexpr float kOriginOffset = 1e-5F;  // Offset of ray origins from their face, in frame units
// Ray length in frame units, which reaches beyond the high poly
constexpr float kRayLength = 4;
constexpr std::size_t kTestPointsPerTask = 1 << 14;
constexpr std::size_t kBloomFilterBits = 1 << 20;
constexpr std::size_t kRaysPerLaunch = 1 << 20;  // maximum number of rays in one launch
// factor that widens radii by more than rounding errors
constexpr double kRadiusWidening = 1.0001;
// Minimum number of samples, per triangle with test points and per triangle of the mesh, for
// culling by triangles to be worthwhile. Its cost is a pass over all triangles, even if a texture
// set uses few of them.
constexpr double kMinSamplesToCull = 16, kMinSamplesPerTriangleToCull = 0.125;
// Tolerance for points that lie slightly outside of their triangle, as a share of the length of its sides
constexpr float kTriangleSlack = 1e-3F;
// Maximum length of a triangle's list of test points. If more test points lie within the search
// distance of the triangle, the grid is searched instead
constexpr std::size_t kMaxListedTestPoints = 16;
// States of a triangle of the high poly. kNoTestPointsState: no uncovered test point is within the
// search distance. kSearchGridState: test points are found by the grid. From kFirstListState on:
// index of the list of the test points within the search distance.
constexpr std::uint32_t kNoTestPointsState = 0, kSearchGridState = 1, kFirstListState = 2;

Vec3d face_normal(const Source::Impl& high, const Triangle& t) {
  const Vec3d a = to_double(high.positions[t[0]]);
  return cross(to_double(high.positions[t[1]]) - a, to_double(high.positions[t[2]]) - a);
}

Box<Vec3d> triangle_box(const Source::Impl& high, const Triangle& t) {
  Box<Vec3d> box;
  for (const std::uint32_t corner : t) box.add(to_double(high.positions[corner]));
  return box;
}

/// The i-th number of a low-discrepancy sequence on [0, 1).
double low_discrepancy_number(std::uint64_t i, double step) {
  const double x = static_cast<double>(i) * step;
  return x - std::floor(x);
}

/// Makes a device array of samples that only holds what searches read: positions and directions.
cl::Array<float> device_samples(cl::Context& context,
                                const std::vector<HighCoverage::TestPoint>& rays) {
  const std::size_t count = rays.size();
  std::vector<float> sample_planes(7 * count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [p, d] = rays[i];
    const float values[6] = {p.x, p.y, p.z, d.x, d.y, d.z};
    for (std::size_t k = 0; k < 6; ++k) sample_planes[k * count + i] = values[k];
  }
  return {context, std::span<const float>(sample_planes)};
}

/// A face of the low poly.
struct LowPolyFace {
  Vec3d corner{}, ab{}, ac{};  ///< First corner, and the edges to the other corners
  double step = 0;             ///< Distance between samples, frame units; 0 without UVs

  LowPolyFace(const std::array<LowSurface::Corner, 3>& corners, double columns, double rows)
      : corner(to_double(corners[0].position)),
        ab(to_double(corners[1].position) - corner),
        ac(to_double(corners[2].position) - corner) {
    const auto& [a, b, c] = corners;
    const double bu = double{b.uv.x} - a.uv.x, bv = double{b.uv.y} - a.uv.y;
    const double cu = double{c.uv.x} - a.uv.x, cv = double{c.uv.y} - a.uv.y;
    const double area = bu * cv - bv * cu;
    // Distances on the surface between neighbouring samples along u and along v.
    const double along_u = length(ab * cv - ac * bv), along_v = length(ac * bu - ab * cu);
    const double mean = (along_u / columns + along_v / rows) / (2 * std::abs(area));
    step = std::isfinite(mean) ? mean : 0;
  }
};

/// The nearest triangle of the low poly for each test point; cached for all texture sets.
struct NearestLowFaces {
  std::uint64_t input_hash =
      0;  ///< Hash of the test points and the search distance, to validate the cache
  std::vector<std::uint32_t> triangle;
};

/// Result of HighCoverage::spread_test_points() for a number of test points; cached for all texture
/// sets.
struct SpreadTestPoints {
  std::uint32_t count = 0;
  HighCoverage::TestPoints test_points;
};

/// Maximum distance from the low poly at which samples can find points.
double search_distance(const MatchRequest& request) {
  if (request.cage) return std::max(*request.cage, request.distance - *request.cage);
  return request.cage_mesh ? request.distance / 2 : request.distance;
}

}  // namespace

HighCoverage::TestPoints HighCoverage::spread_test_points(const Source::Impl& high,
                                                          std::uint32_t count) {
  const auto cached_test_points = high.by_positions()->get<SpreadTestPoints>([&] {
    return SpreadTestPoints{count, make_spread_test_points(high, count)};
  });
  return cached_test_points->count == count ? cached_test_points->test_points
                                            : make_spread_test_points(high, count);
}

HighCoverage::TestPoints HighCoverage::make_spread_test_points(const Source::Impl& high,
                                                               std::uint32_t count) {
  std::vector<double> area(high.triangles.size());
  parallel_for(area.size(), kTestPointsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const double size = length(face_normal(high, high.triangles[t]));
      area[t] = std::isfinite(size) ? size : 0;
    }
  });
  const double total_area = std::accumulate(area.begin(), area.end(), 0.0);
  TestPoints test_points;
  test_points.spacing =
      std::sqrt(total_area / 2 / std::max(count, 1U));  // total_area is twice the area
  double area_before_triangle = 0;
  std::size_t t = 0;
  for (std::uint32_t i = 0; i < count && total_area > 0; ++i) {
    const double target_area = total_area * (i + 0.5) / count;
    while (t + 1 < area.size() && area_before_triangle + area[t] <= target_area)
      area_before_triangle += area[t++];
    if (!(area[t] > 0)) continue;
    // Barycentric coordinates, distributed evenly over the triangle.
    double u = low_discrepancy_number(i, 0.7548776662466927),
           v = low_discrepancy_number(i, 0.5698402909980532);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Triangle& corners = high.triangles[t];
    const Vec3d a = to_double(high.positions[corners[0]]),
                b = to_double(high.positions[corners[1]]),
                c = to_double(high.positions[corners[2]]);
    const Vec3d normal = face_normal(high, corners);
    test_points.list.push_back(
        {to_float(a + (b - a) * u + (c - a) * v), to_float(normal * (1 / area[t]))});
  }
  return test_points;
}

HighCoverage::TestPoints HighCoverage::make_vertex_test_points(const Source::Impl& high) {
  std::vector<Vec3d> normals(high.positions.size());
  for (const Triangle& t : high.triangles) {
    const Vec3d normal = face_normal(high, t);
    if (!std::isfinite(length(normal))) continue;
    for (const std::uint32_t corner : t) normals[corner] = normals[corner] + normal;
  }
  TestPoints test_points;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const double size = length(normals[i]);
    test_points.list.push_back(
        {high.positions[i], size > 0 ? to_float(normals[i] * (1 / size)) : Vec3{}});
  }
  return test_points;
}

HighCoverage::HighCoverage(const MatchRequest& request, TestPoints test_points, CopyCheck* copies)
    : test_points_(std::move(test_points.list)),
      test_point_spacing_(test_points.spacing),
      test_point_radii_(test_points_.size()),
      cosine_sums_(test_points_.size()),
      is_covered_(test_points_.size()),
      is_lost_by_copies_(test_points_.size()) {
  if (test_points_.empty()) return;
  select_near_test_points(request, copies);
  select_seen_test_points(request);
  build_test_point_grid();
  const double samples =
      double{1} * request.width * request.height * request.samples * request.samples;
  const double triangles = static_cast<double>(request.source.triangles.size());
  const auto visible_count =
      std::count_if(cosine_sums_.begin(), cosine_sums_.end(), [](float of) { return of > 0; });
  const double share =
      static_cast<double>(visible_count) / static_cast<double>(test_points_.size());
  const double min_samples_to_cull =
      std::max(kMinSamplesToCull * share, kMinSamplesPerTriangleToCull);
  if (samples > min_samples_to_cull * triangles) list_test_points_by_triangle(request.source);
}

void HighCoverage::select_near_test_points(const MatchRequest& request, CopyCheck* copies) {
  cl::Context& context = context_of(request.source.device);
  const LowSurface& surface = request.surface;
  const auto low = LowTree::of_surface(context, surface);
  const double columns = double{1} * request.width * request.samples;
  const double rows = double{1} * request.height * request.samples;
  const auto count = static_cast<std::uint32_t>(test_points_.size());
  ClosestQuery query;
  query.max_distance = static_cast<float>(std::min(search_distance(request), double{kRayLength}));
  NearestLowFaces nearest_low;
  nearest_low.input_hash = hash_bytes(test_points_, std::array{query.max_distance});
  const auto find = [&] {
    DeviceCorrespondence nearest(context, count);
    const ClosestFinder low_poly_finder(context, low->tree, request.source.traversal);
    low_poly_finder.find(device_samples(context, test_points_), count, count, query, nearest);
    nearest_low.triangle.resize(count);
    nearest.triangle.read(context, nearest_low.triangle);
    return nearest_low;
  };
  const auto cached_nearest = surface.made->get<NearestLowFaces>(find);
  std::vector<std::uint32_t> triangle =
      (cached_nearest->input_hash == nearest_low.input_hash ? *cached_nearest : find()).triangle;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (triangle[i] == KILN_NO_TRIANGLE) continue;
    const std::uint32_t face_of_tree = std::exchange(triangle[i], low->of[triangle[i]]);
    const auto& corners = surface.triangles[triangle[i]];
    // Triangles without UVs are skipped, since most of them belong to another texture set
    if (std::isnan(corners[0].uv.x)) continue;
    const double cosine = dot(low->normals[face_of_tree], to_double(test_points_[i].normal));
    if (!(cosine > kMinFaceCosine)) continue;
    const LowPolyFace face(corners, columns, rows);
    test_point_radii_[i] = static_cast<float>(kRadiusInSamples * face.step / cosine);
  }
  if (copies == nullptr) return;
  std::vector<CopyCheck::TestPoint> test_points;
  std::vector<std::uint32_t> test_point_of_point;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!(test_point_radii_[i] > 0) || !surface.is_copy(triangle[i])) continue;
    const LowPolyFace face(surface.triangles[triangle[i]], columns, rows);
    const Vec3d &ab = face.ab, &ac = face.ac, up = cross(ab, ac);
    const Vec3d direction = to_double(test_points_[i].position) - face.corner;
    const double area = dot(up, up);
    // The nearest point of the triangle is the foot of the perpendicular from the test point, or
    // lies on the triangle's border. It is moved inward, since a ray that starts on the border may
    // miss the high poly.
    double u = std::clamp(dot(cross(direction, ac), up) / area, 0.0, 1.0);
    double v = std::clamp(dot(cross(ab, direction), up) / area, 0.0, 1 - u);
    u += (1.0 / 3 - u) * kOriginInset;
    v += (1.0 / 3 - v) * kOriginInset;
    test_points.push_back({triangle[i], static_cast<float>(u), static_cast<float>(v)});
    test_point_of_point.push_back(i);
  }
  const std::vector<CopyCheck::CopyComparison> comparisons = copies->find(test_points);
  for (std::size_t k = 0; k < comparisons.size(); ++k) {
    const std::uint32_t i = test_point_of_point[k];
    is_lost_by_copies_[i] = comparisons[k].outcome == CopyCheck::CopyOutcome::other ? 1 : 0;
    if (comparisons[k].outcome != CopyCheck::CopyOutcome::same) continue;
    // The map represents the test point if the match finds the test point itself, and not a surface
    // above it.
    const Vec3d offset = comparisons[k].found - to_double(test_points_[i].position);
    const double copy_radius = std::max(double{test_point_radii_[i]}, kCopyRadius);
    is_covered_[i] = dot(offset, offset) <= copy_radius * copy_radius ? 1 : 0;
  }
}

void HighCoverage::select_seen_test_points(const MatchRequest& request) {
  cl::Context& context = context_of(request.source.device);
  const RayCaster& caster = request.source.rays();
  const double direction_divisor = std::max(1.0, caster.stats().leaves_per_line / kMaxMeanLeaves);
  std::vector<Vec3> directions;
  for (const Vec3d& direction : spread_directions(
           std::max(static_cast<std::uint32_t>(kDirections / direction_divisor), kMinDirections))) {
    directions.push_back(to_float(direction));
  }
  // The rays use the same kernel as bakes, so that no other one has to be compiled. It is fast for neighbouring rays
  // of one direction, so test points are visited along a Morton curve, direction by direction.
  const RayQuery query{.t_min = kOriginOffset,
                       .t_max = kRayLength,
                       .two_sided = true,
                       .any_hit = true,
                       .triangles_per_ray = ray_query(request, true).triangles_per_ray};
  std::vector<TestPoint> rays;
  std::vector<std::uint32_t> test_point_of_ray;
  const auto cast_rays = [&] {
    if (rays.empty()) return;
    const auto count = static_cast<std::uint32_t>(rays.size());
    DeviceCorrespondence hit(context, count);
    caster.intersect(device_samples(context, rays), count, count, query, hit);
    std::vector<std::uint32_t> triangle(count);
    hit.triangle.read(context, triangle);
    for (std::size_t k = 0; k < test_point_of_ray.size(); ++k) {
      const double cosine =
          dot(to_double(test_points_[test_point_of_ray[k]].normal), to_double(rays[k].normal));
      if (triangle[k] == KILN_NO_TRIANGLE)
        cosine_sums_[test_point_of_ray[k]] += static_cast<float>(cosine);
    }
    rays.clear();
    test_point_of_ray.clear();
  };
  const std::vector<std::uint32_t> along_curve = near_test_points_in_morton_order();
  for (const Vec3& w : directions) {
    for (const std::uint32_t i : along_curve) {
      const Vec3d normal = to_double(test_points_[i].normal);
      if (!(dot(normal, to_double(w)) > 0.05)) continue;
      rays.push_back(
          {to_float(to_double(test_points_[i].position) + normal * double{kOriginOffset}), w});
      test_point_of_ray.push_back(i);
    }
    if (rays.size() > kRaysPerLaunch) cast_rays();
  }
  cast_rays();
}

std::vector<std::uint32_t> HighCoverage::near_test_points_in_morton_order() const {
  std::vector<std::uint32_t> morton_order;
  for (std::uint32_t i = 0; i < test_points_.size(); ++i) {
    if (test_point_radii_[i] > 0) morton_order.push_back(i);
  }
  constexpr std::uint32_t kBits = 10;             // Number of bits of a coordinate
  const auto spread_bits = [](std::uint64_t x) {  // inserts two zeros after each bit
    std::uint64_t spread = 0;
    for (std::uint32_t bit = 0; bit < kBits; ++bit) spread |= (x >> bit & 1U) << (3 * bit);
    return spread;
  };
  Box<Vec3d> box;
  for (const std::uint32_t i : morton_order) box.add(to_double(test_points_[i].position));
  const Vec3d size = box.size();
  const double side = std::max({size.x, size.y, size.z});
  const double cells = side > 0 && std::isfinite(side) ? ((1U << kBits) - 1) / side : 0;
  std::vector<std::uint64_t> keys(test_points_.size());
  for (const std::uint32_t i : morton_order) {
    const Vec3d grid_position = (to_double(test_points_[i].position) - box.low) * cells;
    std::uint64_t key = 0;
    for (const double x : {grid_position.x, grid_position.y, grid_position.z}) {
      key = key << 1U | spread_bits(x >= 0 ? static_cast<std::uint64_t>(x) : 0);
    }
    keys[i] = key;
  }
  std::stable_sort(morton_order.begin(), morton_order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  return morton_order;
}

std::uint64_t HighCoverage::cell(const std::array<std::int64_t, 3>& at) {
  std::uint64_t hash = static_cast<std::uint64_t>(at[0]) * 0x9E3779B97F4A7C15U;
  hash = (hash ^ (hash >> 29) ^ static_cast<std::uint64_t>(at[1])) * 0xBF58476D1CE4E5B9U;
  hash = (hash ^ (hash >> 31) ^ static_cast<std::uint64_t>(at[2])) * 0x94D049BB133111EBU;
  return hash ^ (hash >> 30);
}

std::int64_t HighCoverage::cell_coordinate(double x) const {
  // Rounds down without calling floor(), since this code runs three times per sample.
  const double side = x * cells_per_unit_;
  const auto truncated = static_cast<std::int64_t>(side);
  return truncated - (side < static_cast<double>(truncated) ? 1 : 0);
}

/// Inserts each test point into all cells within its radius, so that a sample reads only one cell.
void HighCoverage::build_test_point_grid() {
  occupied_cell_filter_.assign(kBloomFilterBits / 64, 0);
  // Minimum radius in frame units. It keeps the numbers of cells far below 2^63
  constexpr float kMinRadius = 0x1p-22F;
  float farthest = 0;
  for (std::size_t i = 0; i < test_points_.size(); ++i) {
    if (cosine_sums_[i] > 0) farthest = std::max(farthest, test_point_radii_[i]);
  }
  if (!(farthest > 0)) return;
  // With cells of this size, a test point rarely extends over more than eight of them
  cells_per_unit_ = 0.5 / std::max(farthest, kMinRadius);
  for (std::uint32_t i = 0; i < test_points_.size(); ++i) {
    if (!(cosine_sums_[i] > 0)) continue;
    const Vec3d p = to_double(test_points_[i].position);
    const double r = double{test_point_radii_[i]} * kRadiusWidening;
    for (std::int64_t z = cell_coordinate(p.z - r); z <= cell_coordinate(p.z + r); ++z) {
      for (std::int64_t y = cell_coordinate(p.y - r); y <= cell_coordinate(p.y + r); ++y) {
        for (std::int64_t x = cell_coordinate(p.x - r); x <= cell_coordinate(p.x + r); ++x) {
          const std::uint64_t key = cell({x, y, z});
          occupied_cell_filter_[key % kBloomFilterBits / 64] |= std::uint64_t{1} << (key % 64);
          std::vector<std::uint32_t>& list = test_points_in_cell_[key];
          if (list.empty() || list.back() != i) list.push_back(i);
        }
      }
    }
  }
}

void HighCoverage::list_test_points_by_triangle(const Source::Impl& high) {
  std::vector<std::uint32_t> visible_test_points;
  std::vector<Vec3> points(test_points_.size());
  double farthest = 0;
  Box<Vec3d> box_of_near_test_points;  // Bounding box of the test points near the low poly
  for (std::uint32_t i = 0; i < test_points_.size(); ++i) {
    points[i] = test_points_[i].position;
    if (!(cosine_sums_[i] > 0)) continue;
    visible_test_points.push_back(i);
    farthest = std::max(farthest, double{test_point_radii_[i]} * kRadiusWidening);
    box_of_near_test_points.add(to_double(points[i]));
  }
  const CoverageSlabs coverage_slabs(points, std::move(visible_test_points));
  struct TestPointsByTriangle {
    std::vector<std::uint32_t> triangles, list_ends, test_points;
  };
  const std::size_t count = high.triangles.size();
  std::vector<TestPointsByTriangle> found((count + kTestPointsPerTask - 1) / kTestPointsPerTask);
  parallel_for(count, kTestPointsPerTask, [&](std::size_t begin, std::size_t end) {
    // Structured bindings cannot be captured by the lambda below, so the elements get names.
    std::vector<std::uint32_t>& triangles = found[begin / kTestPointsPerTask].triangles;
    std::vector<std::uint32_t>& list_ends = found[begin / kTestPointsPerTask].list_ends;
    std::vector<std::uint32_t>& test_points = found[begin / kTestPointsPerTask].test_points;
    for (std::size_t t = begin; t < end; ++t) {
      const Box<Vec3d> box = triangle_box(high, high.triangles[t]);
      const Vec3d &low = box.low, &top = box.high;
      const double slack = kTriangleSlack * 4 * length(top - low);
      const std::size_t size_before = test_points.size();
      const Vec3d reach = Vec3d{1, 1, 1} * (slack + farthest);
      const Vec3d distance_inside_below = top + reach - box_of_near_test_points.low,
                  distance_inside_above = box_of_near_test_points.high + reach - low;
      if (std::min({distance_inside_below.x, distance_inside_below.y, distance_inside_below.z,
                    distance_inside_above.x, distance_inside_above.y, distance_inside_above.z}) < 0)
        continue;
      coverage_slabs.for_each_in_box(low - reach, top + reach, [&](std::uint32_t i) {
        const Vec3d p = to_double(points[i]);
        const double r = slack + double{test_point_radii_[i]} * kRadiusWidening;
        const bool is_within = p.x > low.x - r && p.x < top.x + r && p.y > low.y - r &&
                               p.y < top.y + r && p.z > low.z - r && p.z < top.z + r;
        if (is_within) test_points.push_back(i);
        return test_points.size() <= size_before + kMaxListedTestPoints;
      });
      if (test_points.size() == size_before) continue;
      triangles.push_back(static_cast<std::uint32_t>(t));
      // Lists that are longer are discarded, and the grid is searched instead.
      if (test_points.size() > size_before + kMaxListedTestPoints) test_points.resize(size_before);
      list_ends.push_back(static_cast<std::uint32_t>(test_points.size()));
    }
  });
  triangle_state_.assign(count, kNoTestPointsState);
  test_point_list_begins_ = {0};
  for (const auto& [triangles, list_ends, test_points] : found) {
    const auto base = static_cast<std::uint32_t>(listed_test_points_.size());
    listed_test_points_.insert(listed_test_points_.end(), test_points.begin(), test_points.end());
    for (std::size_t k = 0; k < triangles.size(); ++k) {
      const bool is_list_too_long = list_ends[k] == (k == 0 ? 0 : list_ends[k - 1]);
      triangle_state_[triangles[k]] =
          is_list_too_long
              ? kSearchGridState
              : kFirstListState + static_cast<std::uint32_t>(test_point_list_begins_.size()) - 1;
      if (!is_list_too_long) test_point_list_begins_.push_back(base + list_ends[k]);
    }
  }
}

/// Marks a test point as covered if this sample covers it. \returns whether this sample or an
/// earlier one covers it
bool HighCoverage::mark_if_covered(std::uint32_t i, const Sample& sample) {
  std::atomic_ref<std::uint8_t> covered(is_covered_[i]);
  if (covered.load(std::memory_order_relaxed) != 0) return true;
  const Vec3d direction = to_double(test_points_[i].position) - sample.point;
  if (dot(direction, direction) > double{test_point_radii_[i]} * test_point_radii_[i]) return false;
  if (!(dot(cross(sample.ab, sample.ac), to_double(test_points_[i].normal)) > 0)) return false;
  covered.store(1, std::memory_order_relaxed);
  return true;
}

void HighCoverage::mark_covered_test_points(const Sample& sample) {
  const Vec3d& p = sample.point;
  const std::uint64_t key =
      cell({cell_coordinate(p.x), cell_coordinate(p.y), cell_coordinate(p.z)});
  if ((occupied_cell_filter_[key % kBloomFilterBits / 64] >> (key % 64) & 1) == 0) return;
  const auto found = test_points_in_cell_.find(key);
  if (found == test_points_in_cell_.end()) return;
  for (const std::uint32_t i : found->second) mark_if_covered(i, sample);
}

bool HighCoverage::mark_listed_test_points(std::uint32_t list_index, const Sample& sample) {
  bool all_listed_covered = true;
  for (std::uint32_t k = test_point_list_begins_[list_index];
       k < test_point_list_begins_[list_index + std::size_t{1}]; ++k) {
    if (!mark_if_covered(listed_test_points_[k], sample)) all_listed_covered = false;
  }
  return all_listed_covered;
}

void HighCoverage::record_band(const Source::Impl& high, BandReads& reads,
                               const DeviceCorrespondence& match) {
  if (test_points_in_cell_.empty() || match.count == 0) return;
  const std::vector<std::uint32_t>& triangle = reads.read(match.triangle, match.count);
  const std::vector<float>& u = reads.read(match.barycentric, match.count);
  const std::vector<float>& v = reads.read(match.barycentric, match.count, match.capacity);
  parallel_for(match.count, kTestPointsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t triangle_index = triangle[i];
      if (triangle_index == KILN_NO_TRIANGLE) continue;
      const bool is_inside =
          u[i] >= -kTriangleSlack && v[i] >= -kTriangleSlack && u[i] + v[i] <= 1 + kTriangleSlack;
      std::uint32_t triangle_state = kSearchGridState;
      if (!triangle_state_.empty() && is_inside) {
        triangle_state = std::atomic_ref<std::uint32_t>(triangle_state_[triangle_index])
                             .load(std::memory_order_relaxed);
        if (triangle_state == kNoTestPointsState) continue;
      }
      const Triangle& t = high.triangles[triangle_index];
      const Vec3d a = to_double(high.positions[t[0]]), b = to_double(high.positions[t[1]]),
                  c = to_double(high.positions[t[2]]);
      const Vec3d ab = b - a, ac = c - a;
      const Sample sample{a + ab * double{u[i]} + ac * double{v[i]}, ab, ac};
      if (triangle_state == kSearchGridState) {
        mark_covered_test_points(sample);
      } else if (mark_listed_test_points(triangle_state - kFirstListState, sample)) {
        // All test points of this triangle are covered, so its remaining samples can be skipped.
        std::atomic_ref<std::uint32_t>(triangle_state_[triangle_index])
            .store(kNoTestPointsState, std::memory_order_relaxed);
      }
    }
  });
}

std::vector<VertexCoverage> HighCoverage::vertex_coverage() const {
  std::vector<VertexCoverage> result;
  for (std::size_t i = 0; i < test_points_.size(); ++i) {
    result.push_back(!(cosine_sums_[i] > 0) ? VertexCoverage::not_rated
                     : is_covered_[i] != 0  ? VertexCoverage::represented
                                            : VertexCoverage::lost);
  }
  return result;
}

}  // namespace kiln
