// One chart, cut open and flattened: by as-rigid-as-possible rounds, and by rounds that lower the symmetric Dirichlet
// energy without flips or overlaps.
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

/// A triangle in its own plane: the reference shape against which the distortion of maps is measured. Needles are
/// widened a little, so that no weight is unbounded.
struct RestShape {
  /// Gradient of each corner's hat function (1 at the corner, 0 at the others)
  std::array<Vec2d, 3> gradient{};
  double area = 0;
};

struct FlatChart {
  std::vector<std::uint32_t> source;  ///< Index in the surface of each of the chart's triangles
  /// The chart's triangles, with corners as indices of the chart's vertices
  std::vector<Triangle> triangles;
  std::vector<RestShape> rest;          ///< Rest shape of each triangle
  std::vector<std::uint32_t> boundary;  ///< Vertices along the border, counter-clockwise
  std::vector<Vec2d> points;            ///< UV position of each vertex
  std::vector<std::uint32_t> vertex;    ///< Index in the surface of each vertex
  double roughness_energy =
      0;  ///< Estimate of the energy that every layout has because the surface is rough
  /// Minimum distance between border edges in the solvers. It is larger than the change by rounding UVs.
  double min_border_distance = 0;
};

/// Deviation of a layout from an isometry, averaged over a chart's area.
struct FlatDistortion {
  double energy = 0;  ///< Mean of (a^2 + b^2 + 1/a^2 + 1/b^2) / 4 - 1 over singular values a, b.
  double max_stretch = 1;  ///< Largest of a, b, 1/a, 1/b; infinite where a triangle is flipped.
};

/// Limits of a chart's distortion.
struct ChartLimits {
  /// Limit of FlatDistortion::energy minus FlatChart::roughness_energy
  double energy = 0.05;
  double max_stretch = 5;  ///< Limit of the distortion of single triangles
  double length = std::numeric_limits<double>::infinity();  ///< Limit of the flat chart's extent
};

/// Cuts a chart open: corners become one vertex where glued half-edges connect them.
/// \param glued  1 for each half-edge of the surface at which its two triangles are joined
/// \param index_in_chart  scratch memory, one entry per triangle of the surface; any contents
/// \param inverted  1 for each half-edge at which `glued` is inverted; may be empty
/// \param rest   rest shapes of the triangles; if empty, they are computed
FlatChart cut_open(const ChartSurface& surface, std::span<const std::uint32_t> triangles,
                   std::span<const std::uint8_t> glued, std::vector<std::uint32_t>& index_in_chart,
                   std::span<const std::uint8_t> inverted = {}, std::vector<RestShape> rest = {});

/// True if the triangles are connected and their open edges form a single ring.
bool is_disc(const FlatChart& chart);

/// Projects the chart onto the plane perpendicular to its mean normal.
void project_to_mean_plane(FlatChart& chart, const ChartSurface& surface);

/// Lays out a chart of one triangle as its rest shape.
void lay_out_triangle(FlatChart& chart, const ChartSurface& surface);

/// The factorized linear system of as-rigid-as-possible rounds. One system serves a chart in every layout.
class RigidSystem;
std::shared_ptr<RigidSystem> rigid_system(const FlatChart& chart);

/// An initial layout of a chart, from which solvers start. Its weights make solvers hold vertices near their initial
/// positions.
struct FlatStart {
  std::vector<Vec2d> rotations;         ///< Rotation of each triangle as cosine and sine
  std::vector<Vec2d> vertex_positions;  ///< Position of each vertex
  /// For each vertex, the weight that holds it at its position, relative to the weights of its triangles
  std::vector<double> hold_weights;
};

/// Runs as-rigid-as-possible rounds of a local and a global step (Liu, Zhang, Xu, Gotsman, Gortler 2008, section 4).
/// May flip triangles.
/// \param start  initial layout and weights; if null, the chart's points without weights
bool rigid_rounds(FlatChart& chart, int rounds, RigidSystem& system,
                  const FlatStart* start = nullptr);

/// Limits of untangling: number of rounds, of pairs of touching border edges, and of flipped triangles.
struct UntangleEffort {
  int rounds = 10;
  std::size_t touching_sides = 16, flipped_triangles = 8;
  /// Number of border vertices on each side of a touching vertex that are pushed with it
  std::size_t reach = 0;
};

/// Removes slight overlaps of the border and single flipped triangles by as-rigid-as-possible rounds. Touching border
/// vertices are pushed into their chart, and flipped triangles get larger weights. Pushes and weights increase with
/// each round.
/// \param start  weights that hold the vertices that are not pushed; may be null
/// \returns whether the chart has become injective, with its borders apart
bool untangle(FlatChart& chart, const UntangleEffort& effort, RigidSystem& system,
              const FlatStart* start = nullptr);

/// Mean squared distance of the layout's Jacobian to the nearest rotation. For small distortion it approximates the
/// symmetric Dirichlet energy; unlike that energy, it is finite for flipped triangles.
double rigid_energy(const FlatChart& chart);

/// Runs rounds of scalable locally injective mapping (Rabinovich, Poranne, Panozzo, Sorkine-Hornung 2017). Each round
/// lowers the symmetric Dirichlet energy by a line search that stops before a triangle flips (Smith, Schaefer 2015) and
/// before the border touches itself. The chart must be injective on entry, and stays so.
/// \param until  if not null, rounds stop once the chart is within these limits, or once progress is too slow to reach
///   them
/// \param known  linear system of the same triangles, whose sparsity pattern is reused; may be null
/// \param pins   true: in the first half of the rounds, vertices that would touch the border are held in place
void injective_rounds(FlatChart& chart, int rounds, const ChartLimits* until = nullptr,
                      const RigidSystem* known = nullptr, bool pins = false);

/// True if the layout is injective: no triangle is flipped or degenerate, and the border does not touch itself. These
/// two conditions suffice, since an orientation-preserving map of a disc covers a point as often as the border winds
/// around it. Computed in double precision with an error bound; undecided cases count as not injective.
/// \param min_distance  minimum distance between border sides. It does not apply to neighbours, nor to two sides with
///   only one side between them
bool is_injective(const FlatChart& chart, double min_distance = 0);

FlatDistortion distortion(const FlatChart& chart);
bool is_within_limits(const FlatChart& chart, const ChartLimits& limits);

/// True if a flat chart is within its limit of length, or at most slightly longer than its longest edge.
bool is_short(const FlatChart& chart, const ChartLimits& limits);

/// Signed area of all flat triangles together.
double flat_area(const FlatChart& chart);

/// Scales the chart's layout to the chart's area on the surface.
void scale_to_surface_area(FlatChart& chart);

}  // namespace kiln
