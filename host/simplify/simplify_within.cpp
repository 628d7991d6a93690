// Part of SimplifyJob: simplification within a bound on the deviation.
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "base/formatted.h"
#include "simplify/simplify_job.h"

namespace kiln {
namespace {

/// Number of rounds in which vertices move to make room for further collapses. The first saves about 10% of the faces,
/// the second 3%.
constexpr int kRelaxRounds = 2;
/// Number of rounds at the end in which vertices move to lower the mean deviation.
constexpr int kFinalRelaxRounds = 2;
/// Tolerance of distances. They are compared in double precision, but the final ones are measured in single precision.
constexpr double kDistanceRounding = 1e-6;
/// Maximum decrease of the cosine at sharp edges in a run. If the first run causes flaws, later runs do not allow a
/// decrease. Without this tolerance, a blade simplified within 0.1% of its diagonal has 10% more faces.
constexpr double kMaxSharpening = 0.05;
/// Maximum number of runs. The first run is repeated without sharpening, then with a tighter bound around flaws.
constexpr int kMaxRuns = 4;
/// Runs are only repeated if there are at most kMaxFlaws flaws, or at most one per kFacesPerFlaw faces. If there are
/// more, the flaws are in the high poly itself.
constexpr std::size_t kMaxFlaws = 32, kFacesPerFlaw = 500;

}  // namespace

/// Collapses edges as far as the bound allows.
void SimplifyState::run_within_bound() {
  collapser_.run(0);
  for (int round = 0; round < kRelaxRounds && may_relax(); ++round) {
    collapser_.relax(DistanceNorm::large);
    collapser_.run(0);
  }
  for (int round = 0; round < kFinalRelaxRounds && may_relax(); ++round) {
    collapser_.relax(DistanceNorm::all);
  }
}

/// Repairs flaws within the bound.
/// \returns the number of repaired triangles
std::size_t SimplifyJob::repair_within_bound(SimplifyState& state, SimplifyResult& result) {
  std::vector<std::uint32_t> sources;
  state.extract(result, &sources);
  Flaws flaws = flaw_check_.find(result.points, result.triangles);
  const std::size_t found = flaws.count();
  for (int round = 0; round < kMaxRepairRounds && !flaws.none(); ++round) {
    const auto is_bad = [&](const TriangleCorners& corners) {
      return flaw_check_.is_flaw(corners);
    };
    bool any = false;
    for (const auto* list : {&flaws.flat, &flaws.facing_down, &flaws.folded}) {
      for (const std::uint32_t t : *list) {
        any = state.collapser().repair_triangle(sources[t], is_bad) || any;
      }
    }
    if (!any) break;
    state.extract(result, &sources);
    flaws = flaw_check_.find(result.points, result.triangles);
  }
  return found - std::min(found, flaws.count());
}

/// Simplifies to the fewest faces within a bound. Repeats this with a tighter bound around flaws.
/// \returns no triangles if `work` cannot stay within the bound
SimplifyResult SimplifyJob::simplify_within_bound(double bound, const Work& work) {
  const bool is_high_poly = work.triangles.size() == dense_.triangles.size();
  if (!deviation_samples_) {
    deviation_samples_ =
        std::make_unique<DeviationSamples>(dense_positions_, dense_.triangles, kMaxSamples);
  }
  double limit = (1 - kDistanceRounding) * bound;
  std::vector<std::vector<Ball>> flawed_sets;
  SimplifyResult best;
  std::size_t repaired_count_of_best = 0;
  double sharpening = kMaxSharpening;
  for (int run = 0; run < kMaxRuns; ++run) {
    SimplifyState state(work, layout(), options_, scale_);
    if (!state.limit_deviation(*deviation_samples_, limit, is_high_poly, flawed_sets, sharpening))
      break;
    state.run_within_bound();
    SimplifyResult result;
    const std::size_t repaired_count = repair_within_bound(state, result);
    result.deviation = measure(result, kMaxSamples);
    if (result.deviation.largest > bound) {
      limit *= 0.95 * bound / result.deviation.largest;
      continue;
    }
    result.low_to_high = low_to_high_distance(deviation_samples_->surface, to_floats(result.points),
                                              result.triangles);
    result.is_bounded = state.is_bounded();
    const bool is_sound = has_no_flaws(result);
    if (best.triangles.empty() || result.flawed.size() < best.flawed.size()) {
      best = result;
      repaired_count_of_best = repaired_count;
    }
    const std::size_t max_flaws = kMaxFlaws + result.triangles.size() / kFacesPerFlaw;
    if (is_sound || result.flawed.empty() || result.flawed.size() > max_flaws) break;
    if (std::exchange(sharpening, 0) > 0) continue;
    flawed_sets.push_back(result.flawed);
    // In the next run, the ball around each flaw is smaller: its radius is that of the flawed triangle alone, without
    // the margin within which presimplification keeps the high poly.
    for (Ball& place : flawed_sets.back()) place.radius -= kFlawRadius;
  }
  report_.mended = repaired_count_of_best;
  return best;
}

/// Warns if the bound keeps nearly all faces.
void SimplifyJob::warn_of_bound(const SimplifyResult& result) {
  if (options_.faces != 0) return;
  const std::size_t left = count_faces(result), all = face_count_of_dense_mesh();
  const std::string bound = formatted("%.4g%% of the diagonal", 100 * options_.max_error);
  const std::string faces = std::to_string(all) + " faces";
  if (left == all && all == 1) {
    report_.warnings.push_back(
        {"all-faces-kept", "the mesh has only one usable face, which was kept", left});
  } else if (left == all && result.is_bounded) {
    report_.warnings.push_back({"all-faces-kept",
                                "all " + faces + " were kept: with fewer, the deviation would be " +
                                    "above " + bound + "; allow a larger one",
                                left});
  } else if (left == all) {
    report_.warnings.push_back({"all-faces-kept",
                                "all " + faces + " were kept: with fewer, a hole or a fold would " +
                                    "appear, or a connected part would vanish",
                                left});
  } else if (result.triangles.size() == 1) {
    report_.warnings.push_back({"one-triangle",
                                std::string("one triangle ") + (left == 1 ? "" : "and its back ") +
                                    (left == 1 ? "is" : "are") + " all that remains of " + faces +
                                    " with an allowed deviation of " + bound +
                                    "; allow a smaller one",
                                left});
  }
}

}  // namespace kiln
