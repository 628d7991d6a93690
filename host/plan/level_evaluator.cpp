#include "plan/level_evaluator.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <vector>

#include "base/progress_guard.h"
#include "base/stopwatch.h"
#include "match/registry.h"
#include "plan/widen_search.h"
#include "unwrap/unwrap_charts.h"

namespace kiln {

using namespace plan_settings;

namespace {

/// Gives a mesh arbitrary UVs, so that points can be matched before the mesh is unwrapped. Height
/// fields keep their own UVs, which matching by UVs reads.
Mesh with_placeholder_uvs(const Mesh& low) {
  return low.uvs.empty() ? add_placeholder_uvs(low) : low;
}

}  // namespace

LevelEvaluator::LevelEvaluator(const Source& source, const Mesh& high,
                               const LowPolyPlanOptions& options, BakeOptions& bake,
                               LowPolyPlan& plan, LevelCache& cache)
    : source_(source), high_(high), options_(options), bake_(bake), plan_(plan), cache_(cache) {
  ProgressGuard::poll_at(0, "analysing the high poly");
  const Stopwatch watch;
  fine_view_ = make_high_poly_view(impl_of(source), options.screen, plan_directions());
  coarse_view_ =
      make_high_poly_view(impl_of(source), options.screen, plan_directions(), /*coarse=*/true);
  plan.seconds_measure += watch.total();
  make_levels(kFinestFaces);
}

void LevelEvaluator::make_levels(std::uint32_t finest_faces) {
  ProgressGuard::poll_at(0.05, "simplifying");
  const Stopwatch watch;
  finest_faces_ = finest_faces;
  level_set_ = &cache_[finest_faces];
  for (auto& nodes : nodes_) nodes.clear();
  for (auto& measured : measured_levels_) measured.clear();
  if (level_set_->levels == nullptr) {
    std::vector<std::uint32_t> faces;
    // All coarser levels are known to exceed the error bound.
    const double min_faces = finest_faces > kFinestFaces ? 1.0 * kFinestFaces : 2.0;
    for (double target_faces =
             std::min<double>(finest_faces, static_cast<double>(high_.triangles.size()));
         target_faces >= min_faces || faces.empty(); target_faces *= kLevelFaceRatio) {
      const auto face_count = static_cast<std::uint32_t>(std::max(target_faces, 2.0));
      if (faces.empty() || face_count < faces.back()) faces.push_back(face_count);
    }
    if (finest_faces > kFinestFaces) faces.push_back(kFinestFaces);
    level_set_->levels = std::make_unique<SimplifyLevels>(
        high_, faces, options_.height_field ? LevelRule::height_field : LevelRule::shape);
  }
  plan_.seconds_simplify += watch.total();
}

bool LevelEvaluator::refine() {
  if (finest_faces_ > kFinestFaces || high_.triangles.size() <= finest_faces_) return false;
  std::array<std::optional<LevelErrors>, 2> known;
  for (std::size_t mapped = 0; mapped < 2; ++mapped) {
    const auto finest = nodes_[mapped].find(0);
    if (finest != nodes_[mapped].end()) known[mapped] = finest->second;
  }
  make_levels(8 * kFinestFaces);
  for (std::size_t mapped = 0; mapped < 2; ++mapped) {
    if (known[mapped]) nodes_[mapped][count() - 1] = *known[mapped];
  }
  return true;
}

LevelErrors LevelEvaluator::at(std::size_t level, bool mapped) {
  const auto& measured_levels = measured_levels_[mapped ? 1 : 0];
  if (const auto found = measured_levels.find(level); found != measured_levels.end())
    return found->second.errors;
  LevelErrors errors = draft_errors(level, mapped);
  if (measured_levels.empty()) return errors;
  // Face counts are a geometric sequence, so the nearest index has the nearest face count.
  const auto level_distance = [&](const auto& item) {
    return std::max(item.first, level) - std::min(item.first, level);
  };
  const MeasuredLevel& nearest = std::min_element(measured_levels.begin(), measured_levels.end(),
                                                  [&](const auto& a, const auto& b) {
                                                    return level_distance(a) < level_distance(b);
                                                  })
                                     ->second;
  errors.without_map *= nearest.without_map;
  errors.infinite_map *= nearest.infinite_map;
  return errors;
}

void LevelEvaluator::record_measured(std::size_t level, bool mapped, const LevelErrors& measured) {
  const LevelErrors drafts = draft_errors(level, mapped);
  const auto ratio = [](double measured_error, double draft_error) {
    return measured_error > 0 && draft_error > 0 ? measured_error / draft_error : 1;
  };
  measured_levels_[mapped ? 1 : 0][level] = {measured,
                                             ratio(measured.without_map, drafts.without_map),
                                             ratio(measured.infinite_map, drafts.infinite_map)};
}

LevelErrors LevelEvaluator::draft_errors(std::size_t level, bool mapped) {
  const std::map<std::size_t, LevelErrors>& nodes = nodes_[mapped ? 1 : 0];
  const std::size_t node_before = level / kNodeStep * kNodeStep;
  if (!is_frozen_ || nodes.empty()) {
    const std::size_t next = std::min(node_before + kNodeStep, count() - 1);
    if (level > node_before) evaluate(next, mapped);
    const bool is_next_sufficient =
        2 * (next - level) < kNodeStep && nodes.upper_bound(next) != nodes.end();
    if (level == node_before || !is_next_sufficient) evaluate(node_before, mapped);
  }
  auto after = nodes.lower_bound(level);
  if (after == nodes.end()) return std::prev(after)->second;
  if (after->first == level) return after->second;
  if (after == nodes.begin() && ++after == nodes.end()) return nodes.begin()->second;
  const LevelErrors &a = std::prev(after)->second, &b = after->second;
  const std::size_t first = std::prev(after)->first;
  const double share =
      std::log(faces(level) / faces(first)) / std::log(faces(after->first) / faces(first));
  const auto interpolate = [share](double from, double to) {
    return from > 0 && to > 0 ? from * std::pow(to / from, share) : from + (to - from) * share;
  };
  return {interpolate(a.without_map, b.without_map), interpolate(a.infinite_map, b.infinite_map),
          std::max(interpolate(a.silhouette_mismatch, b.silhouette_mismatch), 0.0)};
}

std::vector<std::size_t> LevelEvaluator::evaluated_levels(bool mapped) const {
  std::set<std::size_t> levels;
  for (const auto& [level, errors] : nodes_[mapped ? 1 : 0]) levels.insert(level);
  for (const auto& [level, errors] : measured_levels_[mapped ? 1 : 0]) levels.insert(level);
  return {levels.begin(), levels.end()};
}

void LevelEvaluator::evaluate(std::size_t level, bool mapped) {
  if (nodes_[mapped ? 1 : 0].contains(level)) return;
  ProgressGuard::poll_at(0.2, "evaluating low polys");
  const Stopwatch watch;
  auto drafts = level_set_->draft_meshes.find(level);
  if (drafts == level_set_->draft_meshes.end()) {
    drafts = level_set_->draft_meshes.emplace(level, levels().draft_meshes(level, edges_under_map_))
                 .first;
  }
  const Stopwatch measure_watch;
  const Mesh low = with_placeholder_uvs(drafts->second[mapped ? 1 : 0]);
  const NormalProbe probe(impl_of(source_), low, coarse_view_);
  const NormalError error = probe.without_map();
  nodes_[mapped ? 1 : 0][level] =
      mapped ? mapped_errors(probe) : LevelErrors{error.mean_degrees, 0, error.one_sided_share};
  plan_.seconds_measure += measure_watch.total();
  plan_.seconds_simplify += watch.total() - measure_watch.total();
}

void LevelEvaluator::smooth_mapped_normals() {
  edges_under_map_ = EdgesUnderMap::smooth;
  level_set_->draft_meshes.clear();
  nodes_[1].clear();
  measured_levels_[1].clear();
}

LevelErrors LevelEvaluator::mapped_errors(const NormalProbe& probe) const {
  std::shared_ptr<const VisibilityField> field;
  BakeOptions options = match_options(bake_.match.method);
  const NormalProbe::InfiniteMap infinite_map = widen_search(
      options,
      [&](const BakeOptions& wide_options) { return probe.infinite_map(wide_options, field); },
      [](const NormalProbe::InfiniteMap& found) { return found.missed; });
  const NormalError unmapped_error = probe.without_map();
  return {unmapped_error.mean_degrees, infinite_map.error.mean_degrees,
          unmapped_error.one_sided_share};
}

BakeOptions LevelEvaluator::match_options(MatchMethod method) const {
  BakeOptions options = bake_;
  options.match.method = method;
  std::erase(options.match.fallback, method);
  options.match.visibility.at = VisibilityAt::vertex;
  options.match.visibility.directions =
      std::min(options.match.visibility.directions, kTrialDirections);
  options.progress = {};
  return options;
}

bool LevelEvaluator::choose_match(std::size_t level) {
  const std::size_t nearest_node = level / kNodeStep * kNodeStep;
  evaluate(nearest_node, /*mapped=*/true);
  ProgressGuard::poll_at(0.3, "comparing matches");
  const NormalProbe probe(impl_of(source_),
                          with_placeholder_uvs(level_set_->draft_meshes.at(nearest_node)[1]),
                          coarse_view_);
  const Stopwatch watch;
  std::shared_ptr<const VisibilityField> field;
  std::vector<MatchMethod> methods = planned_matches(&MatchRow::low_poly_order);
  if (bake_.match.cage) {
    std::erase_if(methods,
                  [](MatchMethod method) { return !obeys(match_row(method).info, "match.cage"); });
  }
  const MatchMethod first_method = methods.front(), previous_method = bake_.match.method;
  if (options_.height_field) methods.insert(methods.begin(), match_at_uvs());
  double min_error = 0;
  for (const MatchMethod method : methods) {
    const NormalProbe::InfiniteMap infinite_map = probe.infinite_map(match_options(method), field);
    if (min_error != 0 &&
        infinite_map.error.mean_degrees >= kMaxErrorRatioOfBetterMatch * min_error)
      continue;
    min_error = infinite_map.error.mean_degrees;
    if (method != bake_.match.method) {
      bake_.match.method = method;
      nodes_[1].clear();
      measured_levels_[1].clear();
    }
    // Skips the other matches if none of them can reduce the first one's error to kMaxErrorRatioOfBetterMatch times its
    // value. On meshes with hard edges, usually none can.
    if (method == first_method &&
        probe.min_error_share(infinite_map) >= kMaxErrorRatioOfBetterMatch)
      break;
  }
  std::erase(bake_.match.fallback, bake_.match.method);
  plan_.seconds_measure += watch.total();
  return bake_.match.method != previous_method;
}

const Mesh& LevelEvaluator::mesh(std::size_t level) {
  const auto found = level_set_->meshes.find(level);
  if (found != level_set_->meshes.end()) return found->second;
  const Stopwatch watch;
  const Mesh& simplified = level_set_->meshes[level] = levels().mesh(level);
  plan_.seconds_simplify += watch.total();
  return simplified;
}

const UnwrappedLowPoly& LevelEvaluator::unwrapped(std::size_t level, std::uint32_t size) {
  const auto found = level_set_->unwrapped.find({level, size});
  if (found != level_set_->unwrapped.end()) return found->second;
  const Mesh& simplified = mesh(level);
  ProgressGuard::poll_at(0.4, "laying out charts");
  const Stopwatch watch;
  UnwrappedLowPoly next;
  if (options_.height_field) {
    next.mesh = simplified;
    next.report.charts = 1;
    next.report.coverage = 1;
  } else {
    if (options_.density == TexelDensity::detail && !detail_) detail_.emplace(high_);
    next.mesh = unwrap_for(simplified, {options_.unwrap, size, std::max(2U, size / 256)},
                           detail_ ? &*detail_ : nullptr, &next.report);
  }
  levels().fit_normals(next.mesh);
  plan_.seconds_unwrap += watch.total();
  return level_set_->unwrapped[{level, size}] = std::move(next);
}

void LevelEvaluator::solve(std::size_t level) {
  ProgressGuard::poll_at(0.9, "simplifying again, without flaws");
  const Stopwatch watch;
  levels().solve(level);
  level_set_->meshes.erase(level);
  std::erase_if(level_set_->unwrapped, [&](const auto& item) { return item.first.first == level; });
  plan_.seconds_simplify += watch.total();
}

}  // namespace kiln
