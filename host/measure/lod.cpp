#include "kiln/lod.h"

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>

#include "bake/progress.h"
#include "base/stopwatch.h"
#include "lowpoly/keep_colors.h"
#include "measure/light_check.h"
#include "measure/light_looks.h"
#include "measure/light_planner.h"
#include "measure/light_trials.h"

namespace kiln {
namespace {

constexpr std::uint32_t kFewestLevels = 2, kMostLevels = 8, kSmallestScreen = 16;
/// A level has at most this share of the bytes of the one before.
constexpr double kWorthwhile = 0.9;
/// Of the meshes simplified from the first level: each has this share of the faces of the one before.
constexpr double kShare = 0.95;
constexpr std::uint32_t kFewestFaces = 12;
constexpr double kMostGrowth = 4, kMostOutline = 0.99;

void check(const LodOptions& options) {
  const auto fail = [](const std::string& text) { throw Error(ErrorCode::usage, text); };
  if (options.levels < kFewestLevels || options.levels > kMostLevels) {
    fail("bake_lods: levels is " + std::to_string(options.levels) + "; it must be 2 to 8");
  }
  if (!(options.error_growth >= 1) || options.error_growth > kMostGrowth) {
    fail("bake_lods: error_growth is " + std::to_string(options.error_growth) +
         "; it must be 1 to 4");
  }
  const std::uint32_t least = kSmallestScreen << (options.levels - 1);
  if (options.plan.screen < least) {
    fail("bake_lods: screen is " + std::to_string(options.plan.screen) + " pixels; " +
         std::to_string(options.levels) + " levels, each for half the pixels, need " +
         std::to_string(least) + " at least");
  }
  check_light_plan(options.plan);
}

class LodMaker {
 public:
  LodMaker(const Source& source, const Mesh& high, const LodOptions& options)
      : source_(source), high_(high), options_(options) {}

  LodChain run() {
    chain_.levels.reserve(options_.levels);  // `simpler_` refers to the first.
    for (std::uint32_t k = 0; k < options_.levels; ++k) {
      const std::uint32_t screen = options_.plan.screen >> k;
      if (k > 0) growth_ *= options_.error_growth;
      LodLevel level = k > 0 && options_.share_uvs ? from_first(k, screen) : planned(k, screen);
      if (level.light.cancelled) {
        chain_.cancelled = true;
        return std::move(chain_);
      }
      add(std::move(level));
    }
    chain_.reached = std::all_of(chain_.levels.begin(), chain_.levels.end(),
                                 [](const LodLevel& level) { return level.light.reached; });
    return std::move(chain_);
  }

 private:
  Progress progress_of(std::uint32_t k) const {
    const Progress& progress = options_.plan.bake.progress;
    if (!progress) return {};
    return [&progress, k, all = options_.levels](double done, std::string_view stage) {
      return progress((k + done) / all, "level " + std::to_string(k) + ": " + std::string(stage));
    };
  }

  LodLevel planned(std::uint32_t k, std::uint32_t screen) {
    LightPlanOptions plan = options_.plan;
    plan.screen = screen;
    plan.bake.progress = progress_of(k);
    plan.max_error *= growth_;
    plan.max_outline = max_outline();
    for (MapBound& bound : plan.bounds) bound.max_error *= growth_;
    if (k > 0) plan.on_measured = {};
    if (options_.share_uvs) plan.may_leave_map_out = false;
    LodLevel level;
    level.screen = screen;
    level.light = plan_light(source_, high_, plan, cache_);
    if (k == 0 || level.light.cancelled || level.light.chosen.faces <= faces_before()) return level;
    // More faces and a smaller map: lighter, but no level of detail that an engine's user expects.
    // Where nothing does with as few, the level before serves this size, too.
    level.light = plan_light(source_, high_, plan, cache_, faces_before());
    return level;
  }

  LodLevel from_first(std::uint32_t k, std::uint32_t screen) {
    return unless_cancelled<LodLevel>([&] { return simplified(k, screen); },
                                      [](LodLevel& none) { none.light.cancelled = true; });
  }

  /// The coarsest of the first level's simplifications that its map fits within the error.
  LodLevel simplified(std::uint32_t k, std::uint32_t screen) {
    const Progress callback = progress_of(k);
    const BakeProgress progress(callback);
    LodLevel level;
    level.screen = screen;
    level.own_maps = false;
    level.light.wanted = growth_ * options_.plan.max_error;
    level.light.max_outline = max_outline();
    level.light.bake = first().bake;
    make_simpler();
    progress.at(0, "looking at the high poly");
    const Stopwatch watch;
    const DenseShown shown = shown_to_plans(source_, screen);
    // Those before `most` are too many faces or as many as the level before has.
    const std::uint64_t before = faces_before();
    std::size_t begin = 0, end = simpler_->count();
    while (begin < end && simpler_->faces(begin) >= before) ++begin;
    level.light.chosen.faces = before;  // Where none does, this level is left out.
    level.light.chosen.bytes = chain_.levels.back().light.chosen.bytes;
    while (begin < end) {
      progress.at(0.5, "looking at low polys");
      const std::size_t middle = begin + (end - begin) / 2;
      const LightTrial trial = try_mesh(middle, shown, level.light);
      if (does(trial, level.light)) {
        begin = middle + 1;
      } else {
        end = middle;
      }
    }
    level.light.seconds_measure = watch.total();
    return level;
  }

  void make_simpler() {
    if (simpler_ != nullptr) return;
    std::vector<std::uint32_t> faces;
    for (double goal = kShare * static_cast<double>(first().chosen.faces); goal >= kFewestFaces;
         goal *= kShare) {
      const auto whole = static_cast<std::uint32_t>(goal);
      if (faces.empty() || whole < faces.back()) faces.push_back(whole);
    }
    if (faces.empty()) faces.push_back(kFewestFaces);
    simpler_ = std::make_unique<SimplifyLevels>(first().low, faces, LevelRule::keep_uvs);
  }

  /// Keeps the mesh in `light` where it does.
  LightTrial try_mesh(std::size_t index, const DenseShown& shown, LightBake& light) {
    SimplifyReport report;
    Mesh low = simpler_->mesh(index, &report);
    LightTrial trial = first().chosen;
    trial.faces = low.triangles.size();
    trial.positions = low.positions.size();
    trial.vertices = split_vertices(low);
    trial.charts = report.charts;
    // Vertices with UVs; the map is the first level's.
    trial.bytes = light_bytes(trial.vertices, trial.faces, trial.size, {}, trial.bits);
    const NormalProbe probe(impl_of(source_), low, shown);
    const BakeOptions& bake = first().bake;
    set_measured(probe.with_map(first().drawn, bake), trial);
    trial.expected = trial.measured;
    light.trials.push_back(trial);
    if (!does(trial, light)) return trial;
    light.low = std::move(low);
    keep_colors(first().low, light.low);
    light.simplified = std::move(report);
    light.chosen = trial;
    light.reached = true;
    return trial;
  }

  void add(LodLevel level) {
    if (chain_.levels.empty() || (is_lighter(level) && (level.light.reached || !reached()))) {
      chain_.levels.push_back(std::move(level));
      return;
    }
    std::string text = "At " + std::to_string(level.screen) + " pixels the mesh of " +
                       std::to_string(faces_before()) +
                       " faces serves, too: what is within the error there has more faces, or over "
                       "90% of its bytes.";
    if (options_.error_growth == 1 && chain_.warnings.empty()) {
      text += " Errors that grow from level to level (--lod-growth) give lighter ones.";
    }
    chain_.warnings.push_back({"lod-left-out", std::move(text), 1});
  }

  /// Of a level, below 1.
  double max_outline() const { return std::min(growth_ * options_.plan.max_outline, kMostOutline); }

  static bool does(const LightTrial& trial, const LightBake& light) {
    return trial.measured <= light.wanted && has_outlines(trial, light.max_outline);
  }

  std::uint64_t faces_before() const { return chain_.levels.back().light.chosen.faces; }

  /// Whether the level before is within the error.
  bool reached() const { return chain_.levels.back().light.reached; }

  /// Of shared maps neither counts.
  bool is_lighter(const LodLevel& level) const {
    const LightBytes &now = level.light.chosen.bytes,
                     &before = chain_.levels.back().light.chosen.bytes;
    const std::uint64_t bytes = level.own_maps ? now.total() : now.vertices;
    const std::uint64_t more = level.own_maps ? before.total() : before.vertices;
    return static_cast<double>(bytes) <= kWorthwhile * static_cast<double>(more);
  }

  const LightBake& first() const { return chain_.levels.front().light; }

  const Source& source_;
  const Mesh& high_;
  const LodOptions& options_;
  double growth_ = 1;  ///< The level's error over the first one's
  LevelCache cache_;
  std::unique_ptr<SimplifyLevels> simpler_;  ///< Of the first level
  LodChain chain_;
};

}  // namespace

LodChain bake_lods(const Source& source, const Mesh& high, const LodOptions& options) {
  check(options);
  return LodMaker(source, high, options).run();
}

}  // namespace kiln
