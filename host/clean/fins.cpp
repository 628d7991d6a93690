// Finds fins: a few faces attached to an edge that two other faces share.
#include <algorithm>

#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"
#include "mesh/windings.h"

namespace kiln {
namespace {

/// Largest share of the area that is removed as fins. A larger share is assumed to be intended, and kept.
constexpr double kMaxFinShare = 0.1;

}  // namespace

std::vector<std::uint8_t> find_fins(const Mesh& mesh, double size, Cleaned& fins) {
  const std::vector<Triangle> corners = welded_triangles(mesh);
  std::vector<std::uint8_t> is_open(corners.size(), 0), is_attached(corners.size(), 0),
      is_crowded(corners.size(), 0);
  bool any = false;
  SideLists(corners, mesh.positions.size())
      .each_edge([&](std::uint32_t, std::span<const SideLists::Item> sides) {
        if (sides.size() == 2) return;
        any = any || sides.size() == 3;
        std::vector<std::uint8_t>& of = sides.size() == 1   ? is_open
                                        : sides.size() == 3 ? is_attached
                                                            : is_crowded;
        for (const SideLists::Item& side : sides) of[side.index / 3] = 1;
      });
  if (!any) return {};
  const FacingParts parts(corners, mesh.positions.size());
  struct PartExtent {
    Box<Vec3d> box;
    double area = 0;
    bool is_open = false, is_attached = false, is_crowded = false;
  };
  std::vector<PartExtent> sums(parts.parts.size());
  double total_area = 0, area = 0;
  for (std::size_t t = 0; t < corners.size(); ++t) {
    PartExtent& of = sums[parts.of[t]];
    add_triangle(of.box, mesh, corners[t]);
    const double own = area_of(mesh, corners[t]);
    of.area += own;
    total_area += own;
    of.is_open = of.is_open || is_open[t] != 0;
    of.is_attached = of.is_attached || is_attached[t] != 0;
    of.is_crowded = of.is_crowded || is_crowded[t] != 0;
  }
  const auto is_fin = [&](const PartExtent& of) {
    return of.is_open && of.is_attached && !of.is_crowded && of.box.diagonal() < size;
  };
  Cleaned found;
  for (std::size_t p = 0; p < sums.size(); ++p) {
    if (!is_fin(sums[p])) continue;
    area += sums[p].area;
    if (found.count++ == 0) found.example = mesh.positions[mesh.triangles[parts.parts[p].first][0]];
  }
  if (found.count == 0 || area > kMaxFinShare * total_area) return {};
  fins = found;
  std::vector<std::uint8_t> dropped(corners.size());
  for (std::size_t t = 0; t < dropped.size(); ++t) dropped[t] = is_fin(sums[parts.of[t]]);
  return dropped;
}

}  // namespace kiln
