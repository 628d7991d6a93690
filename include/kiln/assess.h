#pragma once

#include <cstdint>
#include <vector>

#include "kiln/bake.h"
#include "kiln/export.h"
#include "kiln/image_data.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Distribution of a quantity over the low poly's surface, weighted by area.
struct Distribution {
  double area = 0;    ///< Area of the surface on which the quantity is defined, world units squared
  double mean = 0;    ///< Area-weighted mean
  double rms = 0;     ///< Root mean square
  double median = 0;  ///< Value that half of the area does not exceed
  double p95 = 0;     ///< Value that 95% of the area does not exceed
  double p99 = 0;     ///< Value that 99% of the area does not exceed
  double max = 0;     ///< Maximum
};

/// Statistics of a quantity over viewing rays. Each pixel of each picture has the same weight.
struct RayMeasure {
  double mean = 0;  ///< Mean over the rays
  double rms = 0;   ///< Root mean square
  /// Share of the rays that show a matched texel for which the quantity is defined, 0 to 1.
  double share = 0;
};

/// How evenly the match samples the high poly: steps between the matched points of neighbouring texels,
/// compared with the steps between the texels themselves.
struct Uniformity {
  /// Mean over pairs of neighbouring texels a and b of 100 | |F(a) - F(b)| / |a - b| - 1 |, percent
  double mean_percent = 0;
  std::uint64_t pairs = 0;  ///< Number of pairs of neighbouring texels that `mean_percent` averages
};

/// The measures per texel, for heat maps: one channel, rows from the top, width and height of the
/// match. -1 where a measure is undefined (not covered, missed, never visible); `stretch` has its
/// own markers.
struct AssessmentFields {
  Image object_space = {};            ///< Mean over the rays that show the texel, world units
  Image image_space = {};             ///< Mean over the rays that show the texel, world units
  Image normalised_image_space = {};  ///< Mean over the rays that show the texel, 0 to 1
  Image uniformity = {};      ///< Mean deviation of the texel's steps from even ones, percent
  Image match_distance = {};  ///< Distance |F(p) - p|, world units
  /// log2 of the high poly's area over the low poly's; -64 where undefined, -63 where cells are folded
  /// over
  Image stretch = {};
};

/// Settings of assess().
struct AssessOptions {
  /// Number of test directions, 12 to 4096, spread evenly over the sphere; none coincides with one
  /// of `avoid`.
  std::uint32_t directions = 512;
  std::vector<Vec3> avoid = {};  ///< Unit directions of the views by which the match was made
  bool fields = false;     ///< Also return the measures of each texel, in MatchAssessment::fields
  Progress progress = {};  ///< Called after each test direction; may cancel. See Progress
};

/// Quality of a correspondence F from the low poly to the high poly, measured without any map:
/// Tarini, Cignoni, Scopigno, "Visibility based methods and assessment for detail-recovery" (2003),
/// section 4. Positions are compared as numbers, never as colours.
///
/// A viewing ray comes from a test direction d. The ray shows the point p of the low poly where its
/// first hit is a front face; back faces occlude but are not rated. Rays lie as evenly as the
/// pixels of an orthogonal picture, but need no pixel size: each texel is weighted by its area
/// times the cosine between d and the face's normal. Texels without a match have no ray.
struct MatchAssessment {
  bool cancelled = false;     ///< The progress callback cancelled: the figures are empty
  std::uint64_t samples = 0;  ///< Samples of the match that the low poly covers
  std::uint64_t missed = 0;   ///< Covered samples without a matched point
  double diagonal = 0;        ///< Diagonal of the high poly's bounding box, world units

  /// Section 4.1: distance from F(p) to the first hit of the same ray on the high poly, if that is
  /// a front face. World units.
  RayMeasure object_space = {};
  /// Section 4.2: the distance from F(p) to the ray, world units.
  RayMeasure image_space = {};
  /// Section 4.2.1: image_space divided by |p - F(p)|, 0 to 1. Undefined where F(p) is closer than
  /// 1e-6 diagonals to p.
  RayMeasure normalised_image_space = {};
  /// Section 4.3: uniformity of the spacing of points, over pairs of texels of one chart that share a side.
  Uniformity uniformity = {};
  /// Uniformity over pairs of texels that are neighbours on the surface across a UV seam. Pairs
  /// that are closer than half a texel are left out, since the ratio of such small steps is noise.
  Uniformity uniformity_across_seams = {};

  // The measures below are not in the paper.

  /// |F(p) - p| over the low poly.
  Distribution match_distance = {};
  /// image_space, averaged over the rays that show each texel, then over the low poly's area: a texel that
  /// few directions see counts as much as one that many see.
  Distribution image_space_over_area = {};
  double never_visible = 0;  ///< Share of the area that no test direction sees

  /// Evenness with which F samples the high poly: for each cell, log2 of the ratio of the matched area
  /// on the high poly to the cell's area on the low poly. A cell lies between a texel and its neighbours
  /// to the right and below, in the same chart.
  /// Distribution of |log2(area ratio) - mean_stretch| over the cells; 0: F samples perfectly evenly
  Distribution stretch = {};
  double mean_stretch = 0;  ///< Mean over the rated cells of the log2 of the area ratio
  std::uint64_t cells = 0;  ///< Number of rated cells
  double folded = 0;        ///< Share of cells whose corners F maps in reversed order
  /// Largest distance between matched points of neighbouring texels, world units
  double largest_jump = 0;
  /// Largest distance between neighbouring texels on the low poly, for comparison
  double largest_step = 0;

  std::uint32_t directions = 0;  ///< Number of test directions used
  AssessmentFields fields = {};  ///< Measures of each texel; set if AssessOptions::fields is true
  double seconds = 0;            ///< Duration of the rating
};

/// Rates a match, which must be made for `low`. Lifetimes: arguments are read during the call, and none is
/// kept. Threads: several threads may rate from one Source. The callback runs on the calling thread; its
/// exceptions leave assess(). Welding: neighbours across a seam are found by exactly equal positions.
/// \throws Error(usage) for directions out of range, Error(input) where the match does not fit the meshes,
///         Error(device)
/// Deterministic. Cost on two cores: the bunny at 512 x 512 texels, 512 directions: about 5 s.
MatchAssessment assess(const Source& source, const Mesh& low, const Match& match,
                       const AssessOptions& options = {});

}  // namespace kiln
