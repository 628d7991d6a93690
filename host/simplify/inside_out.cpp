#include "simplify/inside_out.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "base/counted.h"
#include "base/disjoint_sets.h"
#include "mesh/vertex_lists.h"
#include "simplify/small_components.h"

namespace kiln {
namespace {

/// Maximum number of box comparisons. With more components than that allows, none is reported.
constexpr std::size_t kMaxComparisons = 10'000'000;

struct Part {
  double volume = 0;
  Vec3d low{}, high{}, corner{};
  bool used = false, open = false;

  bool holds(const Part& other) const {
    return low.x <= other.low.x && low.y <= other.low.y && low.z <= other.low.z &&
           high.x >= other.high.x && high.y >= other.high.y && high.z >= other.high.z;
  }
};

std::vector<Part> parts_of(const Work& work) {
  DisjointSets sets(work.points.size());
  join_parts(work.triangles, sets);
  std::vector<Part> parts(work.points.size());
  for (const Triangle& t : work.triangles) {
    Part& part = parts[sets.find(t[0])];
    const Vec3d &a = work.points[t[0]], &b = work.points[t[1]], &c = work.points[t[2]];
    if (!part.used) part.low = part.high = part.corner = a;
    part.used = true;
    part.volume += dot(a - part.corner, cross(b - part.corner, c - part.corner)) / 6;
    for (const Vec3d* p : {&a, &b, &c}) {
      part.low = {std::min(part.low.x, p->x), std::min(part.low.y, p->y),
                  std::min(part.low.z, p->z)};
      part.high = {std::max(part.high.x, p->x), std::max(part.high.y, p->y),
                   std::max(part.high.z, p->z)};
    }
  }
  SideLists(work.triangles, work.points.size())
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        int sense = 0;
        for (const SideLists::Item& side : sides) sense += SideLists::forward(side) ? 1 : -1;
        if (sense != 0) parts[sets.find(a)].open = true;
      });
  std::erase_if(parts, [](const Part& part) { return !part.used || part.open; });
  return parts;
}

}  // namespace

InsideOut find_inside_out(const Work& work) {
  const std::vector<Part> parts = parts_of(work);
  InsideOut found;
  found.closed = parts.size();
  std::vector<const Part*> solid, turned;
  for (const Part& part : parts) (part.volume < 0 ? turned : solid).push_back(&part);
  if (solid.size() * turned.size() > kMaxComparisons) return found;
  for (const Part* part : turned) {
    if (std::any_of(solid.begin(), solid.end(), [&](const Part* s) { return s->holds(*part); })) {
      continue;
    }
    if (found.count++ == 0) found.place = part->corner;
  }
  return found;
}

void warn_of_inside_out(const Work& work, const std::function<std::string(const Vec3d&)>& in_words,
                        std::vector<Warning>& warnings) {
  const InsideOut found = find_inside_out(work);
  if (found.count == 0) return;
  warnings.push_back(
      {"inside-out",
       std::to_string(found.count) + " of " + counted(found.closed, "closed part") +
           " of the high poly " + (found.count == 1 ? "is" : "are") + " inside out, one " +
           in_words(found.place) +
           ": the hull lies within. Turn the faces round (flip normals) in the modelling tool",
       found.count});
}

}  // namespace kiln
