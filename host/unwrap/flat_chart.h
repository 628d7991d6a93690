// One chart cut open and laid flat: as-rigid-as-possible rounds, and rounds that lower the symmetric Dirichlet energy
// without ever flipping or overlapping.
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

/// A triangle's own plane: what a map of its corners is measured by. Needles count as a little wider
/// than they are, so that no weight grows without bound.
struct RestShape {
  std::array<Vec2d, 3> gradient;  ///< Gradient of each corner's hat function.
  double area = 0;
};

struct FlatChart {
  std::vector<std::uint32_t> source;    ///< Triangles of the surface.
  std::vector<Triangle> triangles;      ///< The same, in vertices of the chart.
  std::vector<RestShape> rest;          ///< The same.
  std::vector<std::uint32_t> boundary;  ///< Vertices along the border, counter-clockwise.
  std::vector<Vec2d> points;            ///< UV position of each vertex.
  std::vector<std::uint32_t> vertex;    ///< The surface's vertex of each.
  double forced = 0;  ///< About the energy that the surface's roughness leaves to every map.
  double apart =
      0;  ///< Rounds keep two sides of the border this far apart: more than UVs are rounded by.
};

/// Deviation from an isometry, over a chart's area.
struct FlatDistortion {
  double energy = 0;  ///< Mean of (a^2 + b^2 + 1/a^2 + 1/b^2) / 4 - 1 over singular values a, b.
  double worst = 1;   ///< Largest of a, b, 1/a, 1/b; infinite where a triangle is flipped.
};

/// Limits of a chart's distortion.
struct ChartLimits {
  double energy = 0.05;  ///< Mean beyond what roughness forces, see FlatDistortion.
  double worst = 5;      ///< At any triangle.
  double length = std::numeric_limits<double>::infinity();  ///< From end to end, as it lies flat.
};

/// Cuts a chart open: corners are one vertex where glued half-edges connect them.
/// \param glued  per half-edge of the surface, whether its two triangles are joined there
/// \param local  scratch, one entry a triangle of the surface; any contents
/// \param other  per half-edge, 1 where it counts as the opposite of `glued`; or empty
/// \param rest   of the triangles, where known; or empty
FlatChart cut_open(const ChartSurface& surface, std::span<const std::uint32_t> triangles,
                   std::span<const std::uint8_t> glued, std::vector<std::uint32_t>& local,
                   std::span<const std::uint8_t> other = {}, std::vector<RestShape> rest = {});

/// True if the triangles are connected and their open edges form one ring.
bool is_disc(const FlatChart& chart);

/// Lays the chart on the plane across its mean normal.
void project(FlatChart& chart, const ChartSurface& surface);

/// Lays a chart of one triangle as its rest shape.
void lay_single(FlatChart& chart, const ChartSurface& surface);

/// The factorised system of as-rigid-as-possible rounds; one per chart, independent of its points.
class RigidSystem;
std::shared_ptr<RigidSystem> rigid_system(const FlatChart& chart);

/// An initial layout of a chart: rounds start from it and may be held near it.
struct FlatStart {
  std::vector<Vec2d> rotations;  ///< Rotation of each triangle as cosine and sine
  std::vector<Vec2d> places;     ///< Position of each vertex
  std::vector<double> holds;     ///< Weight that holds each vertex there, relative to its triangles
};

/// Local and global rounds, as rigid as possible (Liu, Zhang, Xu, Gotsman, Gortler 2008, section 4).
/// May flip triangles.
/// \param start  where to start from, and what holds vertices; null: the chart's points, and nothing
bool rigid_rounds(FlatChart& chart, int rounds, RigidSystem& system,
                  const FlatStart* start = nullptr);

/// Limits of untangling: rounds, touching places of the border, flipped triangles.
struct UntangleEffort {
  int rounds = 10;
  std::size_t touches = 16, flips = 8;
  std::size_t reach =
      0;  ///< So many of the border's vertices on each side of those that touch are pushed, too
};

/// Pulls borders off each other where they overlap a little, and turns single triangles that are flipped. Rounds
/// are as rigid as possible. What touches is pushed into its own chart; what is flipped weighs more. Both grow
/// each time.
/// \param start  what holds vertices that are not pushed; null: nothing
/// \returns whether the chart has become injective, with its borders apart
bool untangle(FlatChart& chart, const UntangleEffort& effort, RigidSystem& system,
              const FlatStart* start = nullptr);

/// Mean squared distance of the map's derivatives to rotations: for small distortion about the symmetric
/// Dirichlet energy, but finite where triangles are flipped.
double rigid_energy(const FlatChart& chart);

/// Rounds of scalable locally injective mapping (Rabinovich, Poranne, Panozzo, Sorkine-Hornung 2017).
/// Each lowers the symmetric Dirichlet energy along a line. That stops before a triangle flips (Smith,
/// Schaefer 2015), and before the border meets itself. The chart must be injective, and stays so.
/// \param until  where given, they end as soon as the chart is within, or cannot become so at their pace
/// \param known  of the same triangles: its pattern is used again; or null
/// \param pins   whether what would touch stays where it is, in the first half of the rounds
void injective_rounds(FlatChart& chart, int rounds, const ChartLimits* until = nullptr,
                      const RigidSystem* known = nullptr, bool pins = false);

/// True if the map is one to one: no triangle flipped or flat, and a border that does not meet itself.
/// In double precision with an error bound: what is in doubt counts as overlap. Together the two
/// suffice, since a disc's map that keeps orientation covers a point as often as its border winds.
/// \param apart  sides of the border that are farther along it than the next but one must be this far apart
bool is_injective(const FlatChart& chart, double apart = 0);

FlatDistortion distortion(const FlatChart& chart);
bool within(const FlatChart& chart, const ChartLimits& limits);

/// True if a flat chart is no longer than its limit from end to end, or hardly longer than one of its edges.
bool is_short(const FlatChart& chart, const ChartLimits& limits);

/// Signed area of the flat triangles.
double flat_area(const FlatChart& chart);

/// Scales the chart to the surface's area.
void normalise(FlatChart& chart);

}  // namespace kiln
