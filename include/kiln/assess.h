#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"
#include "kiln/image.h"
#include "kiln/mesh.h"

namespace kiln {

/// A quantity over the light surface, by area: how much of the surface has which value.
struct Distribution {
  double area = 0;    ///< Of the surface where there is a value, world units squared
  double mean = 0;    ///< By area
  double rms = 0;     ///< Root of the mean square
  double median = 0;  ///< The value that half of the area is not above
  double p95 = 0;     ///< The value that 95% of the area is not above
  double p99 = 0;     ///< The value that 99% of the area is not above
  double max = 0;     ///< The greatest value
};

/// The same, texel by texel, for heat maps: one channel, rows from the top, width and height of the
/// match. -1 where there is no value (not covered, missed, never visible), but for `stretch`.
struct AssessmentFields {
  Image object_distance;  ///< World units
  Image image_distance;   ///< World units
  Image
      stretch;  ///< log2 of dense area over light area; -64 where there is no value, -63 where cells
                ///< are folded over
};

/// How assess() rates a match.
struct AssessOptions {
  /// Test directions, 12 to 4096, spread evenly; none is one of `avoid`.
  std::uint32_t directions = 512;
  std::vector<Vec3> avoid;  ///< Directions that the match was made from, unit
  bool fields = false;      ///< Fill MatchAssessment::fields
  Progress progress;        ///< Called now and then; may cancel
};

/// How good a correspondence F from the light surface to the dense one is, without looking at any map:
/// Tarini, Cignoni, Scopigno, "Visibility based methods and assessment for detail-recovery" (2003),
/// section 4. Positions are compared as numbers, never as colours.
struct MatchAssessment {
  bool cancelled = false;     ///< The progress callback said stop: the figures are empty
  std::uint64_t samples = 0;  ///< Of the match that the light mesh covers
  std::uint64_t missed = 0;   ///< Of these, without a point
  double diagonal = 0;        ///< Of the dense mesh's bounding box, world units

  /// Section 4.1: |F(p) - p|.
  Distribution object_distance;

  /// Section 4.2: how far p and F(p) are apart in a picture from direction d, |x - (x.d) d| with x =
  /// F(p) - p, for the directions from which p is visible on the light mesh (back faces hide others and
  /// are not looked at themselves). Here each p counts by its area, with its mean over directions, which
  /// weigh by how much they face it: the normalised measure.
  Distribution image_distance;
  /// The plain measure: the mean over the pixels of all pictures together, so that what is seen from more
  /// directions counts more.
  double image_distance_plain = 0;
  double never_visible = 0;  ///< Share of the area that no test direction sees

  /// Section 4.3: how evenly F samples the dense surface. log2 of the dense area over the light area of
  /// each cell between a texel and its neighbours to the right and below, of the same chart.
  Distribution stretch;     ///< Of |log2 - mean log2|: 0 is perfectly even
  double mean_stretch = 0;  ///< Mean log2
  std::uint64_t cells = 0;  ///< That were rated
  double folded = 0;        ///< Share of cells whose corners F puts in the opposite order
  double largest_jump = 0;  ///< Between matches of neighbouring texels, world units
  double largest_step = 0;  ///< Between neighbouring texels themselves, to compare with

  std::uint32_t directions = 0;  ///< Test directions, as used
  AssessmentFields fields;       ///< Where AssessOptions::fields asks for them
  double seconds = 0;            ///< That the rating took
};

/// Rates a match. Its samples must be those of `low` at the match's size.
/// \throws Error(usage) for directions out of range, Error(input) where the match does not fit the meshes,
///         Error(device)
/// Deterministic. Cost on two cores: the bunny at 512², 512 directions: 1 to 2 s.
MatchAssessment assess(const Source& source, const Mesh& low, const Match& match,
                       const AssessOptions& options = {});

}  // namespace kiln
