// The maps of a bake against finer evaluations of the same surface.
#pragma once

#include "bake/layers.h"
#include "bake/progress.h"
#include "match/cage_reach.h"
#include "match/matcher.h"
#include "texel/edge_turn.h"

namespace kiln {

/// A bake whose errors are measured: meshes, options, matcher and maps.
struct BakedScene {
  const Source::Impl& high;
  const LowSurface& surface;
  const BakeOptions& options;
  const EdgeTurn& turn;
  const CageReach& cage;
  Matcher& matcher;
  const Layers& layers;  ///< As they are before padding
};

/// Fills BakeReport::errors. Up to 2,000 texels, spread evenly over the baked texels, are made anew
/// in two ways: maps of rays at the same points with 4096 rays; maps that are averages from 4 x 4
/// times as many points a texel (16 x 16 at most). There each point is matched by itself, and a texel
/// has as many rays. The second takes the texel's own area into account, and whatever the match does
/// between points. A saved match has no further points, so it is compared in the first way alone.
void measure_errors(const BakedScene& scene, const BakeProgress& progress, BakeReport& report);

}  // namespace kiln
