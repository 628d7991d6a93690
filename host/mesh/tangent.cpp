#include "mesh/tangent.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;
constexpr std::uint32_t kNoGroup = kNone;

/// The tangent of one triangle, before triangles are grouped.
struct Face {
  Vec3d tangent{};  ///< Unit dP/du; zero where the UVs do not define it
  bool is_orientation_preserving =
      false;  ///< True if the UVs have the same orientation as the surface
  /// True if the UVs have no orientation; the face then adopts that of the first group that reaches it
  bool has_no_orientation = false;
  /// True if two corners coincide or a value is not finite; the face is then ignored
  bool is_degenerate = false;
  /// For each k, the neighbour across the edge from corner k to corner k + 1
  std::array<std::uint32_t, 3> neighbor{kNone, kNone, kNone};
  std::array<std::uint32_t, 3> group{kNoGroup, kNoGroup, kNoGroup};
};

struct Corners {
  std::span<const Vec3> positions;
  std::span<const Vec3> normals;
  std::span<const Vec2> uvs;
};

using Key = std::array<std::uint32_t, 8>;

Key key_of(const Corners& corners, std::size_t i) {
  // Adding +0 turns -0 into +0, so that equal values have equal bits.
  const auto bits = [](float group_tangent) {
    return std::bit_cast<std::uint32_t>(group_tangent + 0.0F);
  };
  const Vec3& p = corners.positions[i];
  const Vec3& n = corners.normals[i];
  const Vec2& uv = corners.uvs[i];
  return {bits(p.x), bits(p.y), bits(p.z), bits(n.x), bits(n.y), bits(n.z), bits(uv.x), bits(uv.y)};
}

/// For each corner, the first corner that has the same position, normal and UV.
std::vector<std::uint32_t> weld_corners(const Corners& corners) {
  const std::size_t count = corners.positions.size();
  const std::size_t mask = std::bit_ceil(count * 2 + 1) - 1;
  std::vector<std::uint32_t> vertex_of_hash(mask + 1, kNone);
  std::vector<std::uint32_t> hashes(count);
  parallel_for(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::uint64_t hash = 0;
      for (std::uint32_t word : key_of(corners, i)) {
        hash = (hash ^ word) * 0x9E3779B97F4A7C15ULL;
        hash ^= hash >> 32;
      }
      hashes[i] = static_cast<std::uint32_t>(hash);
    }
  });
  std::vector<std::uint32_t> first_equal_corner(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t slot = hashes[i] & mask;
    while (vertex_of_hash[slot] != kNone &&
           (hashes[vertex_of_hash[slot]] != hashes[i] ||
            key_of(corners, vertex_of_hash[slot]) != key_of(corners, i))) {
      slot = (slot + 1) & mask;
    }
    if (vertex_of_hash[slot] == kNone) vertex_of_hash[slot] = static_cast<std::uint32_t>(i);
    first_equal_corner[i] = vertex_of_hash[slot];
  }
  return first_equal_corner;
}

Vec3d unit_or_zero(const Vec3d& v) {
  const double size = length(v);
  return size > 0 && std::isfinite(size) ? v * (1 / size) : Vec3d();
}

/// First-order tangent of each triangle (Mikkelsen 2008, section 2.1), for a position P that is linear in u and v.
std::vector<Face> first_order_tangents(const Corners& corners,
                                       std::span<const std::uint32_t> vertex) {
  std::vector<Face> faces(vertex.size() / 3);
  parallel_for(faces.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      Face& face = faces[f];
      const Vec3* p = &corners.positions[3 * f];
      const Vec2* uv = &corners.uvs[3 * f];
      bool finite = true;
      for (std::size_t k = 0; k < 3; ++k) {
        finite = finite && is_finite(p[k]) && is_finite(corners.normals[3 * f + k]) &&
                 std::isfinite(uv[k].x) && std::isfinite(uv[k].y);
      }
      if (!finite || p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) {
        face.is_degenerate = true;
        continue;
      }
      const Vec3d edge1 = to_double(p[1]) - to_double(p[0]);
      const Vec3d edge2 = to_double(p[2]) - to_double(p[0]);
      const double u1 = double{uv[1].x} - uv[0].x;
      const double v1 = double{uv[1].y} - uv[0].y;
      const double u2 = double{uv[2].x} - uv[0].x;
      const double v2 = double{uv[2].y} - uv[0].y;
      // Each product is exact in double precision. So the sign is correct, except for tiny differences of products,
      // which have no significant direction.
      const double area = u1 * v2 - v1 * u2;
      const Vec3d along_u = edge1 * v2 - edge2 * v1;
      const Vec3d along_v = edge2 * u1 - edge1 * u2;
      face.has_no_orientation =
          !(std::abs(area) > 0) || !(length(along_u) > 0) || !(length(along_v) > 0);
      face.is_orientation_preserving = area > 0;
      if (!face.has_no_orientation) face.tangent = unit_or_zero(along_u) * (area > 0 ? 1.0 : -1.0);
    }
  });
  return faces;
}

/// Pairs triangles that traverse the same welded edge in opposite directions.
void find_neighbors(std::span<const std::uint32_t> vertex, std::vector<Face>& faces) {
  // Edges in buckets by their lower vertex (counting sort), sorted within each bucket.
  struct HalfEdge {
    std::uint32_t higher_vertex;  // Higher vertex of the edge
    std::uint32_t corner;         // Corner at which the side starts: 3 * face + k
  };
  std::vector<std::uint32_t> bucket_start(vertex.size() + 1, 0);
  const auto for_each_edge = [&](const auto& body) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
      if (faces[f].is_degenerate) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = vertex[3 * f + k];
        const std::uint32_t b = vertex[3 * f + (k + 1) % 3];
        body(std::min(a, b), HalfEdge{std::max(a, b), static_cast<std::uint32_t>(3 * f + k)});
      }
    }
  };
  for_each_edge([&](std::uint32_t low, const HalfEdge&) { ++bucket_start[low + 1]; });
  for (std::size_t i = 1; i < bucket_start.size(); ++i) bucket_start[i] += bucket_start[i - 1];
  std::vector<HalfEdge> edges(bucket_start.back());
  std::vector<std::uint32_t> next_slot(bucket_start.begin(), bucket_start.end() - 1);
  for_each_edge([&](std::uint32_t low, const HalfEdge& edge) { edges[next_slot[low]++] = edge; });

  for (std::size_t low = 0; low + 1 < bucket_start.size(); ++low) {
    const auto begin = edges.begin() + bucket_start[low];
    const auto end = edges.begin() + bucket_start[low + 1];
    std::sort(begin, end, [](const HalfEdge& a, const HalfEdge& b) {
      return a.higher_vertex != b.higher_vertex ? a.higher_vertex < b.higher_vertex
                                                : a.corner < b.corner;
    });
    for (auto i = begin; i != end; ++i) {
      Face& face = faces[i->corner / 3];
      if (face.neighbor[i->corner % 3] != kNone) continue;
      // Finds the first later triangle of opposite direction that has no partner yet.
      for (auto j = i + 1; j != end && j->higher_vertex == i->higher_vertex; ++j) {
        Face& candidate = faces[j->corner / 3];
        if (candidate.neighbor[j->corner % 3] != kNone) continue;
        if (vertex[i->corner] == vertex[j->corner]) continue;
        face.neighbor[i->corner % 3] = j->corner / 3;
        candidate.neighbor[j->corner % 3] = i->corner / 3;
        break;
      }
    }
  }
}

/// Groups of triangles around a vertex that share a tangent. They are connected over edges, and their UVs have the same
/// orientation.
struct TangentGroups {
  std::vector<std::uint32_t> corners;   ///< Corners (3 * face + k), group by group
  std::vector<std::uint32_t> first{0};  ///< Start of each group in `corners`; one extra entry
};

TangentGroups grow_groups(std::span<const std::uint32_t> vertex, std::vector<Face>& faces) {
  TangentGroups groups;
  groups.corners.reserve(vertex.size());
  std::vector<std::uint32_t> stack;
  for (std::size_t seed = 0; seed < vertex.size(); ++seed) {
    const Face& seed_face = faces[seed / 3];
    if (seed_face.is_degenerate || seed_face.has_no_orientation ||
        seed_face.group[seed % 3] != kNoGroup)
      continue;
    const auto group = static_cast<std::uint32_t>(groups.first.size() - 1);
    const bool is_orientation_preserving = seed_face.is_orientation_preserving;
    const std::uint32_t center = vertex[seed];
    stack.assign(1, static_cast<std::uint32_t>(seed / 3));
    while (!stack.empty()) {
      const std::size_t f = stack.back();
      stack.pop_back();
      Face& face = faces[f];
      std::size_t k = 0;
      while (k < 3 && vertex[3 * f + k] != center) ++k;
      if (k == 3 || face.group[k] != kNoGroup) continue;
      if (face.has_no_orientation && face.group == std::array{kNoGroup, kNoGroup, kNoGroup}) {
        face.is_orientation_preserving = is_orientation_preserving;
      }
      if (face.is_orientation_preserving != is_orientation_preserving) continue;
      face.group[k] = group;
      groups.corners.push_back(static_cast<std::uint32_t>(3 * f + k));
      // The edge before the corner is pushed first, so the edge after the corner is followed first.
      if (face.neighbor[(k + 2) % 3] != kNone) stack.push_back(face.neighbor[(k + 2) % 3]);
      if (face.neighbor[k] != kNone) stack.push_back(face.neighbor[k]);
    }
    groups.first.push_back(static_cast<std::uint32_t>(groups.corners.size()));
  }
  return groups;
}

Vec3d project_on_plane(const Vec3d& v, const Vec3d& normal) {
  return unit_or_zero(v - normal * dot(normal, v));
}

/// A corner's contribution to the tangent of its group: the triangle's tangent, projected onto the normal plane and
/// weighted by the projected angle.
Vec3d tangent_contribution(const Corners& corners, const Face& face, std::size_t corner) {
  const std::size_t f = corner / 3;
  const std::size_t k = corner % 3;
  const Vec3d normal = to_double(corners.normals[corner]);
  const Vec3d corner_position = to_double(corners.positions[corner]);
  const Vec3d to_next =
      project_on_plane(to_double(corners.positions[3 * f + (k + 1) % 3]) - corner_position, normal);
  const Vec3d to_previous =
      project_on_plane(to_double(corners.positions[3 * f + (k + 2) % 3]) - corner_position, normal);
  const double angle = std::acos(std::clamp(dot(to_next, to_previous), -1.0, 1.0));
  return project_on_plane(face.tangent, normal) * angle;
}

/// A unit vector perpendicular to a normal.
Vec3d perpendicular(const Vec3& normal) {
  const Vec3d n = is_finite(normal) ? to_double(normal) : Vec3d(0, 0, 1);
  const Vec3d axis = std::abs(n.x) < 0.9 ? Vec3d(1, 0, 0) : Vec3d(0, 1, 0);
  const Vec3d result = project_on_plane(axis, unit_or_zero(n));
  return length(result) > 0 ? result : Vec3d(1, 0, 0);
}

}  // namespace

std::vector<CornerTangent> mikk_tangents(std::span<const Vec3> positions,
                                         std::span<const Vec3> normals, std::span<const Vec2> uvs) {
  const Corners corners{positions, normals, uvs};
  const std::vector<std::uint32_t> vertex = weld_corners(corners);
  std::vector<Face> faces = first_order_tangents(corners, vertex);
  find_neighbors(vertex, faces);
  const TangentGroups groups = grow_groups(vertex, faces);

  std::vector<CornerTangent> result(positions.size());
  std::vector<std::uint8_t> is_tangent_known(positions.size(), 0);
  parallel_for(groups.first.size() - 1, 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t g = begin; g < end; ++g) {
      Vec3d sum{};
      for (std::size_t m = groups.first[g]; m < groups.first[g + 1]; ++m) {
        const std::uint32_t corner = groups.corners[m];
        const Face& face = faces[corner / 3];
        if (!face.has_no_orientation) sum += tangent_contribution(corners, face, corner);
      }
      const std::uint32_t seed = groups.corners[groups.first[g]];
      Vec3d tangent = unit_or_zero(sum);
      if (length(tangent) == 0) tangent = perpendicular(normals[seed]);
      const CornerTangent group_tangent{to_float(tangent),
                                        faces[seed / 3].is_orientation_preserving ? 1.0F : -1.0F};
      for (std::size_t m = groups.first[g]; m < groups.first[g + 1]; ++m) {
        result[groups.corners[m]] = group_tangent;
        is_tangent_known[groups.corners[m]] = 1;
      }
    }
  });

  // The remaining triangles are degenerate, or have UVs without an orientation and no group reached them. Their corners
  // copy the tangent of the first valid corner of the same welded vertex, or else of one at the same position.
  std::vector<std::uint32_t> known_corner_of_vertex(positions.size(), kNone);
  bool all_tangents_known = true;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (is_tangent_known[i] == 0) {
      all_tangents_known = false;
    } else if (known_corner_of_vertex[vertex[i]] == kNone) {
      known_corner_of_vertex[vertex[i]] = static_cast<std::uint32_t>(i);
    }
  }
  if (all_tangents_known) return result;
  const std::vector<Vec3> zero_normals(positions.size());
  const std::vector<Vec2> zero_uvs(positions.size());
  const std::vector<std::uint32_t> vertex_at_position =
      weld_corners({positions, zero_normals, zero_uvs});
  std::vector<std::uint32_t> known_corner_at_position(positions.size(), kNone);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (is_tangent_known[i] != 0 && known_corner_at_position[vertex_at_position[i]] == kNone) {
      known_corner_at_position[vertex_at_position[i]] = static_cast<std::uint32_t>(i);
    }
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (is_tangent_known[i] != 0) continue;
    std::uint32_t from = known_corner_of_vertex[vertex[i]];
    if (from == kNone) from = known_corner_at_position[vertex_at_position[i]];
    Vec3d tangent{};
    if (from != kNone) {
      result[i].sign = result[from].sign;
      tangent = to_double(result[from].tangent);
      if (is_finite(normals[i])) tangent = project_on_plane(tangent, to_double(normals[i]));
    }
    result[i].tangent = to_float(length(tangent) > 0 ? tangent : perpendicular(normals[i]));
  }
  return result;
}

}  // namespace kiln
