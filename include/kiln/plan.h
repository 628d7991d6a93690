#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"
#include "kiln/measure.h"
#include "kiln/mesh.h"

namespace kiln {

struct PlanOptions {
  /// The mean angle, degrees, between rendered normals of the light mesh with its map and those of the
  /// dense one that is to be reached. 0: what larger maps would not improve by more than 5%.
  double max_error = 0;
  /// Everything but the method. Its size is the largest that the map may have.
  BakeOptions bake;
};

/// One bake that was tried and measured.
struct PlanTrial {
  MatchMethod method = MatchMethod::ray;
  std::uint32_t width = 0, height = 0;
  NormalError error;  ///< Over 8 directions of 256 x 256 pixels
  double missed = 0;  ///< Share of samples
  double seconds =
      0;  ///< Of the bake; structures of the source that it was the first to need included
};

struct PlannedBake {
  BakeResult result;
  std::vector<PlanTrial>
      trials;  ///< In order; the last one of the chosen method is what was chosen
  PlanTrial chosen;
  NormalError without_map;  ///< The light mesh's own normals, measured alike
  double wanted = 0;        ///< Degrees; with max_error 0: what that came to
  bool reached = false;
  double seconds_measure = 0;
};

/// Bakes with the cheapest plan that reaches an error: the way to match that costs least on a mesh of this
/// size, and the smallest map.
///
/// Maps are tried from 128 texels a side on, doubling, and measured; the one that reaches the error is the
/// result, so that the trials before it cost about a third of it. Errors fall towards what the light mesh's
/// shape allows, f, by about c / size^2: two sizes tell f and c, and with them which sizes can be skipped,
/// and when larger maps are wasted. Methods are tried in the order of their cost: views first for meshes of
/// more than two million triangles, for which building a hierarchy takes longest, else rays. Where the
/// first falls short, others go on that do better than it on a small map. With a cage, rays alone.
/// \throws as bake(), and Error(usage) for a negative or not finite error, or maps without a normal map
PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options);

}  // namespace kiln
