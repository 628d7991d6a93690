// Fills holes of any number of edges, up to a size.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "base/progress_guard.h"
#include "clean/hole_patch.h"
#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Below this continuation_cosine() a rim is the outline of a sheet, such as a leaf's: 120 degrees.
constexpr double kMinHoleCosine = -0.5;
/// Below this one the sheet is flat: a patch would lie on its back.
constexpr double kMinSheetCosine = -0.999;
/// Corners of a rim whose UVs one triangle of a patch may span, as a share of the rim.
constexpr double kMaxUvSpan = 0.125;
constexpr std::uint32_t kNoOpenSide = std::numeric_limits<std::uint32_t>::max();

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  const auto [low, high] = std::minmax(a, b);
  return std::uint64_t{low} << 32 | high;
}

/// Unit normal of a face; zero if it has no area.
Vec3d unit_face_normal(const Mesh& mesh, const Triangle& face) {
  const Vec3d a = point_of(mesh, face[0]);
  const Vec3d n = cross(point_of(mesh, face[1]) - a, point_of(mesh, face[2]) - a);
  const double size = length(n);
  return size > 0 ? n * (1 / size) : Vec3d{};
}

/// Parts the open sides of a mesh into simple closed rims.
class RimFinder {
 public:
  RimFinder(const Mesh& mesh, std::span<const Triangle> corners)
      : mesh_(mesh),
        corners_(corners),
        sides_(open_sides(corners, mesh.positions.size())),
        at_(
            mesh.positions.size(), sides_.size(), [&](std::size_t i) { return start(sides_[i]); },
            [&](std::size_t i) { return sides_[i]; }),
        is_used_(sides_.size(), false) {}

  /// The sides of each rim in their order, along the faces' orientation.
  std::vector<std::vector<std::uint32_t>> find() {
    std::vector<std::vector<std::uint32_t>> rims;
    for (std::size_t first = 0; first < sides_.size(); ++first) {
      if (!is_used_[first]) follow(first, rims);
    }
    return rims;
  }

  std::uint32_t start(std::uint32_t side) const { return corners_[side / 3][side % 3]; }
  std::uint32_t end(std::uint32_t side) const { return corners_[side / 3][(side + 1) % 3]; }

 private:
  /// Follows open sides until they return to a vertex of their path: that part is a rim, and is cut off the path.
  void follow(std::size_t first, std::vector<std::vector<std::uint32_t>>& rims) {
    std::vector<std::uint32_t> path;
    std::unordered_map<std::uint32_t, std::size_t> place;  // of a vertex on the path
    for (std::size_t next = first; next != kNoOpenSide;) {
      is_used_[next] = true;
      place[start(sides_[next])] = path.size();
      path.push_back(sides_[next]);
      const std::uint32_t reached = end(path.back());
      if (const auto found = place.find(reached); found != place.end()) {
        const std::size_t begin = found->second;
        rims.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(begin), path.end());
        for (std::size_t i = begin; i < path.size(); ++i) place.erase(start(path[i]));
        path.resize(begin);
        if (path.empty()) return;
      }
      next = side_after(path.back());
    }
  }

  /// The unused open side that bounds the same hole as the given one at its end. Where several holes touch at a vertex,
  /// the first one met on a turn through the hole, which lies to the right of its sides.
  std::uint32_t side_after(std::uint32_t side) const {
    std::vector<std::uint32_t> found;
    const std::span<const VertexLists::Item> items = at_.of(end(side));
    for (const VertexLists::Item& item : items) {
      if (!is_used_[item.index]) found.push_back(item.index);
    }
    if (found.empty()) return kNoOpenSide;
    if (found.size() == 1) return found[0];
    Vec3d normal = unit_face_normal(mesh_, corners_[side / 3]);
    for (const std::uint32_t i : found) {
      normal += unit_face_normal(mesh_, corners_[sides_[i] / 3]);
    }
    const Vec3d tip = point_of(mesh_, end(side));
    const Vec3d back = point_of(mesh_, start(side)) - tip;
    const auto turn = [&](std::uint32_t i) {
      const Vec3d ahead = point_of(mesh_, end(sides_[i])) - tip;
      const double angle =
          std::atan2(dot(cross(back, ahead), normal), dot(back, ahead) * length(normal));
      return angle > 0 ? angle : angle + 2 * std::numbers::pi;
    };
    return *std::min_element(found.begin(), found.end(),
                             [&](std::uint32_t a, std::uint32_t b) { return turn(a) < turn(b); });
  }

  const Mesh& mesh_;
  std::span<const Triangle> corners_;
  std::vector<std::uint32_t> sides_;
  VertexLists at_;
  std::vector<bool> is_used_;
};

/// Adds patches to a mesh.
class HoleFiller {
 public:
  HoleFiller(Mesh& mesh, double extent)
      : mesh_(mesh), corners_(welded_triangles(mesh)), extent_(extent) {}

  LargeHoles run() {
    RimFinder finder(mesh_, corners_);
    const std::vector<std::vector<std::uint32_t>> rims = finder.find();
    if (rims.empty()) return std::move(result_);
    find_surroundings(rims);
    for (const std::vector<std::uint32_t>& sides : rims) {
      ProgressGuard::poll();
      fill(sides);
    }
    for (const Added& added : added_) add(added);
    return std::move(result_);
  }

 private:
  /// A corner of a rim: the start of an open side, where its face has attributes.
  struct RimCorner {
    CornerOf corner;
    std::uint32_t vertex;  ///< Welded
  };
  using RimCorners = std::vector<RimCorner>;
  struct Added {
    RimCorners rim;
    HolePatch patch;
  };

  /// Finds the triangles at all rims, and the edges between their vertices.
  void find_surroundings(const std::vector<std::vector<std::uint32_t>>& rims) {
    std::vector<bool> on_rim(mesh_.positions.size(), false);
    for (const auto& rim : rims) {
      for (const std::uint32_t side : rim) on_rim[corners_[side / 3][side % 3]] = true;
    }
    for (std::uint32_t t = 0; t < corners_.size(); ++t) {
      const Triangle& v = corners_[t];
      for (std::size_t k = 0; k < 3; ++k) {
        if (!on_rim[v[k]]) continue;
        triangles_at_[v[k]].push_back(t);
        if (on_rim[v[(k + 1) % 3]]) edges_.insert(edge_key(v[k], v[(k + 1) % 3]));
      }
    }
  }

  HoleRim describe(const RimCorners& corners) const {
    HoleRim rim;
    std::unordered_map<std::uint32_t, std::uint32_t> number;  // by welded vertex
    for (const RimCorner& corner : corners) {
      number.emplace(corner.vertex, static_cast<std::uint32_t>(rim.points.size()));
      rim.points.push_back(point_of(mesh_, corner.vertex));
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
      // The edge to the next corner is the side that starts there, in the other direction.
      const std::uint32_t face = corners[(i + 1) % corners.size()].corner.triangle;
      rim.face_normals.push_back(unit_face_normal(mesh_, corners_[face]));
    }
    std::vector<std::uint32_t> collar;
    for (const RimCorner& corner : corners) {
      const std::vector<std::uint32_t>& at = triangles_at_.at(corner.vertex);
      collar.insert(collar.end(), at.begin(), at.end());
    }
    std::sort(collar.begin(), collar.end());
    collar.erase(std::unique(collar.begin(), collar.end()), collar.end());
    for (const std::uint32_t t : collar) {
      std::array<std::uint32_t, 3> own{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next = static_cast<std::uint32_t>(corners.size() + rim.around.size());
        const auto [entry, is_new] = number.emplace(corners_[t][k], next);
        if (is_new) rim.around.push_back(point_of(mesh_, corners_[t][k]));
        own[k] = entry->second;
      }
      rim.collar.push_back(own);
    }
    return rim;
  }

  static void count(Cleaned& cleaned, const Vec3d& place) {
    if (cleaned.count++ == 0) cleaned.example = to_float(place);
  }

  void fill(const std::vector<std::uint32_t>& sides) {
    RimCorners corners;
    Box<Vec3d> box;
    for (auto side = sides.rbegin(); side != sides.rend(); ++side) {
      corners.push_back({{*side / 3, *side % 3}, corners_[*side / 3][*side % 3]});
      box.add(point_of(mesh_, corners.back().vertex));
    }
    const HoleRim rim = describe(corners);
    const double cosine = continuation_cosine(rim), across = box.diagonal();
    const bool finite = std::all_of(rim.points.begin(), rim.points.end(),
                                    [](const Vec3d& p) { return std::isfinite(p.x + p.y + p.z); });
    if (!finite || !(across <= extent_) ||
        cosine < (std::isinf(extent_) ? kMinSheetCosine : kMinHoleCosine)) {
      count(result_.open, rim.points[0]);
      return;
    }
    Added added{std::move(corners), {}};
    added.patch = make_hole_patch(rim, [&](std::uint32_t a, std::uint32_t b) {
      return !is_along_rim(a, b, added.rim.size()) &&
             edges_.contains(edge_key(added.rim[a].vertex, added.rim[b].vertex));
    });
    for (const auto& t : added.patch.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (std::max(a, b) >= added.rim.size()) continue;
        edges_.insert(edge_key(added.rim[a].vertex, added.rim[b].vertex));
      }
    }
    count(result_.filled, rim.points[0]);
    if (added.patch.is_flat) ++result_.flat;
    result_.largest = std::max(result_.largest, across);
    added_.push_back(std::move(added));
  }

  static bool is_along_rim(std::uint32_t a, std::uint32_t b, std::size_t corners) {
    const auto [low, high] = std::minmax(a, b);
    return high - low == 1 || (low == 0 && high == corners - 1);
  }

  /// Adds a patch with the attributes of its rim.
  void add(const Added& added) {
    const std::size_t corners = added.rim.size();
    const std::vector<std::uint32_t> vertices = add_vertices(added);
    const std::vector<std::uint32_t> normals = add_normals(added);
    const std::vector<std::uint32_t> charts = charts_of(added.rim);
    for (const auto& t : added.patch.triangles) {
      std::array<std::uint32_t, 3> near{};
      for (std::size_t k = 0; k < 3; ++k) near[k] = added.patch.nearest[t[k]];
      std::array<std::uint32_t, 3> ordered = near;
      std::sort(ordered.begin(), ordered.end());
      const CornerOf source =
          added.rim[ordered[1]].corner;  // that of the majority, if there is one
      mesh_.triangles.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
      if (!mesh_.uv_triangles.empty()) {
        const bool spans = is_within_chart(near, charts, corners);
        Triangle uvs;
        for (std::size_t k = 0; k < 3; ++k) {
          const CornerOf& of = spans ? added.rim[near[k]].corner : source;
          uvs[k] = mesh_.uv_triangles[of.triangle][of.k];
        }
        mesh_.uv_triangles.push_back(uvs);
      }
      if (!mesh_.normal_triangles.empty()) {
        mesh_.normal_triangles.push_back({normals[t[0]], normals[t[1]], normals[t[2]]});
      }
      if (!mesh_.tangents.empty()) mesh_.tangents.resize(mesh_.tangents.size() + 3);
      for (std::vector<std::uint32_t>* list : {&mesh_.groups, &mesh_.objects, &mesh_.materials}) {
        if (!list->empty()) list->push_back(std::uint32_t{(*list)[source.triangle]});
      }
      if (!mesh_.polygons.empty()) mesh_.polygons.push_back(mesh_.polygons.back() + 1);
    }
  }

  /// \returns per vertex of the patch, the mesh's vertex
  std::vector<std::uint32_t> add_vertices(const Added& added) {
    std::vector<std::uint32_t> vertices;
    std::vector<Vec3d> colors;
    for (const RimCorner& corner : added.rim) {
      vertices.push_back(mesh_.triangles[corner.corner.triangle][corner.corner.k]);
      if (mesh_.colors.empty()) continue;
      const auto& color = mesh_.colors[vertices.back()];
      colors.emplace_back(color[0], color[1], color[2]);
    }
    if (!colors.empty()) colors = interpolate_over_patch(added.patch, colors);
    for (std::size_t i = added.rim.size(); i < added.patch.points.size(); ++i) {
      vertices.push_back(static_cast<std::uint32_t>(mesh_.positions.size()));
      mesh_.positions.push_back(to_float(added.patch.points[i]));
      if (colors.empty()) continue;
      const auto byte = [](double value) {
        return static_cast<std::uint8_t>(std::clamp(std::floor(value + 0.5), 0.0, 255.0));
      };
      const std::uint8_t alpha = mesh_.colors[vertices[added.patch.nearest[i]]][3];
      mesh_.colors.push_back({byte(colors[i].x), byte(colors[i].y), byte(colors[i].z), alpha});
    }
    return vertices;
  }

  /// \returns per vertex of the patch, the index of its normal; empty where the mesh has none
  std::vector<std::uint32_t> add_normals(const Added& added) {
    if (mesh_.normal_triangles.empty()) return {};
    std::vector<Vec3d> sums(added.patch.points.size());
    Vec3d whole{};
    for (const auto& t : added.patch.triangles) {
      const std::vector<Vec3d>& p = added.patch.points;
      const Vec3d n = cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
      whole += n;
      for (const std::uint32_t v : t) sums[v] += n;
    }
    const auto push = [&](const Vec3d& sum) {
      const double size = length(sum);
      mesh_.normals.push_back(size > 0 ? to_float(sum * (1 / size)) : Vec3{});
      return static_cast<std::uint32_t>(mesh_.normals.size() - 1);
    };
    std::vector<std::uint32_t> normals;
    if (added.patch.is_flat) {
      normals.assign(sums.size(), push(whole));
      return normals;
    }
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const CornerOf* const corner = i < added.rim.size() ? &added.rim[i].corner : nullptr;
      normals.push_back(corner != nullptr
                            ? std::uint32_t{mesh_.normal_triangles[corner->triangle][corner->k]}
                            : push(sums[i]));
    }
    return normals;
  }

  /// Per corner of a rim, the number of seams of UVs between it and the first corner.
  std::vector<std::uint32_t> charts_of(const RimCorners& rim) const {
    std::vector<std::uint32_t> charts(rim.size(), 0);
    if (mesh_.uv_triangles.empty()) return charts;
    const auto uv_at = [&](const CornerOf& corner, std::uint32_t ahead) -> const Vec2& {
      return mesh_.uvs[mesh_.uv_triangles[corner.triangle][(corner.k + ahead) % 3]];
    };
    for (std::size_t i = 1; i < rim.size(); ++i) {
      // The side of corner i ends where that of corner i - 1 starts.
      const Vec2 &end = uv_at(rim[i].corner, 1), &start = uv_at(rim[i - 1].corner, 0);
      charts[i] = charts[i - 1] + (end.x == start.x && end.y == start.y ? 0 : 1);
    }
    return charts;
  }

  static bool is_within_chart(const std::array<std::uint32_t, 3>& near,
                              const std::vector<std::uint32_t>& charts, std::size_t corners) {
    const auto [low, high] = std::minmax({near[0], near[1], near[2]});
    return charts[low] == charts[high] &&
           high - low <= std::max<std::size_t>(1, static_cast<std::size_t>(
                                                      kMaxUvSpan * static_cast<double>(corners)));
  }

  Mesh& mesh_;
  std::vector<Triangle> corners_;
  double extent_;
  LargeHoles result_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>>
      triangles_at_;                         ///< Of vertices of rims
  std::unordered_set<std::uint64_t> edges_;  ///< Edges between vertices of rims
  std::vector<Added> added_;
};

}  // namespace

LargeHoles fill_large_holes(Mesh& mesh, double extent) {
  LargeHoles result = HoleFiller(mesh, extent).run();
  const std::vector<Triangle> corners = welded_triangles(mesh);
  const std::vector<std::uint32_t> open = open_sides(corners, mesh.positions.size());
  result.open_edges.count = open.size();
  if (!open.empty()) {
    result.open_edges.example = mesh.positions[corners[open[0] / 3][open[0] % 3]];
  }
  return result;
}

}  // namespace kiln
