// simplify() at work: few faces within a bound.
#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "base/formatted.h"
#include "simplify/simplify_job.h"

namespace kiln {
namespace {

/// Rounds of moving vertices, which makes room for collapses: each saves a tenth, then a thirtieth of the faces.
constexpr int kRelaxRounds = 2;
/// Rounds of moving vertices in the end, to lower the mean deviation.
constexpr int kEvenRounds = 2;
/// Distances are compared in double precision: by so much they may differ from those that are measured.
constexpr double kRounding = 1e-6;
/// Allowed sharpening of sharp edges (cosines), at first and around folds: a blade at 0.1% takes a tenth
/// more faces without.
constexpr double kSharpening = 0.05;
/// Restarts: without sharper edges, then with a closer bound around flaws.
constexpr int kMostRuns = 4;
/// Flaws that this is done for, at most: so many, and one in so many faces. More are the high poly's own.
constexpr std::size_t kMostFlaws = 32, kFacesOfFlaw = 500;

}  // namespace

/// As few faces as the bound allows.
void SimplifyState::run_within() {
  collapser_.run(0);
  for (int round = 0; round < kRelaxRounds && may_relax(); ++round) {
    collapser_.relax(Distances::large);
    collapser_.run(0);
  }
  for (int round = 0; round < kEvenRounds && may_relax(); ++round) {
    collapser_.relax(Distances::all);
  }
}

/// Mends what the bound allows. \returns how many triangles were mended
std::size_t SimplifyJob::mend_within(SimplifyState& shrinking, SimplifyResult& result) {
  std::vector<std::uint32_t> sources;
  shrinking.extract(result, &sources);
  Flaws flaws = check_.find(result.points, result.triangles);
  const std::size_t found = flaws.count();
  for (int round = 0; round < kMendingRounds && !flaws.none(); ++round) {
    const auto bad = [&](const TriangleCorners& corners) { return check_.is_flaw(corners); };
    bool any = false;
    for (const auto* list : {&flaws.flat, &flaws.facing_down, &flaws.folded}) {
      for (const std::uint32_t t : *list) {
        any = shrinking.collapser().mend(sources[t], bad) || any;
      }
    }
    if (!any) break;
    shrinking.extract(result, &sources);
    flaws = check_.find(result.points, result.triangles);
  }
  return found - std::min(found, flaws.count());
}

/// Few faces that all samples are within a bound of. Where triangles are no good, the bound is closer there the next
/// time. \returns no triangles where there is no such way from `work`
SimplifyResult SimplifyJob::within(double bound, const Work& work) {
  const bool own = work.triangles.size() == dense_.triangles.size();
  if (!bound_samples_) {
    bound_samples_ =
        std::make_unique<BoundSamples>(dense_positions_, dense_.triangles, kMostSamples);
  }
  double limit = (1 - kRounding) * bound;
  std::vector<std::vector<Place>> close;
  SimplifyResult best;
  std::size_t best_mended = 0;
  double sharpening = kSharpening;
  for (int run = 0; run < kMostRuns; ++run) {
    SimplifyState shrinking(work, layout(), options_, scale_);
    if (!shrinking.limit_deviation(*bound_samples_, limit, own, close, sharpening)) break;
    shrinking.run_within();
    SimplifyResult result;
    const std::size_t mended = mend_within(shrinking, result);
    result.deviation = measure(result, kMostSamples);
    if (result.deviation.largest > bound) {
      limit *= 0.95 * bound / result.deviation.largest;
      continue;
    }
    result.back =
        distance_back(bound_samples_->surface, to_floats(result.points), result.triangles);
    result.bound = shrinking.is_bound();
    const bool good = is_good(result);
    if (best.triangles.empty() || result.flawed.size() < best.flawed.size()) {
      best = result;
      best_mended = mended;
    }
    const std::size_t most = kMostFlaws + result.triangles.size() / kFacesOfFlaw;
    if (good || result.flawed.empty() || result.flawed.size() > most) break;
    if (std::exchange(sharpening, 0) > 0) continue;
    close.push_back(result.flawed);
    for (Place& place : close.back()) place.radius -= kAroundFlaws;  // As far as the triangle.
  }
  report_.mended = best_mended;
  return best;
}

/// Warns if a bound keeps all faces, or next to none.
void SimplifyJob::warn_of_bound(const SimplifyResult& result) {
  if (options_.faces != 0) return;
  const std::size_t left = count_faces(result), all = faces_of_dense();
  const std::string bound = formatted("%.4g%% of the diagonal", 100 * options_.max_error);
  const std::string faces = std::to_string(all) + " faces";
  if (left == all && all == 1) {
    report_.warnings.push_back(
        {"all-faces-kept", "the mesh has only one usable face, which was kept", left});
  } else if (left == all && result.bound) {
    report_.warnings.push_back({"all-faces-kept",
                                "all " + faces + " were kept: with fewer, the deviation would be " +
                                    "above " + bound + "; ask for a larger one",
                                left});
  } else if (left == all) {
    report_.warnings.push_back({"all-faces-kept",
                                "all " + faces + " were kept: with fewer, a hole or a fold would " +
                                    "come, or a connected part would vanish",
                                left});
  } else if (result.triangles.size() == 1) {
    report_.warnings.push_back({"one-triangle",
                                std::string("one triangle ") + (left == 1 ? "" : "and its back ") +
                                    (left == 1 ? "is" : "are") + " all that a deviation of " +
                                    bound + " leaves of " + faces + "; ask for a smaller one",
                                left});
  }
}

}  // namespace kiln
