// One chart, cut open and flattened: as-rigid-as-possible rounds, and rounds that lower the symmetric Dirichlet energy
// without flips or overlaps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "mesh/vector2.h"
#include "unwrap/chart_surface.h"

namespace kiln {

/// A triangle in its own plane, against which maps of it are measured. Needles are widened a little, so that no weight
/// is unbounded.
struct RestShape {
  std::array<Vec2d, 3> gradient{};  ///< Gradient of each corner's hat function.
  double area = 0;
};

struct FlatChart {
  std::vector<std::uint32_t> source;    ///< Indices of the chart's triangles in the surface.
  std::vector<Triangle> triangles;      ///< The same triangles, by vertices of the chart.
  std::vector<RestShape> rest;          ///< Rest shape of each triangle.
  std::vector<std::uint32_t> boundary;  ///< Vertices along the border, counter-clockwise.
  std::vector<Vec2d> points;            ///< UV position of each vertex.
  std::vector<std::uint32_t> vertex;    ///< The surface's vertex of each vertex.
  double forced = 0;  ///< Estimated energy that the surface's roughness forces on any map.
  double apart = 0;   ///< Solvers keep border sides this far apart: more than rounding moves UVs.
};

/// Deviation from an isometry, averaged over a chart's area.
struct FlatDistortion {
  double energy = 0;  ///< Mean of (a^2 + b^2 + 1/a^2 + 1/b^2) / 4 - 1 over singular values a, b.
  double worst = 1;   ///< Largest of a, b, 1/a, 1/b; infinite where a triangle is flipped.
};

/// Limits of a chart's distortion.
struct ChartLimits {
  double energy = 0.05;  ///< Mean energy beyond FlatChart::forced, see FlatDistortion.
  double worst = 5;      ///< Greatest distortion of any triangle.
  double length = std::numeric_limits<double>::infinity();  ///< Greatest extent of the flat chart.
};

/// Cuts a chart open: corners become one vertex where glued half-edges connect them.
/// \param glued  per half-edge of the surface: its two triangles are joined there
/// \param local  scratch, one entry a triangle of the surface; any contents
/// \param other  per half-edge, 1 inverts `glued`; or empty
/// \param rest   rest shapes of the triangles, if known; or empty
FlatChart cut_open(const ChartSurface& surface, std::span<const std::uint32_t> triangles,
                   std::span<const std::uint8_t> glued, std::vector<std::uint32_t>& local,
                   std::span<const std::uint8_t> other = {}, std::vector<RestShape> rest = {});

/// True if the triangles are connected and their open edges form one ring.
bool is_disc(const FlatChart& chart);

/// Projects the chart onto the plane perpendicular to its mean normal.
void project(FlatChart& chart, const ChartSurface& surface);

/// Lays out a chart of one triangle as its rest shape.
void lay_single(FlatChart& chart, const ChartSurface& surface);

/// The factorized system of as-rigid-as-possible rounds; one per chart, independent of its layout.
class RigidSystem;
std::shared_ptr<RigidSystem> rigid_system(const FlatChart& chart);

/// An initial layout of a chart: solvers start from it and may be held near it.
struct FlatStart {
  std::vector<Vec2d> rotations;  ///< Rotation of each triangle as cosine and sine
  std::vector<Vec2d> places;     ///< Position of each vertex
  /// Weight that holds each vertex at its place, relative to its triangles
  std::vector<double> holds;
};

/// Local-global rounds, as rigid as possible (Liu, Zhang, Xu, Gotsman, Gortler 2008, section 4). May flip triangles.
/// \param start  initial layout and weights; null: the chart's points, without weights
bool rigid_rounds(FlatChart& chart, int rounds, RigidSystem& system,
                  const FlatStart* start = nullptr);

/// Limits of untangling: rounds, touching places of the border, flipped triangles.
struct UntangleEffort {
  int rounds = 10;
  std::size_t touches = 16, flips = 8;
  std::size_t reach = 0;  ///< Border vertices on each side of a touching one that are pushed, too
};

/// Removes slight overlaps of the border and single flipped triangles by as-rigid-as-possible rounds. Touching border
/// vertices are pushed into their chart, and flipped triangles get larger weights. Both increase with each round.
/// \param start  weights that hold the other vertices; null: none
/// \returns whether the chart has become injective, with its borders apart
bool untangle(FlatChart& chart, const UntangleEffort& effort, RigidSystem& system,
              const FlatStart* start = nullptr);

/// Mean squared distance of the map's derivatives to rotations. For small distortion it approximates the symmetric
/// Dirichlet energy, but it is finite for flipped triangles.
double rigid_energy(const FlatChart& chart);

/// Rounds of scalable locally injective mapping (Rabinovich, Poranne, Panozzo, Sorkine-Hornung 2017). Each lowers the
/// symmetric Dirichlet energy by a line search that stops before a triangle flips (Smith, Schaefer 2015) and before the
/// border meets itself. The chart must be injective, and stays so.
/// \param until  if given, rounds end once the chart is within the limits, or progress is too slow to get there
/// \param known  system of the same triangles, whose pattern is reused; or null
/// \param pins   whether vertices that would touch the border are held in place, in the first half of the rounds
void injective_rounds(FlatChart& chart, int rounds, const ChartLimits* until = nullptr,
                      const RigidSystem* known = nullptr, bool pins = false);

/// True if the map is injective: no triangle flipped or degenerate, and a border that does not meet itself. Together
/// these suffice, since an orientation-preserving map of a disc covers a point as often as its border winds around it.
/// Computed in double precision with an error bound: doubtful cases count as overlap.
/// \param apart  least distance between border sides that are neither neighbours nor next but one
bool is_injective(const FlatChart& chart, double apart = 0);

FlatDistortion distortion(const FlatChart& chart);
bool within(const FlatChart& chart, const ChartLimits& limits);

/// True if a flat chart is no longer than its limit, or hardly longer than one of its edges.
bool is_short(const FlatChart& chart, const ChartLimits& limits);

/// Signed area of the flat triangles.
double flat_area(const FlatChart& chart);

/// Scales the chart to its area on the surface.
void normalise(FlatChart& chart);

}  // namespace kiln
