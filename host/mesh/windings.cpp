// Detects and reverses inconsistently oriented triangles.
#include "mesh/windings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "kiln/mesh.h"
#include "kiln/validate.h"
#include "mesh/high_poly_normals.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// In a part with inconsistent orientation, the group of equally oriented triangles with less area is clearly the wrong
/// one if its share of the area is at most this.
constexpr double kMaxWrongShare = 0.4;

/// True if two triangles traverse an edge in the same direction, which never happens with consistent orientation.
bool has_repeated_side(std::span<const Triangle> triangles, std::size_t vertices) {
  std::vector<std::uint32_t> list_start(vertices + 1, 0), ends(triangles.size() * 3);
  for (const Triangle& t : triangles) {
    for (const std::uint32_t v : t) ++list_start[v];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& list : list_start) list = sum += list;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) ends[--list_start[t[k]]] = t[(k + 1) % 3];
  }
  constexpr std::size_t kListsPerTask = std::size_t{1} << 14, kMaxLinearSearch = 16;
  std::vector<std::uint8_t> is_found_in_task((vertices + kListsPerTask - 1) / kListsPerTask, 0);
  parallel_for(vertices, kListsPerTask, [&](std::size_t begin, std::size_t end) {
    bool any = false;
    for (std::size_t v = begin; v < end && !any; ++v) {
      const std::span<std::uint32_t> list(ends.data() + list_start[v],
                                          ends.data() + list_start[v + 1]);
      if (list.size() > kMaxLinearSearch) {
        std::sort(list.begin(), list.end());
        any = std::adjacent_find(list.begin(), list.end()) != list.end();
        continue;
      }
      for (std::size_t i = 1; i < list.size(); ++i) {
        any |= std::find(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(i), list[i]) !=
               list.begin() + static_cast<std::ptrdiff_t>(i);
      }
    }
    is_found_in_task[begin / kListsPerTask] = any;
  });
  return std::find(is_found_in_task.begin(), is_found_in_task.end(), 1) != is_found_in_task.end();
}

bool same_corners(Triangle a, Triangle b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  return a == b;
}

/// For each side, the other side at the same edge if exactly two different triangles share the edge; else
/// FacingParts::kNone. Side 3 t + k runs from corner k of triangle t to the next corner.
class SideTwins {
 public:
  SideTwins(std::span<const Triangle> triangles, std::size_t vertices)
      : triangles_(triangles), twins_(3 * triangles.size(), FacingParts::kNone) {
    const Adjacency by_vertex = Adjacency::make(
        vertices, twins_.size(), [&](std::size_t side) { return std::size_t{ends(side)[0]}; });
    constexpr std::size_t kVerticesPerTask = std::size_t{1} << 14;
    parallel_for(vertices, kVerticesPerTask, [&](std::size_t begin, std::size_t end) {
      std::vector<std::pair<std::uint32_t, std::uint32_t>>
          sides_by_higher;  // Halfedges with the higher vertex of their edge, sorted by it
      for (std::size_t v = begin; v < end; ++v) {
        sides_by_higher.clear();
        for (const std::uint32_t side : by_vertex.of(v))
          sides_by_higher.push_back({ends(side)[1], side});
        std::sort(sides_by_higher.begin(), sides_by_higher.end());
        for (std::size_t first = 0, last = 0; first < sides_by_higher.size(); first = last) {
          while (last < sides_by_higher.size() &&
                 sides_by_higher[last].first == sides_by_higher[first].first)
            ++last;
          if (last != first + 2) continue;
          const std::uint32_t a = sides_by_higher[first].second,
                              b = sides_by_higher[first + 1].second;
          if (a / 3 == b / 3 || same_corners(triangles[a / 3], triangles[b / 3])) continue;
          twins_[a] = b;
          twins_[b] = a;
        }
      }
    });
  }

  std::uint32_t of(std::size_t side) const { return twins_[side]; }
  /// True if both triangles traverse the edge in the same direction, so that their orientations are opposite.
  bool have_same_direction(std::size_t side) const {
    return triangles_[side / 3][side % 3] == triangles_[twins_[side] / 3][twins_[side] % 3];
  }
  /// The sides of a triangle, in the order of their edges' vertices.
  std::array<std::uint32_t, 3> sides_in_order(std::uint32_t t) const {
    std::array<std::uint32_t, 3> sides{3 * t, 3 * t + 1, 3 * t + 2};
    std::sort(sides.begin(), sides.end(),
              [&](std::uint32_t a, std::uint32_t b) { return ends(a) < ends(b); });
    return sides;
  }

 private:
  /// The two vertices of a side, the lower one first.
  std::array<std::uint32_t, 2> ends(std::size_t side) const {
    const Triangle& t = triangles_[side / 3];
    const std::size_t k = side % 3;
    const std::uint32_t a = t[k], b = t[k == 2 ? 0 : k + 1];
    return {std::min(a, b), std::max(a, b)};
  }

  std::span<const Triangle> triangles_;
  std::vector<std::uint32_t> twins_;
};

/// Finds which triangles of a part are oriented wrongly: the group with less area, or else the group that makes a
/// closed part face inwards.
class WrongSides {
 public:
  WrongSides(const Mesh& mesh, const FacingParts& parts) : part_sums_(parts.parts.size()) {
    const auto corner = [&](std::uint32_t t, std::size_t k) {
      return to_double(mesh.positions[mesh.triangles[t][k]]);
    };
    for (std::uint32_t t = 0; t < parts.of.size(); ++t) {
      const FacingParts::Part& part = parts.parts[parts.of[t]];
      if (part.is_consistent) continue;
      SideSums& sums = part_sums_[parts.of[t]];
      const Vec3d middle = corner(part.first, 0);
      const Vec3d a = corner(t, 0) - middle, b = corner(t, 1) - middle, c = corner(t, 2) - middle;
      const double size = length(cross(b - a, c - a));
      if (!std::isfinite(size)) continue;
      sums.area[parts.side[t]] += size;
      sums.volume += (parts.side[t] == 0 ? 1 : -1) * dot(a, cross(b, c));
    }
  }
  std::uint8_t of(const FacingParts& parts, std::uint32_t part) const {
    const auto& [area, volume] = part_sums_[part];
    const std::uint8_t smaller_side = area[1] <= area[0] ? 1 : 0;
    const bool is_undecided = area[smaller_side] > kMaxWrongShare * (area[0] + area[1]);
    if (!is_undecided || !parts.parts[part].closed || volume == 0) return smaller_side;
    return volume > 0 ? 1 : 0;
  }

 private:
  struct SideSums {
    std::array<double, 2> area{};
    double volume = 0;  ///< Signed volume, if all triangles were oriented as the first one
  };
  std::vector<SideSums> part_sums_;
};

/// Reverses those corner normals of reversed triangles that pointed to the front of their triangle.
class ReversedNormals {
 public:
  explicit ReversedNormals(Mesh& mesh) : mesh_(mesh) {}

  void reverse(std::size_t t) {
    const Triangle& v = mesh_.triangles[t];
    const auto at = [&](std::size_t k) {
      const Vec3& p = mesh_.positions[v[k]];
      return Vec3d{p.x, p.y, p.z};
    };
    const Vec3d face = cross(at(1) - at(0), at(2) - at(0));
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = mesh_.normal_triangles[t][k];
      const Vec3 own = mesh_.normals[n];
      if (!(dot(face, Vec3d{own.x, own.y, own.z}) > 0)) continue;
      const auto [found, is_new] =
          reversed_normals_.try_emplace(n, static_cast<std::uint32_t>(mesh_.normals.size()));
      if (is_new) mesh_.normals.push_back({-own.x, -own.y, -own.z});
      n = found->second;
      // The sign is negated like the normal, so that the bitangent does not change
      if (!mesh_.tangents.empty()) mesh_.tangents[3 * t + k].sign *= -1;
    }
  }

 private:
  Mesh& mesh_;
  std::unordered_map<std::uint32_t, std::uint32_t> reversed_normals_;
};

}  // namespace

FacingParts::FacingParts(std::span<const Triangle> triangles, std::size_t vertices)
    : of(triangles.size(), kNone), side(triangles.size(), 0) {
  const SideTwins twins(triangles, vertices);
  std::vector<std::uint32_t> walk;
  for (std::uint32_t first = 0; first < triangles.size(); ++first) {
    if (of[first] != kNone) continue;
    const auto number = static_cast<std::uint32_t>(parts.size());
    Part& part = parts.emplace_back(Part{.first = first});
    of[first] = number;
    walk.assign(1, first);
    for (std::size_t i = 0; i < walk.size(); ++i) {
      const std::uint32_t t = walk[i];
      part.is_consistent = part.is_consistent && side[t] == 0;
      for (const std::uint32_t own : twins.sides_in_order(t)) {
        const std::uint32_t twin = twins.of(own);
        if (twin == kNone) {
          part.closed = false;
          continue;
        }
        const std::uint32_t next = twin / 3;
        const std::uint8_t faces =
            side[t] ^ static_cast<std::uint8_t>(twins.have_same_direction(own));
        if (of[next] == kNone) {
          of[next] = number;
          side[next] = faces;
          walk.push_back(next);
        } else if (side[next] != faces) {
          part.one_sided = true;
        }
      }
    }
    part.triangles = static_cast<std::uint32_t>(walk.size());
  }
}

std::vector<std::uint8_t> wrong_sides(const Mesh& mesh, const FacingParts& parts) {
  const WrongSides wrong_sides_of_parts(mesh, parts);
  std::vector<std::uint8_t> wrong_side_of_part(parts.parts.size());
  for (std::uint32_t p = 0; p < wrong_side_of_part.size(); ++p)
    wrong_side_of_part[p] = wrong_sides_of_parts.of(parts, p);
  return wrong_side_of_part;
}

TurnedTriangles turn_triangles(Mesh& mesh, std::span<const std::uint8_t> turned) {
  TurnedTriangles result;
  ReversedNormals normals(mesh);
  for (std::size_t t = 0; t < turned.size(); ++t) {
    if (turned[t] == 0) continue;
    if (result.count++ == 0) result.first = static_cast<std::uint32_t>(t);
    if (!mesh.normal_triangles.empty()) normals.reverse(t);
    for (std::vector<Triangle>* corners :
         {&mesh.triangles, &mesh.uv_triangles, &mesh.normal_triangles}) {
      if (!corners->empty()) std::swap((*corners)[t][1], (*corners)[t][2]);
    }
    if (!mesh.tangents.empty()) std::swap(mesh.tangents[3 * t + 1], mesh.tangents[3 * t + 2]);
  }
  return result;
}

TurnedTriangles agree_windings(Mesh& mesh) {
  validate(mesh);
  // In a mesh with few vertices, triangles share vertices already.
  const bool shares_vertices = mesh.positions.size() < mesh.triangles.size();
  const std::vector<Triangle> triangles = shares_vertices ? mesh.triangles : welded_triangles(mesh);
  if (!has_repeated_side(triangles, mesh.positions.size())) return {};
  const FacingParts parts(triangles, mesh.positions.size());
  const std::vector<std::uint8_t> wrong_side_of_part = wrong_sides(mesh, parts);
  std::vector<std::uint8_t> is_turned(triangles.size(), 0);
  for (std::size_t t = 0; t < is_turned.size(); ++t) {
    const FacingParts::Part& part = parts.parts[parts.of[t]];
    is_turned[t] =
        !part.is_consistent && !part.one_sided && parts.side[t] == wrong_side_of_part[parts.of[t]];
  }
  return turn_triangles(mesh, is_turned);
}

}  // namespace kiln
