#include "simplify/inside_out.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "base/counted.h"
#include "base/disjoint_sets.h"
#include "mesh/box.h"
#include "mesh/vertex_lists.h"
#include "simplify/small_components.h"

namespace kiln {
namespace {

/// Maximum number of comparisons of boxes. If more were needed, no component is reported.
constexpr std::size_t kMaxComparisons = 10'000'000;

struct ComponentVolume {
  double volume = 0;
  Box<Vec3d> box;
  Vec3d reference_corner{};
  bool has_triangle = false, open = false;
};

std::vector<ComponentVolume> components_of(const Work& work) {
  DisjointSets sets(work.points.size());
  join_parts(work.triangles, sets);
  std::vector<ComponentVolume> components(work.points.size());
  for (const Triangle& t : work.triangles) {
    ComponentVolume& part = components[sets.find(t[0])];
    const Vec3d &a = work.points[t[0]], &b = work.points[t[1]], &c = work.points[t[2]];
    if (!part.has_triangle) part.reference_corner = a;
    part.has_triangle = true;
    part.volume += dot(a - part.reference_corner,
                       cross(b - part.reference_corner, c - part.reference_corner)) /
                   6;
    for (const Vec3d* p : {&a, &b, &c}) part.box.add(*p);
  }
  SideLists(work.triangles, work.points.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        int orientation_sum = 0;
        for (const SideLists::Item& side : sides)
          orientation_sum += SideLists::forward(side) ? 1 : -1;
        if (orientation_sum != 0) components[sets.find(a)].open = true;
      });
  std::erase_if(components,
                [](const ComponentVolume& part) { return !part.has_triangle || part.open; });
  return components;
}

}  // namespace

InsideOutComponents find_inside_out(const Work& work) {
  const std::vector<ComponentVolume> components = components_of(work);
  InsideOutComponents found;
  found.closed = components.size();
  std::vector<const ComponentVolume*> positive_parts, negative_parts;
  for (const ComponentVolume& part : components)
    (part.volume < 0 ? negative_parts : positive_parts).push_back(&part);
  if (positive_parts.size() * negative_parts.size() > kMaxComparisons) return found;
  for (const ComponentVolume* part : negative_parts) {
    if (std::any_of(positive_parts.begin(), positive_parts.end(),
                    [&](const ComponentVolume* s) { return s->box.contains(part->box); })) {
      continue;
    }
    if (found.count++ == 0) found.example = part->reference_corner;
  }
  return found;
}

void warn_of_inside_out(const Work& work,
                        const std::function<std::string(const Vec3d&)>& format_point,
                        std::vector<Warning>& warnings) {
  const InsideOutComponents found = find_inside_out(work);
  if (found.count == 0) return;
  warnings.push_back(
      {"inside-out",
       std::to_string(found.count) + " of " + counted(found.closed, "closed part") +
           " of the high poly " + (found.count == 1 ? "is" : "are") + " inside out, one " +
           format_point(found.example) +
           ": the hull of such a part lies inside it. Flip its normals in the modelling tool",
       found.count});
}

}  // namespace kiln
