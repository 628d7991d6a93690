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

/// A triangle in its own plane: the reference shape for the distortion of maps. Needles are widened a little, so that
/// no weight is unbounded.
struct RestShape {
  std::array<Vec2d, 3> gradient{};  ///< Gradient of each corner's hat function
  double area = 0;
};

struct FlatChart {
  std::vector<std::uint32_t> source;  ///< Index in the surface of each of the chart's triangles
  /// The same triangles, with corners that index the chart's vertices
  std::vector<Triangle> triangles;
  std::vector<RestShape> rest;          ///< Rest shape of each triangle
  std::vector<std::uint32_t> boundary;  ///< Vertices along the border, counter-clockwise
  std::vector<Vec2d> points;            ///< UV position of each vertex
  std::vector<std::uint32_t> vertex;    ///< Index in the surface of each vertex
  double roughness_energy =
      0;  ///< Estimated energy that the surface's roughness causes in every map
  /// Minimum distance of border sides in the solvers, larger than what rounding of UVs takes away
  double apart = 0;
};

/// Deviation from an isometry, averaged over a chart's area.
struct FlatDistortion {
  double energy = 0;  ///< Mean of (a^2 + b^2 + 1/a^2 + 1/b^2) / 4 - 1 over singular values a, b.
  double max_stretch = 1;  ///< Largest of a, b, 1/a, 1/b; infinite where a triangle is flipped.
};

/// Limits of a chart's distortion.
struct ChartLimits {
  double energy =
      0.05;  ///< Limit of the mean energy minus FlatChart::roughness_energy, see FlatDistortion
  double max_stretch = 5;  ///< Limit of the distortion of single triangles
  double length = std::numeric_limits<double>::infinity();  ///< Limit of the flat chart's extent
};

/// Cuts a chart open: corners become one vertex where glued half-edges connect them.
/// \param glued  1 for each half-edge of the surface at which its two triangles are joined
/// \param index_in_chart  scratch, one entry per triangle of the surface; any contents
/// \param inverted  1 for each half-edge at which `glued` is inverted; empty: none
/// \param rest   rest shapes of the triangles; empty if unknown
FlatChart cut_open(const ChartSurface& surface, std::span<const std::uint32_t> triangles,
                   std::span<const std::uint8_t> glued, std::vector<std::uint32_t>& index_in_chart,
                   std::span<const std::uint8_t> inverted = {}, std::vector<RestShape> rest = {});

/// True if the triangles are connected and their open edges form one ring.
bool is_disc(const FlatChart& chart);

/// Projects the chart onto the plane perpendicular to its mean normal.
void project_to_mean_plane(FlatChart& chart, const ChartSurface& surface);

/// Lays out a chart of one triangle as its rest shape.
void lay_out_triangle(FlatChart& chart, const ChartSurface& surface);

/// The factorized system of as-rigid-as-possible rounds; one per chart, independent of its layout.
class RigidSystem;
std::shared_ptr<RigidSystem> rigid_system(const FlatChart& chart);

/// An initial layout of a chart, from which solvers start and near which they may hold vertices.
struct FlatStart {
  std::vector<Vec2d> rotations;         ///< Rotation of each triangle as cosine and sine
  std::vector<Vec2d> vertex_positions;  ///< Position of each vertex
  /// Weight that holds each vertex at its position, relative to the weights of its triangles
  std::vector<double> hold_weights;
};

/// As-rigid-as-possible rounds by local and global steps (Liu, Zhang, Xu, Gotsman, Gortler 2008, section 4). May flip
/// triangles.
/// \param start  initial layout and weights; null: the chart's points, without weights
bool rigid_rounds(FlatChart& chart, int rounds, RigidSystem& system,
                  const FlatStart* start = nullptr);

/// Limits of untangling: rounds, places where the border touches itself, flipped triangles.
struct UntangleEffort {
  int rounds = 10;
  std::size_t touching_sides = 16, flipped_triangles = 8;
  /// Number of border vertices on each side of a touching vertex that are pushed with it
  std::size_t reach = 0;
};

/// Removes slight overlaps of the border and single flipped triangles by as-rigid-as-possible rounds. Touching border
/// vertices are pushed into their chart, and flipped triangles get larger weights. Pushes and weights increase with
/// each round.
/// \param start  weights that hold the vertices that are not pushed; null: none
/// \returns whether the chart has become injective, with its borders apart
bool untangle(FlatChart& chart, const UntangleEffort& effort, RigidSystem& system,
              const FlatStart* start = nullptr);

/// Mean squared distance of the map's Jacobian to the nearest rotation. For small distortion it approximates the
/// symmetric Dirichlet energy; unlike that, it is finite for flipped triangles.
double rigid_energy(const FlatChart& chart);

/// Rounds of scalable locally injective mapping (Rabinovich, Poranne, Panozzo, Sorkine-Hornung 2017). Each lowers the
/// symmetric Dirichlet energy by a line search that stops before a triangle flips (Smith, Schaefer 2015) and before the
/// border meets itself. The chart must be injective, and stays so.
/// \param until  if not null, rounds stop once the chart is within these limits, or progress is too slow to reach
///        them
/// \param known  linear system of the same triangles, whose pattern is reused; may be null
/// \param pins   true: in the first half of the rounds, vertices that would touch the border are held in place
void injective_rounds(FlatChart& chart, int rounds, const ChartLimits* until = nullptr,
                      const RigidSystem* known = nullptr, bool pins = false);

/// True if the map is injective: no triangle flipped or degenerate, and a border that does not meet itself. These two
/// conditions suffice, since an orientation-preserving map of a disc covers a point as often as the border winds
/// around it. Computed in double precision with an error bound; undecided cases count as overlap.
/// \param apart  minimum distance between border sides, except between neighbours and between sides with one side
/// between them
bool is_injective(const FlatChart& chart, double apart = 0);

FlatDistortion distortion(const FlatChart& chart);
bool is_within_limits(const FlatChart& chart, const ChartLimits& limits);

/// True if a flat chart is no longer than its limit, or not much longer than one of its edges.
bool is_short(const FlatChart& chart, const ChartLimits& limits);

/// Signed area of the flat triangles.
double flat_area(const FlatChart& chart);

/// Scales the chart to its area on the surface.
void scale_to_surface_area(FlatChart& chart);

}  // namespace kiln
