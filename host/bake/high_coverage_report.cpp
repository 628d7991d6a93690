// Reports lost detail: its shares, and the largest connected part.
#include <algorithm>
#include <numeric>
#include <string>

#include "bake/high_coverage.h"
#include "base/disjoint_sets.h"
#include "base/formatted.h"
#include "base/option.h"

namespace kiln {
namespace {

// Maximum distance of connected lost test points, as a multiple of the spacing of test points
constexpr double kLinkDistance = 2.5;
constexpr double kMinLossToWarn = 0.01;

/// Connected components of test points, each given by a representative: test points within
/// `max_distance` of each other are connected.
std::vector<std::uint32_t> connected_parts(const std::vector<Vec3d>& test_points,
                                           double max_distance) {
  std::vector<std::uint32_t> order(test_points.size()), part(test_points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(test_points[a].x, a) < std::pair(test_points[b].x, b);
  });
  DisjointSets sets(test_points.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Vec3d& a = test_points[order[i]];
    for (std::size_t j = i + 1; j < order.size() && test_points[order[j]].x - a.x <= max_distance;
         ++j) {
      const Vec3d offset = test_points[order[j]] - a;
      if (dot(offset, offset) <= max_distance * max_distance) sets.join(order[i], order[j]);
    }
  }
  for (std::uint32_t i = 0; i < part.size(); ++i) part[i] = sets.find(i);
  return part;
}

std::string point_text(const std::array<double, 3>& p) {
  return formatted("%.4g, %.4g, %.4g", p[0], p[1], p[2]);
}

Message choose_remedy(const BakeOptions& options) {
  const auto takes_cage = [](const MatchRow& row) { return obeys(row.info, "match.cage"); };
  if (!takes_cage(match_row(options.match.method))) {
    return "other matches may find these parts: try " + option("match.method") + " " +
           match_names(takes_cage) + ".";
  }
  if (options.match.cage || options.match.cage_mesh != nullptr) {
    return "raise " + option("match.cage") +
           ", so that rays start above these parts, or leave the cage out.";
  }
  if (options.match.ray.rule == RayRule::nearest) {
    return "rays stop at nearer faces: use " + option("match.ray.rule", "outermost") + ".";
  }
  return "raise " + option("match.max_distance") + ", or model these parts in the low poly.";
}

}  // namespace

HighCoverageReport HighCoverage::report(const Frame& frame) const {
  HighCoverageReport result;
  double total_weight = 0, lost_weight = 0, weight_lost_by_copies = 0;
  std::vector<Vec3d> test_points;
  std::vector<double> weight;
  for (std::size_t i = 0; i < test_points_.size(); ++i) {
    if (!(cosine_sums_[i] > 0)) continue;
    ++result.places;
    total_weight += double{cosine_sums_[i]};
    if (is_covered_[i] != 0) continue;
    lost_weight += double{cosine_sums_[i]};
    if (is_lost_by_copies_[i] != 0) weight_lost_by_copies += double{cosine_sums_[i]};
    test_points.push_back(to_double(test_points_[i].position));
    weight.push_back(double{cosine_sums_[i]});
  }
  result.weight = total_weight;
  if (test_points.empty()) return result;
  result.lost = lost_weight / total_weight;
  result.by_copies = weight_lost_by_copies / total_weight;
  const std::vector<std::uint32_t> part =
      connected_parts(test_points, kLinkDistance * test_point_spacing_);
  std::vector<double> size(test_points.size());
  for (std::size_t i = 0; i < test_points.size(); ++i) size[part[i]] += weight[i];
  const auto largest_part =
      static_cast<std::uint32_t>(std::max_element(size.begin(), size.end()) - size.begin());
  result.largest = size[largest_part] / total_weight;
  Vec3d centre{};
  for (std::size_t i = 0; i < test_points.size(); ++i) {
    if (part[i] == largest_part)
      centre = centre + test_points[i] * (weight[i] / size[largest_part]);
  }
  double min_distance = INFINITY;
  Vec3d nearest{};
  for (std::size_t i = 0; i < test_points.size(); ++i) {
    const Vec3d offset = test_points[i] - centre;
    if (part[i] != largest_part || !(dot(offset, offset) < min_distance)) continue;
    min_distance = dot(offset, offset);
    nearest = test_points[i];
  }
  result.where = {frame.center[0] + nearest.x / frame.scale,
                  frame.center[1] + nearest.y / frame.scale,
                  frame.center[2] + nearest.z / frame.scale};
  return result;
}

void warn_about_lost_detail(const HighCoverageReport& recall, const BakeOptions& options,
                            std::vector<Warning>& warnings) {
  // The check of UV copies may already have reported losses by shared texels.
  const bool is_reported =
      std::any_of(warnings.begin(), warnings.end(),
                  [](const Warning& warning) { return warning.code == CopyCheck::kWarning; });
  if (recall.lost - (is_reported ? recall.by_copies : 0) < kMinLossToWarn) return;
  const std::string loss_text = formatted(
      "%.1f%% of the high poly's visible surface near the low poly has no texel, the largest part "
      "of it (%.1f%%) around ",
      100 * recall.lost, 100 * recall.largest);
  warnings.push_back(
      {"lost-surface", loss_text + point_text(recall.where) + ": " + choose_remedy(options), 1});
}

}  // namespace kiln
