#include "unwrap/chart_density.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "base/cube_root.h"
#include "mesh/half_edge.h"
#include "unwrap/chart_cuts.h"

namespace kiln {
namespace {

/// Constant added to each error. An error is the length of the difference of two unit normals; this constant
/// corresponds to a sixteenth of a degree, which no map resolves.
constexpr double kErrorFloor = 0.001;
/// Largest exponent of the error's power law. With it, the error is proportional to the square of a texel's side.
constexpr double kMaxErrorExponent = 2;
/// Weight with which the mesh's mean error is mixed into each chart's error, as a share of the mesh's area. It
/// regularizes charts with few samples.
constexpr double kMeanWeight = 0.0005;
/// Number of directions of cuts, evenly spaced over 180 degrees.
constexpr std::size_t kCutDirections = 8;

/// Model of a piece's error at the scale s on the map: error = level * s^-power.
struct PowerLaw {
  double area = 0, level = 0, power = 0;

  double error(double s) const { return area * level * std::pow(s, -power); }
  /// The scale s that minimizes error(s) + weight * area * s^2.
  double best_scale(double weight, double min_scale, double max_scale) const {
    const double s = std::pow(0.5 * power * level / weight, 1 / (2 + power));
    return std::clamp(s, min_scale, max_scale);
  }
};

TexelNeed sum_needs(std::span<const TexelNeed> needs) {
  TexelNeed sum;
  for (const TexelNeed& need : needs) {
    sum.area += need.area;
    for (std::size_t k = 0; k < sum.errors.size(); ++k) sum.errors[k] += need.errors[k];
  }
  return sum;
}

/// \param mesh_need  texel need of the whole mesh, whose mean error regularizes the fit
PowerLaw fit_power_law(const TexelNeed& need, const TexelNeed& mesh_need) {
  TexelErrors e{};
  for (std::size_t k = 0; k < e.size(); ++k) {
    e[k] = kErrorFloor + (need.errors[k] + kMeanWeight * mesh_need.errors[k]) /
                             (need.area + kMeanWeight * mesh_need.area);
  }
  const double power = std::log2(e[0] / e[2]) / std::log2(kTexelSides[0] / kTexelSides[2]);
  return {need.area, cube_root(e[0] * e[1] * e[2]), std::clamp(power, 0.0, kMaxErrorExponent)};
}

/// Lagrange multiplier at which the optimal scales fill `area`: the decrease of the error that one more texel must
/// bring.
double lagrange_multiplier(const std::vector<PowerLaw>& laws, double area) {
  const double min_scale = 1 / std::sqrt(kMaxDensityRatio), max_scale = std::sqrt(kMaxDensityRatio);
  double low = 1e-12, high = 1e6;
  for (int i = 0; i < 100; ++i) {
    const double weight = std::sqrt(low * high);
    double used_area = 0;
    for (const PowerLaw& law : laws) {
      const double s = law.best_scale(weight, min_scale, max_scale);
      used_area += law.area * s * s;
    }
    (used_area > area ? low : high) = weight;
  }
  return high;
}

std::vector<PowerLaw> fit_power_laws(std::span<const TexelNeed> needs, const TexelNeed& mesh_need) {
  std::vector<PowerLaw> laws;
  for (const TexelNeed& need : needs) laws.push_back(fit_power_law(need, mesh_need));
  return laws;
}

/// Search for the best cut of one chart.
class DensityCut {
 public:
  DensityCut(const ChartSurface& surface, const ChartBorders& borders, const DensityPrice& price,
             const TexelNeed& mesh_need, double weight)
      : surface_(surface),
        borders_(borders),
        price_(price),
        whole_(mesh_need),
        texel_price_(weight) {}

  struct FoundCut {
    double gain = 0;
    std::vector<std::uint8_t> apart;
  };

  /// The best cut for each direction that has a cut with a gain, sorted by gain.
  /// \param index_in_chart  for each of the chart's triangles, its index in the chart
  std::vector<FoundCut> run(const FlatChart& chart, std::span<const TexelNeed> needs,
                            const std::vector<std::uint32_t>& index_in_chart) {
    chart_ = &chart;
    index_in_chart_ = &index_in_chart;
    needs_.clear();
    for (const std::uint32_t t : chart.source) needs_.push_back(needs[t]);
    chart_sum_ = sum_needs(needs_);
    if (chart_sum_.area < 2 * price_.min_part_area) return {};
    uncut_cost_ = cost(chart_sum_);
    std::vector<FoundCut> cuts;
    for (std::size_t d = 0; d < kCutDirections; ++d) {
      FoundCut cut = best_cut_across(static_cast<double>(d) * std::numbers::pi / kCutDirections);
      if (cut.gain > 0) cuts.push_back(std::move(cut));
    }
    std::stable_sort(cuts.begin(), cuts.end(),
                     [](const FoundCut& a, const FoundCut& b) { return a.gain > b.gain; });
    return cuts;
  }

 private:
  struct CostAndScale {
    double cost = 0, scale = 1;
  };

  /// CostAndScale at the optimal scale: the error plus the price of the texels.
  CostAndScale cost(const TexelNeed& need) const {
    const PowerLaw law = fit_power_law(need, whole_);
    const double s =
        law.best_scale(texel_price_, 1 / std::sqrt(kMaxDensityRatio), std::sqrt(kMaxDensityRatio));
    return {law.error(s) / texel_price_ + law.area * s * s, s};
  }

  double gain(const TexelNeed& part, double length) const {
    TexelNeed rest = chart_sum_;
    rest.area -= part.area;
    for (std::size_t k = 0; k < rest.errors.size(); ++k) rest.errors[k] -= part.errors[k];
    if (std::min(part.area, rest.area) < price_.min_part_area) return 0;
    const CostAndScale a = cost(part), b = cost(rest);
    return uncut_cost_.cost - a.cost - b.cost -
           length * (price_.seam + price_.margin * (a.scale + b.scale));
  }

  std::uint32_t neighbour(std::uint32_t i, std::uint32_t k) const {
    const std::uint32_t h = 3 * chart_->source[i] + k;
    return borders_.is_glued(h) ? (*index_in_chart_)[surface_.mate[h] / 3] : kNoIndex;
  }

  /// The best cut among the lines perpendicular to a direction.
  FoundCut best_cut_across(double angle) const {
    const auto count = static_cast<std::uint32_t>(chart_->source.size());
    const Vec2d to{std::cos(angle), std::sin(angle)};
    std::vector<double> at(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      const Triangle& t = chart_->triangles[i];
      at[i] = dot(to, chart_->points[t[0]] + chart_->points[t[1]] + chart_->points[t[2]]);
    }
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0U);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return at[a] < at[b]; });
    std::vector<std::uint8_t> apart(count, 0);
    TexelNeed part;
    double length = 0, best = 0;
    std::size_t max_scale = 0;
    for (std::uint32_t n = 0; n + 1 < count; ++n) {
      const std::uint32_t i = order[n];
      add(part, needs_[i]);
      apart[i] = 1;
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t other = neighbour(i, k);
        if (other == kNoIndex) continue;
        const double side = surface_.length[3 * chart_->source[i] + k];
        length += apart[other] != 0 ? -side : side;
      }
      const double cut_gain = gain(part, length);
      if (cut_gain > best) best = cut_gain, max_scale = n + 1;
    }
    if (max_scale == 0) return {};
    for (std::size_t n = 0; n < count; ++n) apart[order[n]] = n < max_scale ? 1 : 0;
    return split_connected(std::move(apart));
  }

  static void add(TexelNeed& sum, const TexelNeed& need) {
    sum.area += need.area;
    for (std::size_t k = 0; k < sum.errors.size(); ++k) sum.errors[k] += need.errors[k];
  }

  /// Reduces each side to its largest connected component; other components are moved to the opposite side.
  FoundCut split_connected(std::vector<std::uint8_t> apart) const {
    for (const std::uint8_t side : {1, 0}) keep_largest_component(apart, side);
    TexelNeed part;
    double length = 0;
    for (std::uint32_t i = 0; i < apart.size(); ++i) {
      if (apart[i] == 0) continue;
      add(part, needs_[i]);
      for (std::uint32_t k = 0; k < 3; ++k) {
        const std::uint32_t other = neighbour(i, k);
        if (other == kNoIndex || apart[other] != 0) continue;
        length += surface_.length[3 * chart_->source[i] + k];
      }
    }
    const double cut_gain = gain(part, length);
    return {cut_gain, std::move(apart)};
  }

  void keep_largest_component(std::vector<std::uint8_t>& apart, std::uint8_t side) const {
    std::vector<std::uint32_t> component(apart.size(), kNoIndex), stack;
    std::vector<double> areas;
    for (std::uint32_t seed = 0; seed < apart.size(); ++seed) {
      if (apart[seed] != side || component[seed] != kNoIndex) continue;
      const auto id = static_cast<std::uint32_t>(areas.size());
      areas.push_back(0);
      stack.assign(1, seed);
      component[seed] = id;
      while (!stack.empty()) {
        const std::uint32_t i = stack.back();
        stack.pop_back();
        areas[id] += needs_[i].area;
        for (std::uint32_t k = 0; k < 3; ++k) {
          const std::uint32_t other = neighbour(i, k);
          if (other == kNoIndex || apart[other] != side || component[other] != kNoIndex) continue;
          component[other] = id;
          stack.push_back(other);
        }
      }
    }
    if (areas.size() < 2) return;
    const auto largest =
        static_cast<std::uint32_t>(std::max_element(areas.begin(), areas.end()) - areas.begin());
    for (std::uint32_t i = 0; i < apart.size(); ++i) {
      if (apart[i] == side && component[i] != largest) apart[i] = 1 - side;
    }
  }

  const ChartSurface& surface_;
  const ChartBorders& borders_;
  const DensityPrice& price_;
  const TexelNeed& whole_;
  double texel_price_;  ///< Lagrange multiplier: the price of a texel in units of error
  const FlatChart* chart_ = nullptr;
  const std::vector<std::uint32_t>* index_in_chart_ = nullptr;
  std::vector<TexelNeed> needs_;  ///< Texel needs of the chart's triangles
  TexelNeed chart_sum_;
  CostAndScale uncut_cost_;
};

}  // namespace

std::vector<double> texel_scales(std::span<const TexelNeed> needs) {
  const TexelNeed mesh_need = sum_needs(needs);
  const std::vector<PowerLaw> laws = fit_power_laws(needs, mesh_need);
  const double weight = lagrange_multiplier(laws, mesh_need.area);
  std::vector<double> scales;
  double used_area = 0;
  for (const PowerLaw& law : laws) {
    const double s =
        law.best_scale(weight, 1 / std::sqrt(kMaxDensityRatio), std::sqrt(kMaxDensityRatio));
    scales.push_back(s);
    used_area += law.area * s * s;
  }
  for (double& s : scales) s *= std::sqrt(mesh_need.area / used_area);
  return scales;
}

double expected_error(std::span<const TexelNeed> needs, std::span<const double> scales) {
  const std::vector<PowerLaw> laws = fit_power_laws(needs, sum_needs(needs));
  double sum = 0;
  for (std::size_t i = 0; i < laws.size(); ++i) sum += laws[i].error(scales[i]);
  return sum;
}

FlatTriangles flat_triangles(const ChartSurface& surface, const ChartBorders& borders,
                             const std::vector<FlatChart>& charts, std::size_t count) {
  FlatTriangles flat;
  flat.corners.resize(count);
  flat.neighbours.assign(count, {kNoIndex, kNoIndex, kNoIndex});
  for (const FlatChart& chart : charts) {
    for (std::size_t i = 0; i < chart.source.size(); ++i) {
      const std::uint32_t t = surface.source[chart.source[i]];
      for (std::uint32_t k = 0; k < 3; ++k) {
        flat.corners[t][k] = chart.points[chart.triangles[i][k]];
        const std::uint32_t h = 3 * chart.source[i] + k;
        if (borders.is_glued(h)) flat.neighbours[t][k] = surface.source[surface.mate[h] / 3];
      }
    }
  }
  return flat;
}

std::vector<TexelNeed> texel_needs(const ChartSurface& surface,
                                   std::span<const TexelErrors> errors) {
  std::vector<TexelNeed> needs(surface.triangles.size());
  for (std::size_t t = 0; t < needs.size(); ++t) {
    needs[t] = {surface.area[t], errors[surface.source[t]]};
    for (double& error : needs[t].errors) error *= surface.area[t];
  }
  return needs;
}

std::vector<TexelNeed> chart_needs(const std::vector<FlatChart>& charts,
                                   std::span<const TexelNeed> needs) {
  std::vector<TexelNeed> result;
  std::vector<TexelNeed> chart_needs_of_part;
  for (const FlatChart& chart : charts) {
    chart_needs_of_part.clear();
    for (const std::uint32_t t : chart.source) chart_needs_of_part.push_back(needs[t]);
    result.push_back(sum_needs(chart_needs_of_part));
  }
  return result;
}

void cut_by_density(const ChartSurface& surface, ChartBorders& borders, const DensityPrice& price,
                    std::span<const TexelNeed> needs, std::vector<FlatChart>& charts) {
  const TexelNeed mesh_need = sum_needs(needs);
  const double weight =
      lagrange_multiplier(fit_power_laws(chart_needs(charts, needs), mesh_need), mesh_need.area);
  DensityCut search(surface, borders, price, mesh_need, weight);
  std::vector<std::uint32_t> index_in_chart(surface.triangles.size());
  for (std::size_t i = 0; i < charts.size();) {
    for (std::uint32_t t = 0; t < charts[i].source.size(); ++t)
      index_in_chart[charts[i].source[t]] = t;
    bool is_cut = false;
    for (const auto& cuts : search.run(charts[i], needs, index_in_chart)) {
      FlatChart apart;
      is_cut = cut_apart(surface, borders, cuts.apart, index_in_chart, charts[i], apart);
      if (!is_cut) continue;
      charts.push_back(std::move(apart));
      break;
    }
    if (!is_cut) ++i;
  }
}

}  // namespace kiln
