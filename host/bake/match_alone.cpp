// Runs the stages of a bake up to the match.
#include <utility>

#include "bake/pipeline.h"
#include "base/option.h"
#include "base/progress_guard.h"

namespace kiln {
namespace {

void check_alone(const BakeOptions& options) {
  check_options(options);
  if (options.match.saved == nullptr && options.match.visibility.clusters <= 1 &&
      options.match.fallback_blend == 0) {
    return;
  }
  throw Error(ErrorCode::usage,
              "match() supports neither saved matches, nor clusters, nor blending: leave " +
                  option("match.saved") + ", " + option("match.visibility.clusters") + " and " +
                  option("match.fallback_blend") + " out.",
              "option-contradiction");
}

/// Matches all samples of the low poly, without maps. \throws Cancelled
MatchResult match_alone(const Source::Impl& high, const Mesh& low, BakeOptions options,
                        const BakeProgress& progress) {
  request_only(options, {});
  options.encoding.mips = false;
  options.report.keep_match = true;
  Clusters clusters;
  Pipeline pipeline({high, low, options}, BandStorage::reused, progress);
  pipeline.prepare_match(clusters);
  pipeline.run_over_bands({.match = true, .update_distances = false, .compute_maps = false});
  pipeline.finish_match(true);
  pipeline.finish_report();
  progress.report(1, "done");
  BakeResult& baked = pipeline.result();
  return {std::move(*baked.match), std::move(baked.report), false};
}

}  // namespace

MatchResult match(const Source& source, const Mesh& low, const BakeOptions& options) {
  check_alone(options);
  ProgressGuard guard(options.progress);
  const BakeProgress progress(guard.progress());
  return unless_cancelled<MatchResult>(
      [&] { return match_alone(impl_of(source), low, options, progress); },
      [](MatchResult& none) { none.cancelled = true; });
}

}  // namespace kiln
