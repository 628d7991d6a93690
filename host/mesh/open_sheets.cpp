#include "mesh/open_sheets.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/disjoint_sets.h"
#include "mesh/box.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

struct Part {
  Box<Vec3d> box;
  Vec3d normal{};
  bool has_border = false, one_side = true;
};

Vec3d area_vector_of(const std::array<LowSurface::Corner, 3>& t) {
  const Vec3d a = to_double(t[0].position);
  return cross(to_double(t[1].position) - a, to_double(t[2].position) - a);
}

/// Parts that are connected over welded corners. One of its corners identifies each part.
class PartConnection {
 public:
  explicit PartConnection(const LowSurface& surface) {
    std::vector<Vec3> positions;
    positions.reserve(3 * surface.triangles.size());
    for (const auto& corners : surface.triangles) {
      for (const LowSurface::Corner& corner : corners) positions.push_back(corner.position);
    }
    welded_ = weld_vertices(positions);
    corner_sets_ = DisjointSets(positions.size());
    for (const std::size_t t : surface.usable_triangles()) {
      for (std::size_t k = 1; k < 3; ++k) corner_sets_.join(corner(t, 0), corner(t, k));
    }
  }
  std::uint32_t corner(std::size_t t, std::size_t k) const { return welded_[3 * t + k]; }
  std::uint32_t part(std::size_t t) { return corner_sets_.find(corner(t, 0)); }

 private:
  std::vector<std::uint32_t> welded_;
  DisjointSets corner_sets_{0};
};

}  // namespace

std::vector<float> sheet_sizes(const LowSurface& surface) {
  const std::size_t count = surface.triangles.size();
  PartConnection part_connection(surface);
  std::vector<Part> parts(3 * count);
  for (const std::size_t t : surface.usable_triangles()) {
    Part& part = parts[part_connection.part(t)];
    part.normal = part.normal + area_vector_of(surface.triangles[t]);
  }
  for (const std::size_t t : surface.usable_triangles()) {
    Part& part = parts[part_connection.part(t)];
    if (!(dot(area_vector_of(surface.triangles[t]), part.normal) > 0)) part.one_side = false;
  }
  // Most parts are closed: all their sides have partners. The sides of these parts need not be sorted.
  std::vector<std::pair<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>> sides;
  for (const std::uint32_t t : surface.usable_triangles()) {
    const std::uint32_t name = part_connection.part(t);
    Part& part = parts[name];
    if (!part.one_side) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      part.box.add(to_double(surface.triangles[t][k].position));
      const std::uint32_t a = part_connection.corner(t, k),
                          b = part_connection.corner(t, (k + 1) % 3);
      sides.push_back({std::minmax(a, b), name});
    }
  }
  std::sort(sides.begin(), sides.end());
  for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
    while (end < sides.size() && sides[end].first == sides[i].first) ++end;
    if (end == i + 1) parts[sides[i].second].has_border = true;
  }
  std::vector<float> half_diagonals(count, 0.0F);
  for (const std::size_t t : surface.usable_triangles()) {
    const Part& part = parts[part_connection.part(t)];
    if (!part.has_border || !part.one_side) continue;
    half_diagonals[t] = static_cast<float>(part.box.diagonal() / 2);
  }
  return half_diagonals;
}

}  // namespace kiln
