// Measures the errors of a bake's maps against finer evaluations of the same surface.
#pragma once

#include <functional>
#include <memory>

#include "bake/fallback_blend.h"
#include "bake/layers.h"
#include "bake/progress.h"
#include "match/cage_reach.h"
#include "match/matcher.h"
#include "texel/sample_directions.h"
#include "texel/sheet_distances.h"

namespace kiln {

/// A bake whose errors are measured, with its matcher and maps.
struct BakedScene {
  const Source::Impl& high;
  /// Source::Impl::matched_part() if the high poly is larger than memory; else null. It holds other triangles afterwards.
  Source::Impl* streamed_part;
  const LowSurface& surface;
  const BakeOptions& options;
  const SampleDirections& directions;
  const SheetDistances& sheet_distances;
  const CageReach& cage;
  Matcher& matcher;
  /// Makes the bake's matcher for options with another number of samples.
  std::function<std::unique_ptr<Matcher>(const BakeOptions& options)> make_matcher;
  /// The blend of the match into its fallback, after its distances to the border were computed; null if no
  /// blend was requested
  FallbackBlend* blend;
  const Layers& layers;  ///< The bake's maps before padding
};

/// Fills BakeReport::errors. Up to 2,000 texels, spread evenly over the baked texels, are evaluated again by one of
/// two methods. Maps of rays are cast from the same points with 4096 rays. Maps of averages are sampled with 4 x 4
/// times as many points a texel (16 x 16 at most), each of which is matched; this includes the error of sampling the
/// texel's area, and variations of the match between the bake's points. A saved match has no further points, so its
/// maps of averages are not compared. Each evaluation prepares, matches and blends its samples as the bake does. If
/// the match reads the positions of samples within texels (Matcher::reads_sample_positions()), a
/// matcher is made for the finer samples.
void measure_errors(const BakedScene& scene, const BakeProgress& progress, BakeReport& report);

}  // namespace kiln
