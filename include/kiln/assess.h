#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// A quantity over the low poly, by area: how much of the surface has which value.
struct Distribution {
  double area = 0;    ///< Area of the surface where there is a value, world units squared
  double mean = 0;    ///< By area
  double rms = 0;     ///< Root of the mean square
  double median = 0;  ///< The value that half of the area is not above
  double p95 = 0;     ///< The value that 95% of the area is not above
  double p99 = 0;     ///< The value that 99% of the area is not above
  double max = 0;     ///< The greatest value
};

/// A quantity of viewing rays: every pixel of every picture counts the same.
struct RayMeasure {
  double mean = 0;  ///< Over those rays
  double rms = 0;   ///< Root of the mean square
  /// Share of the rays that show a matched place of the low poly which have this quantity, 0 to 1.
  double share = 0;
};

/// Difference between steps from match to match of neighbouring texels and the steps between the texels
/// themselves.
struct Uniformity {
  double mean_percent = 0;  ///< Mean of 100 | |F(a) - F(b)| / |a - b| - 1 |
  std::uint64_t pairs = 0;  ///< Number of pairs of texels a, b
};

/// The same, texel by texel, for heat maps: one channel, rows from the top, width and height of the
/// match. -1 where there is no value (not covered, missed, never visible), but for `stretch`.
struct AssessmentFields {
  Image object_space = {};            ///< World units: the mean over the rays that show the texel
  Image image_space = {};             ///< World units: the same
  Image normalised_image_space = {};  ///< 0 to 1: the same
  Image uniformity = {};              ///< %: the mean over the texel's neighbours
  Image match_distance = {};          ///< World units
  Image stretch =
      {};  ///< log2 of the high poly's area over the low poly's; -64 where there is no value, -63 where cells
  ///< are folded over
};

/// Settings of assess().
struct AssessOptions {
  /// Test directions, 12 to 4096, spread evenly; none is one of `avoid`.
  std::uint32_t directions = 512;
  std::vector<Vec3> avoid = {};  ///< Directions that the match was made from, unit
  bool fields = false;           ///< Fill MatchAssessment::fields
  Progress progress = {};        ///< Called between directions; may cancel. See Progress
};

/// Quality of a correspondence F from the low poly to the high poly, without looking at any map:
/// Tarini, Cignoni, Scopigno, "Visibility based methods and assessment for detail-recovery" (2003),
/// section 4. Positions are compared as numbers, never as colours.
///
/// A viewing ray comes from a test direction d. It shows the point p of the low poly where it
/// meets a front face first; back faces hide what is behind them and are not looked at. Rays
/// lie as evenly as the pixels of an orthogonal picture, without a size of pixels: each texel
/// stands for its area times the cosine at which d sees it. Texels without a match have no ray.
struct MatchAssessment {
  bool cancelled = false;     ///< The progress callback said stop: the figures are empty
  std::uint64_t samples = 0;  ///< Samples of the match that the low poly covers
  std::uint64_t missed = 0;   ///< Samples among these without a point
  double diagonal = 0;        ///< Diagonal of the high poly's bounding box, world units

  /// Section 4.1: from F(p) to where the same ray first meets the high poly, if it meets a front
  /// face there. World units.
  RayMeasure object_space = {};
  /// Section 4.2: the distance from F(p) to the ray, world units.
  RayMeasure image_space = {};
  /// Section 4.2.1: the same over |p - F(p)|, 0 to 1. Where F(p) is p, to a millionth of the diagonal,
  /// there is none.
  RayMeasure normalised_image_space = {};
  /// Section 4.3: over neighbours, above, below and beside each other, of one chart.
  Uniformity uniformity = {};
  /// The same over texels that are neighbours on the surface, across a seam of the layout. Pairs nearer
  /// than half a texel are left out: their steps say nothing.
  Uniformity uniformity_across_seams = {};

  // Kiln's own measures.

  /// |F(p) - p| over the low poly.
  Distribution match_distance = {};
  /// Each place's mean of image_space, over the low poly: here what is seen from few directions
  /// counts as much as what is seen from many.
  Distribution image_space_by_place = {};
  double never_visible = 0;  ///< Share of the area that no test direction sees

  /// Evenness with which F samples the high poly: log2 of its area over the low poly's area. A cell lies
  /// between a texel and its neighbours to the right and below, in the same chart.
  Distribution stretch = {};  ///< Distribution of |log2 - mean log2|: 0 is perfectly even
  double mean_stretch = 0;    ///< Mean log2
  std::uint64_t cells = 0;    ///< Cells that were rated
  double folded = 0;          ///< Share of cells whose corners F puts in the opposite order
  double largest_jump = 0;    ///< Between matches of neighbouring texels, world units
  double largest_step = 0;    ///< Between neighbouring texels themselves, to compare with

  std::uint32_t directions = 0;  ///< Test directions, as used
  AssessmentFields fields = {};  ///< Set where AssessOptions::fields asks for them
  double seconds = 0;            ///< Seconds that the rating took
};

/// Rates a match. Its samples must be those of `low` at the match's size.
/// Lifetimes: all is read during the call, and nothing is kept. Threads: several may rate from one Source; the
/// callback comes on the caller's, and what it throws leaves assess(). Welding: neighbours across a seam are
/// found by exactly equal positions.
/// \throws Error(usage) for directions out of range, Error(input) where the match does not fit the meshes,
///         Error(device)
/// Deterministic. Cost on two cores: the bunny at 512², 512 directions: some 5 s.
MatchAssessment assess(const Source& source, const Mesh& low, const Match& match,
                       const AssessOptions& options = {});

}  // namespace kiln
