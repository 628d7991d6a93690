// Finds a cage from the surface above and below the low poly.
#include <algorithm>
#include <cmath>
#include <string>

#include "bake/match_stage.h"
#include "base/counted.h"
#include "base/formatted.h"
#include "kiln/cage.h"
#include "kiln/validate.h"
#include "match/cage_shells.h"
#include "mesh/length.h"
#include "mesh/normals.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

// Lengths as shares of the high poly's diagonal.
constexpr double kDefaultSearchDistance = 0.04;  // search distance without --max-distance
// Distance of the shells from the mesh and from the enclosed faces, where there is space for it
constexpr double kShellMargin = 0.0025;

/// Direction of rays at each vertex; zero if the normals of its faces cancel out.
std::vector<Vec3> ray_directions(const Mesh& low, const std::vector<Vec3>& positions) {
  return continuous_directions(positions, low.triangles, corner_normals(low, positions));
}

Vec3 offset_point(const Vec3& p, const Vec3& direction, double by) {
  return to_float(to_double(p) + to_double(direction) * by);
}

/// Builds one mesh from the outer and the inner shell of a cage. The shells' offsets of each vertex
/// are in frame units.
Mesh make_shells_mesh(const Mesh& low, const std::vector<Vec3>& directions,
                      const CageShells& shells, const std::vector<std::uint32_t>& vertex,
                      double unit) {
  Mesh mesh;
  mesh.name = low.name + "_cage";
  mesh.origin = low.origin;
  mesh.group_names = {"outer", "inner"};
  const std::size_t count = low.positions.size();
  mesh.positions.reserve(2 * count);
  for (std::size_t v = 0; v < count; ++v) {
    mesh.positions.push_back(
        offset_point(low.positions[v], directions[v], double{shells.outward[vertex[v]]} * unit));
  }
  for (std::size_t v = 0; v < count; ++v) {
    mesh.positions.push_back(
        offset_point(low.positions[v], directions[v], -double{shells.inward[vertex[v]]} * unit));
  }
  for (std::uint32_t shell = 0; shell < 2; ++shell) {
    const auto first = static_cast<std::uint32_t>(shell * count);
    for (const Triangle& t : low.triangles) {
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      mesh.groups.push_back(shell);
    }
  }
  return mesh;
}

/// Number of vertices that triangles use and that have no ray direction.
std::uint64_t count_vertices_without_direction(const Mesh& low,
                                               const std::vector<Vec3>& directions) {
  std::vector<std::uint8_t> has_no_direction(low.positions.size());
  for (const Triangle& t : low.triangles) {
    for (const std::uint32_t v : t) has_no_direction[v] = directions[v] == Vec3{} ? 1 : 0;
  }
  return static_cast<std::uint64_t>(
      std::count(has_no_direction.begin(), has_no_direction.end(), 1));
}

Warning warn_of_vertices_without_direction(std::uint64_t count) {
  return {"cage-flat",
          counted(count, "vertex", "vertices") + " of the low poly " +
              (count == 1 ? "belongs" : "belong") +
              " to both sides of a flat card, so the cage cannot be moved away from there: give "
              "each side separate vertices, or leave the cage out.",
          count};
}

}  // namespace

FoundCage find_cage(const Source& source, const Mesh& low, const BakeOptions& given) {
  const Source::Impl& high = impl_of(source);
  BakeOptions options;
  options.match.ray.direction = given.match.ray.direction;
  options.match.ray.edge_width = given.match.ray.edge_width;
  // If only the fallback casts rays, their directions are not blended at edges.
  if (!obeys(match_row(given.match.method).info, "match.ray.direction"))
    options.match.ray.direction = RayDirection::averaged;
  options.match.two_sided = given.match.two_sided;
  options.match.parts = given.match.parts;
  options.match.max_distance = given.match.max_distance;
  check_options(options);
  const LowSurface surface = LowSurface::of(low, high.frame);
  // The width within which directions are blended at edges does not depend on the search distance.
  options.match.max_distance.reset();
  const SampleDirections sample_directions = make_sample_directions(options, high, surface);
  MatchRequest request = match_request(options, high, surface);
  request.distance = to_frame(
      given.match.max_distance.value_or(Length::share(kDefaultSearchDistance)), high.frame);
  const CageNeeds needs = find_cage_needs(request, sample_directions, options.match.parts);

  const std::vector<std::uint32_t> vertex = weld_vertices(low.positions);
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * low.triangles.size());
  for (const Triangle& t : low.triangles) {
    for (const std::uint32_t v : t) corners.push_back(vertex[v]);
  }
  const double diagonal = high.frame.diagonal * high.frame.scale;
  const CageShells shells =
      fit_shells(needs, surface, corners, low.positions.size(), kShellMargin * diagonal);
  const std::vector<Vec3> directions = ray_directions(low, high.frame.to_frame(low));
  FoundCage cage;
  cage.mesh = make_shells_mesh(low, directions, shells, vertex, 1 / high.frame.scale);
  cage.samples = needs.points.list.size();
  cage.conflicts = shells.conflicts;
  if (const std::uint64_t count_without_direction =
          count_vertices_without_direction(low, directions);
      count_without_direction > 0) {
    cage.warnings.push_back(warn_of_vertices_without_direction(count_without_direction));
  }
  return cage;
}

Mesh offset_cage(const Mesh& low, double distance) {
  if (!std::isfinite(distance)) {
    throw Error(ErrorCode::usage,
                "distance is " + decimal(distance) + ": it must be a finite length, world units.");
  }
  validate(low);
  const Frame frame = Frame::of(low);
  const std::vector<Vec3> directions = ray_directions(low, frame.to_frame(low));
  Mesh mesh = low;
  mesh.name = low.name + "_cage";
  mesh.uvs.clear();
  mesh.uv_triangles.clear();
  mesh.tangents.clear();
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    mesh.positions[v] = offset_point(low.positions[v], directions[v], distance);
  }
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  return mesh;
}

}  // namespace kiln
