#include "bake/copy_check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "bake/report.h"
#include "base/counted.h"
#include "base/formatted.h"
#include "base/option.h"
#include "detail/registry.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::uint32_t kTestPointsOnCopies = 4096;
// A warning is given if at least this share of the copies' area differs
constexpr double kMinShareToWarn = 0.05;
// Maximum distance, as a share of the diagonal, of two points that count as equal if no map holds lengths
constexpr double kMaxPointDistance = 0.02;
// Maximum distance, as a share of the diagonal, of two points that count as equal if a map holds
// lengths such as heights
constexpr double kMaxLengthDistance = 0.001;
// Minimum cosine of normals that count as equal: 5 degrees
constexpr double kMinNormalCosine = 0.9962;
// Maximum difference, of 255, of colours that count as equal
constexpr double kMaxColorDifference = 32;
// kernels read samples in multiples of this number
constexpr std::uint32_t kSampleMultiple = 64;

bool holds_lengths(const BakeOptions& options) {
  const std::vector<MapKind> kinds = kinds_of(options);
  return std::any_of(kinds.begin(), kinds.end(),
                     [](MapKind map) { return map_row(map).unit == "world units"; });
}

/// Makes a ray matcher for the check, if the bake's matcher reads band data that the check does not have; otherwise
/// returns null.
std::unique_ptr<Matcher> make_check_matcher(const MatchRequest& request,
                                            const BakeOptions& options) {
  if (!any_match_or_fallback(
          options, [](const MatchRow& row) { return obeys(row.info, "match.visibility"); })) {
    return nullptr;
  }
  const auto rows = match_rows();
  const auto rays = std::find_if(rows.begin(), rows.end(), [](const MatchRow& row) {
    return obeys(row.info, "match.ray.direction");
  });
  MatchNotes notes;
  return rays->make(request, notes);
}

/// Derivatives of the position on a triangle by u and by v, and the triangle's unit normal.
struct UvFrame {
  Vec3d u{}, v{}, normal{};
  double size = 0;  // ratio of the triangle's surface area to its UV area

  explicit UvFrame(const std::array<LowSurface::Corner, 3>& corners) {
    const auto& [a, b, c] = corners;
    const Vec3d p = to_double(b.position) - to_double(a.position);
    const Vec3d q = to_double(c.position) - to_double(a.position);
    const double pu = double{b.uv.x} - a.uv.x, pv = double{b.uv.y} - a.uv.y;
    const double qu = double{c.uv.x} - a.uv.x, qv = double{c.uv.y} - a.uv.y;
    const double area = pu * qv - qu * pv;
    u = (p * qv - q * pv) * (1 / area);
    v = (q * pu - p * qu) * (1 / area);
    const Vec3d up = cross(p, q);
    normal = up * (1 / length(up));
    size = length(cross(u, v));
  }

  /// Transfers a vector from this triangle to another: keeps its components in u, v and normal.
  Vec3d transfer_to_triangle(const Vec3d& vector, const UvFrame& to) const {
    const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v);
    const double determinant = uu * vv - uv * uv;
    const double along_u = dot(vector, u), along_v = dot(vector, v);
    return to.u * ((along_u * vv - along_v * uv) / determinant) +
           to.v * ((along_v * uu - along_u * uv) / determinant) +
           to.normal * (dot(vector, normal) * std::sqrt(to.size / size));
  }
};

std::array<double, 2> uv_at(const LowSurface& surface, const CopyCheck::TestPoint& test_point) {
  const auto& [a, b, c] = surface.triangles[test_point.triangle];
  const double u = test_point.u, v = test_point.v;
  return {a.uv.x * (1 - u - v) + b.uv.x * u + c.uv.x * v,
          a.uv.y * (1 - u - v) + b.uv.y * u + c.uv.y * v};
}

}  // namespace

CopyCheck::CopyCheck(const MatchRequest& request, const BakeOptions& options, Matcher& matcher,
                     std::function<void(TexelBand&)> set_directions)
    : source_(request.source),
      surface_(request.surface),
      own_matcher_(make_check_matcher(request, options)),
      matcher_(own_matcher_ != nullptr ? *own_matcher_ : matcher),
      set_directions_(std::move(set_directions)),
      two_sided_(options.match.two_sided),
      max_distance_((holds_lengths(options) ? kMaxLengthDistance : kMaxPointDistance) *
                    source_.frame.diagonal * source_.frame.scale),
      uv_triangles_(surface_.triangles.size()),
      baked_squares_(uv_triangles_) {
  for (const std::uint32_t t : surface_.usable_triangles()) {
    uv_triangles_[t] = UvPlace::of(surface_.triangles[t]);
    if (uv_triangles_[t].area != 0 && !surface_.is_copy(t)) baked_squares_.add(t);
  }
  cl::Context& context = context_of(source_.device);
  normals_ = source_.attributes.normals.download(context);
  normal_indices_ = source_.attributes.normal_indices.download(context);
}

/// The point with the same UV on the triangle that is baked for a copy.
std::optional<CopyCheck::TestPoint> CopyCheck::baked_test_point_of(
    const TestPoint& test_point) const {
  UvPosition uv = uv_at(surface_, test_point);
  for (std::size_t axis = 0; axis < 2; ++axis)
    uv[axis] -= uv_triangles_[test_point.triangle].offset[axis];
  std::uint32_t triangle = surface_.copy_of[test_point.triangle];
  if (!uv_triangles_[triangle].contains(uv)) {
    const bool found = baked_squares_.any_match_at(uv, [&](std::uint32_t other) {
      if (!uv_triangles_[other].contains(uv)) return false;
      triangle = other;
      return true;
    });
    if (!found) return std::nullopt;
  }
  const auto& [a, b, c] = uv_triangles_[triangle].uv;
  const double area = uv_triangles_[triangle].area;
  const double u = ((uv[0] - a[0]) * (c[1] - a[1]) - (uv[1] - a[1]) * (c[0] - a[0])) / area;
  const double v = ((b[0] - a[0]) * (uv[1] - a[1]) - (b[1] - a[1]) * (uv[0] - a[0])) / area;
  return TestPoint{triangle, static_cast<float>(u), static_cast<float>(v)};
}

std::vector<CopyCheck::Point> CopyCheck::match(std::span<const TestPoint> test_points) {
  cl::Context& context = context_of(source_.device);
  TexelBand band = band_of_points(
      context, surface_, test_points.size(), [&](std::size_t i) { return test_points[i]; },
      kSampleMultiple);
  set_directions_(band);
  DeviceCorrespondence found(context, band.capacity);
  found.count = band.sample_count;
  matcher_.run(band, found);
  context.finish();
  const std::vector<std::uint32_t> triangles = found.triangle.download(context);
  const std::vector<float> weights = found.barycentric.download(context);

  std::vector<Point> result(test_points.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (triangles[i] == KILN_NO_TRIANGLE) continue;
    Point& point = result[i];
    point.found = true;
    point.triangle = triangles[i];
    const double u = weights[i], v = weights[band.capacity + i];
    const double share[3] = {1 - u - v, u, v};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = source_.triangles[triangles[i]][k];
      point.at += to_double(source_.positions[vertex]) * share[k];
      const float* n =
          &normals_[std::size_t{3} * normal_indices_[std::size_t{3} * triangles[i] + k]];
      point.normal += to_double(Vec3{n[0], n[1], n[2]}) * share[k];
      for (std::size_t c = 0; c < 4 && !source_.colors.empty(); ++c) {
        point.color[c] += source_.colors[vertex][c] * share[k];
      }
    }
    const double size = length(point.normal);
    if (size > 0) point.normal = point.normal * (1 / size);
    point.offset = point.at - position_at(surface_, test_points[i]);
  }
  return result;
}

bool CopyCheck::are_same(const TestPoint& test_point, const Point& point, const TestPoint& baked,
                         const Point& other) const {
  const UvFrame frame_of_copy(surface_.triangles[test_point.triangle]),
      frame_of_baked(surface_.triangles[baked.triangle]);
  const Vec3d offset_difference =
      frame_of_copy.transfer_to_triangle(point.offset, frame_of_baked) - other.offset;
  if (!(dot(offset_difference, offset_difference) <= max_distance_ * max_distance_)) return false;
  if (!source_.materials.of.empty() &&
      source_.materials.of[point.triangle] != source_.materials.of[other.triangle]) {
    return false;
  }
  for (std::size_t c = 0; c < 4; ++c) {
    if (std::abs(point.color[c] - other.color[c]) > kMaxColorDifference) return false;
  }
  // The normal that a map shows. On two-sided meshes, the normals of back faces are flipped towards the low poly.
  const auto shown_normal = [&](const Vec3d& normal, const UvFrame& low) {
    return two_sided_ && dot(normal, low.normal) < 0 ? normal * -1.0 : normal;
  };
  Vec3d expected_normal =
      frame_of_copy.transfer_to_triangle(shown_normal(point.normal, frame_of_copy), frame_of_baked);
  const double size = length(expected_normal);
  if (!(size > 0)) return true;
  return dot(expected_normal * (1 / size), shown_normal(other.normal, frame_of_baked)) >=
         kMinNormalCosine;
}

std::vector<CopyCheck::CopyComparison> CopyCheck::find(std::span<const TestPoint> test_points) {
  std::vector<CopyComparison> result(test_points.size());
  // Two entries for each test point: the point on the UV copy, then the point with the same UV on
  // the baked triangle
  std::vector<TestPoint> test_point_pairs;
  std::vector<std::size_t> pair_sources;
  for (std::size_t i = 0; i < test_points.size(); ++i) {
    const std::optional<TestPoint> baked = baked_test_point_of(test_points[i]);
    if (!baked) continue;
    result[i].baked = baked->triangle;
    test_point_pairs.push_back(test_points[i]);
    test_point_pairs.push_back(*baked);
    pair_sources.push_back(i);
  }
  if (test_point_pairs.empty()) return result;
  const std::vector<Point> points = match(test_point_pairs);
  for (std::size_t k = 0; k < pair_sources.size(); ++k) {
    const Point &copy_point = points[2 * k], &baked_point = points[2 * k + 1];
    if (!copy_point.found) continue;
    CopyComparison& comparison = result[pair_sources[k]];
    comparison.found = copy_point.at;
    const bool is_same = baked_point.found && are_same(test_point_pairs[2 * k], copy_point,
                                                       test_point_pairs[2 * k + 1], baked_point);
    comparison.outcome = is_same ? CopyOutcome::same : CopyOutcome::other;
  }
  return result;
}

double CopyCheck::check_copies(const Mesh& low, std::vector<Warning>& warnings) {
  std::vector<std::uint32_t> copies;
  // For each copy, the sum of the areas of all copies up to and including it
  std::vector<double> cumulative_area;
  double area = 0;
  for (std::uint32_t t = 0; t < surface_.copy_of.size(); ++t) {
    if (!surface_.is_copy(t)) continue;
    const auto& [a, b, c] = surface_.triangles[t];
    area += length(cross(to_double(b.position) - to_double(a.position),
                         to_double(c.position) - to_double(a.position)));
    copies.push_back(t);
    cumulative_area.push_back(area);
  }
  if (!(area > 0)) return 0;
  std::vector<TestPoint> test_points;
  for (std::uint32_t i = 0; i < kTestPointsOnCopies; ++i) {
    const auto area_end = std::upper_bound(cumulative_area.begin(), cumulative_area.end(),
                                           area * (i + 0.5) / kTestPointsOnCopies);
    const auto low_discrepancy_coordinate = [&](double step) {
      return i * step - std::floor(i * step);
    };
    double u = low_discrepancy_coordinate(0.7548776662466927),
           v = low_discrepancy_coordinate(0.5698402909980532);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const auto copy = std::min<std::size_t>(
        static_cast<std::size_t>(area_end - cumulative_area.begin()), copies.size() - 1);
    test_points.push_back({copies[copy], static_cast<float>(u), static_cast<float>(v)});
  }
  const std::vector<CopyComparison> comparisons = find(test_points);
  struct Pair {
    std::uint64_t count = 0;
    std::uint32_t copy = 0, baked = 0;
  };
  std::map<std::pair<std::string, std::string>, Pair> name_pairs;
  std::uint64_t differing_count = 0;
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    if (comparisons[i].outcome != CopyOutcome::other) continue;
    ++differing_count;
    Pair& pair = name_pairs[{triangle_names(low, test_points[i].triangle),
                             triangle_names(low, comparisons[i].baked)}];
    if (pair.count++ == 0) pair = {1, test_points[i].triangle, comparisons[i].baked};
  }
  const double share =
      static_cast<double>(differing_count) / static_cast<double>(comparisons.size());
  if (share <= kMinShareToWarn) return share;
  const auto largest_part = std::max_element(
      name_pairs.begin(), name_pairs.end(),
      [](const auto& a, const auto& b) { return a.second.count < b.second.count; });
  const std::string text = formatted("%.3g%%", 100 * share);
  warnings.push_back(
      {kWarning,
       counted(copies.size(), "triangle") +
           (copies.size() == 1 ? " of the low poly shares UVs and texels with another, but on "
                               : " of the low poly share UVs and texels with others, but on ") +
           text + " of " + (copies.size() == 1 ? "its" : "their") +
           " surface the high poly differs, and this detail is lost: for example " +
           describe_triangle(low, largest_part->second.copy) + " on the texels of " +
           describe_triangle(low, largest_part->second.baked) +
           (name_pairs.size() > 1
                ? ", and " + std::to_string(name_pairs.size() - 1) + " more pairs of names"
                : std::string()) +
           ". Give them separate places in the UV layout (" + option("unwrap()") +
           " makes a new one), or bake them separately.",
       copies.size()});
  return share;
}

}  // namespace kiln
