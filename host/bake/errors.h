// The maps of a bake against finer evaluations of the same surface.
#pragma once

#include <functional>
#include <memory>

#include "bake/fallback_blend.h"
#include "bake/layers.h"
#include "bake/progress.h"
#include "match/cage_reach.h"
#include "match/matcher.h"
#include "texel/edge_turn.h"
#include "texel/sheet_reach.h"

namespace kiln {

/// A bake whose errors are measured: meshes, options, matcher and maps.
struct BakedScene {
  const Source::Impl& high;
  const LowSurface& surface;
  const BakeOptions& options;
  const EdgeTurn& turn;
  const SheetReach& sheets;
  const CageReach& cage;
  Matcher& matcher;
  /// Makes the bake's matcher for options that differ from the bake's in samples alone.
  std::function<std::unique_ptr<Matcher>(const BakeOptions& options)> make_matcher;
  FallbackBlend* blend;  ///< As planned; null: the match and its fallback are not blended
  const Layers& layers;  ///< As they are before padding
};

/// Fills BakeReport::errors. Up to 2,000 texels, spread evenly over the baked texels, are made anew
/// in two ways: maps of rays at the same points with 4096 rays; maps that are averages from 4 x 4
/// times as many points a texel (16 x 16 at most). There each point is matched by itself, and a texel
/// has as many rays. The second takes the texel's own area into account, and whatever the match does
/// between points. A saved match has no further points, so it is compared in the first way alone.
/// Each evaluation prepares its samples, matches and blends them as the bake does, by a matcher made for their number
/// where the match reads places within texels (Matcher::reads_sample_places()).
void measure_errors(const BakedScene& scene, const BakeProgress& progress, BakeReport& report);

}  // namespace kiln
