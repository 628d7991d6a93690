// Plans chains of levels of detail.
#include <algorithm>
#include <string>
#include <utility>

#include "bake/progress.h"
#include "base/formatted.h"
#include "base/option.h"
#include "base/stopwatch.h"
#include "measure/normal_probe.h"
#include "plan/candidate.h"
#include "plan/low_poly_plan.h"
#include "simplify/transfer_colors.h"

namespace kiln {
namespace {

/// A level has at most this share of the bytes of the previous level.
constexpr double kMaxLevelBytesRatio = 0.9;
/// Minimum face count of meshes that are simplified from the first level.
constexpr std::uint32_t kMinLodFaces = 12;

class LodMaker {
 public:
  LodMaker(const Source& source, const Mesh& high, const LodOptions& options)
      : source_(source), high_(high), options_(options) {}

  LodChain run() {
    chain_.levels.reserve(options_.levels);  // `simplified_levels_` refers to the first element
    for (std::uint32_t k = 0; k < options_.levels && !chain_.cancelled; ++k) {
      if (k > 0) error_factor_ *= options_.error_growth;
      LodLevel level;
      level.screen = options_.plan.screen >> k;
      level.own_maps = k == 0 || !options_.share_uvs;
      level.plan = level.own_maps ? plan_level(k, level.screen) : simplify_level(k, level.screen);
      chain_.cancelled = level.plan.cancelled;
      if (!chain_.cancelled) add(std::move(level));
    }
    chain_.reached = std::all_of(chain_.levels.begin(), chain_.levels.end(),
                                 [](const LodLevel& level) { return level.plan.reached; });
    return std::move(chain_);
  }

 private:
  const LowPolyPlan& first() const { return chain_.levels.front().plan; }
  const LowPolyPlan& previous() const { return chain_.levels.back().plan; }
  double max_outline() const { return std::min(error_factor_ * options_.plan.max_outline, 0.99); }

  Progress progress_of(std::uint32_t k) const {
    const Progress& progress = options_.plan.bake.progress;
    if (!progress) return {};
    return [&progress, k, all = options_.levels](double done, std::string_view stage) {
      return progress((k + done) / all, "level " + std::to_string(k) + ": " + std::string(stage));
    };
  }

  LowPolyPlan plan_level(std::uint32_t k, std::uint32_t screen) {
    LowPolyPlanOptions options = options_.plan;
    options.screen = screen;
    options.bake.progress = progress_of(k);
    options.max_error *= error_factor_;
    options.max_outline = max_outline();
    for (MapBound& bound : options.bounds) bound.max_error *= error_factor_;
    if (k > 0) options.on_measured = {};
    if (options_.share_uvs) options.may_leave_map_out = false;
    LowPolyPlan plan = plan_levels(source_, high_, options, cache_);
    if (k == 0 || plan.cancelled || plan.chosen.faces <= previous().chosen.faces) return plan;
    // The lightest plan may have more faces and a smaller map, but engines expect the face count to fall from level
    // to level.
    return plan_levels(source_, high_, options, cache_, previous().chosen.faces);
  }

  /// The coarsest simplification of the first level with which the first level's map stays within the error bound.
  LowPolyPlan simplify_level(std::uint32_t k, std::uint32_t screen) {
    return unless_cancelled<LowPolyPlan>(
        [&] {
          const Progress callback = progress_of(k);
          const BakeProgress progress(callback);
          LowPolyPlan plan;
          plan.wanted = error_factor_ * options_.plan.max_error;
          plan.max_outline = max_outline();
          plan.bake = first().bake;
          // If no mesh is within the error bound, add() omits this level
          plan.chosen = previous().chosen;
          make_simplified_levels();
          progress.at(0, "analysing the high poly");
          const Stopwatch watch;
          const HighPolyView high_view =
              make_high_poly_view(impl_of(source_), screen, plan_directions());
          std::size_t begin = 0;
          while (begin < simplified_levels_->count() &&
                 simplified_levels_->faces(begin) >= previous().chosen.faces) {
            ++begin;
          }
          // try_level() stores in `plan` the lightest mesh within the error bound.
          coarsest_level(begin, simplified_levels_->count(), [&](std::size_t level) {
            progress.at(0.5, "measuring low polys");
            return try_level(level, high_view, plan);
          });
          plan.seconds_measure = watch.total();
          return plan;
        },
        [](LowPolyPlan& none) { none.cancelled = true; });
  }

  void make_simplified_levels() {
    if (simplified_levels_ != nullptr) return;
    std::vector<std::uint32_t> faces;
    for (auto target_faces = static_cast<double>(first().chosen.faces);
         target_faces >= kMinLodFaces || faces.empty();
         target_faces *= plan_settings::kLevelFaceRatio) {
      const auto next = static_cast<std::uint32_t>(target_faces * plan_settings::kLevelFaceRatio);
      const std::uint32_t face_count = std::max(next, kMinLodFaces);
      if (faces.empty() || face_count < faces.back()) faces.push_back(face_count);
    }
    simplified_levels_ = std::make_unique<SimplifyLevels>(first().low, faces, LevelRule::keep_uvs);
  }

  /// Measures a level, and chooses it for the plan if it is within the error bound.
  bool try_level(std::size_t level, const HighPolyView& high_view, LowPolyPlan& plan) {
    SimplifyReport report;
    Mesh low = simplified_levels_->mesh(level, &report);
    Candidate candidate = first().chosen;
    candidate.faces = low.triangles.size();
    candidate.positions = low.positions.size();
    candidate.vertices = split_vertices(low);
    candidate.charts = report.charts;
    // Counts only the bytes of vertices with UVs, since the level shares the first level's map.
    candidate.bytes =
        low_poly_bytes(candidate.vertices, candidate.faces, candidate.size, {}, candidate.bits);
    const NormalProbe probe(impl_of(source_), low, high_view);
    set_measured(probe.with_map(first().drawn, plan.bake), candidate);
    candidate.expected = candidate.measured;
    plan.candidates.push_back(candidate);
    if (candidate.measured > plan.wanted ||
        (plan.max_outline > 0 && candidate.silhouette_mismatch > plan.max_outline)) {
      return false;
    }
    plan.low = std::move(low);
    transfer_colors(first().low, plan.low);
    plan.simplified = std::move(report);
    plan.chosen = candidate;
    return plan.reached = true;
  }

  void add(LodLevel level) {
    // A level that shares the maps of the first level adds no bytes for texels
    const auto weight = [&](const LowPolyPlan& plan) {
      const LowPolyBytes& bytes = plan.chosen.bytes;
      return static_cast<double>(level.own_maps ? bytes.total() : bytes.vertices);
    };
    if (chain_.levels.empty() || (weight(level.plan) <= kMaxLevelBytesRatio * weight(previous()) &&
                                  (level.plan.reached || !previous().reached))) {
      chain_.levels.push_back(std::move(level));
      return;
    }
    Message text =
        "The level for " + std::to_string(level.screen) + " pixels is left out, and the mesh of " +
        std::to_string(previous().chosen.faces) +
        " faces is used at that size, too: every mesh within the error bound has more faces than "
        "that mesh, or more than 90% of its bytes.";
    if (options_.error_growth == 1 && chain_.warnings.empty()) {
      text += " Let the error bound grow from level to level (" + option("lod_growth") +
              ") to allow lighter meshes.";
    }
    chain_.warnings.push_back({"lod-left-out", std::move(text), 1});
  }

  const Source& source_;
  const Mesh& high_;
  const LodOptions& options_;
  double error_factor_ = 1;  ///< Ratio of the level's error bound to that of the first level
  LevelCache cache_;
  std::unique_ptr<SimplifyLevels> simplified_levels_;  ///< Simplified meshes of the first level
  LodChain chain_;
};

}  // namespace

LodChain bake_lods(const Source& source, const Mesh& high, const LodOptions& options) {
  const auto require = [](bool holds, const std::string& text) {
    if (!holds) throw Error(ErrorCode::usage, "bake_lods: " + text);
  };
  require(options.levels >= 2 && options.levels <= 8,
          "levels is " + std::to_string(options.levels) + "; it must be 2 to 8");
  require(options.error_growth >= 1 && options.error_growth <= 4,
          "error_growth is " + decimal(options.error_growth) + "; it must be 1 to 4");
  const std::uint32_t least = 16U << (options.levels - 1);
  require(options.plan.screen >= least,
          "screen is " + std::to_string(options.plan.screen) + " pixels; " +
              std::to_string(options.levels) +
              " levels, each for half the pixels of the previous level, need a screen of " +
              std::to_string(least) + " pixels or more");
  check_plan(options.plan);
  return LodMaker(source, high, options).run();
}

}  // namespace kiln
