#include "clean/open_shells.h"

#include <algorithm>

#include "clean/outside_views.h"
#include "mesh/weld.h"
#include "mesh/windings.h"

namespace kiln {
namespace {

/// The mesh counts as a room if views show at least this many times as many back pixels as front pixels.
constexpr std::uint64_t kMinRoomRatio = 2;

}  // namespace

std::vector<OpenShells> find_open_shells(const Mesh& mesh) {
  const std::vector<Triangle> corners = welded_triangles(mesh);
  const FacingParts parts(corners, mesh.positions.size());
  const auto is_open = [](const FacingParts::Part& part) { return !part.closed; };
  if (std::none_of(parts.parts.begin(), parts.parts.end(), is_open)) return {};
  // Group 0 contains all closed parts. The open parts of each material form a group of their own.
  const auto of = [&](std::size_t t) { return mesh.materials.empty() ? 0 : mesh.materials[t]; };
  const std::size_t materials = std::max<std::size_t>(
      1, mesh.materials.empty()
             ? 1
             : std::size_t{1} + *std::max_element(mesh.materials.begin(), mesh.materials.end()));
  std::vector<std::uint32_t> group_of_triangle(corners.size(), 0);
  std::vector<OpenShells> result(materials);
  std::vector<bool> has_example(materials);
  for (std::size_t t = 0; t < group_of_triangle.size(); ++t) {
    if (parts.parts[parts.of[t]].closed) continue;
    group_of_triangle[t] = 1 + of(t);
    if (!has_example[of(t)]) result[of(t)].example = mesh.positions[mesh.triangles[t][0]];
    has_example[of(t)] = true;
  }
  const std::vector<SeenPixels> seen =
      count_seen_pixels(mesh, group_of_triangle, materials + 1, {});
  std::uint64_t front_pixels = seen[0].front, back_pixels = seen[0].back;
  for (std::size_t m = 0; m < materials; ++m) {
    result[m].front = seen[m + 1].front;
    result[m].back = seen[m + 1].back;
    front_pixels += result[m].front;
    back_pixels += result[m].back;
  }
  if (back_pixels > kMinRoomRatio * front_pixels) return {};
  return result;
}

}  // namespace kiln
