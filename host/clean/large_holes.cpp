// Fills holes with any number of edges, up to a size.
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

/// Smallest continuation_cosine() of a hole: the cosine of 120 degrees. A rim below it is the outline of a sheet, such
/// as a leaf.
constexpr double kMinHoleCosine = -0.5;
/// If holes of every size are filled: smallest continuation_cosine() of a rim that is filled. Below it, the sheet is
/// flat, and a patch would coincide with its back.
constexpr double kMinSheetCosine = -0.999;
/// A patch triangle only interpolates the UVs of its three nearest rim corners if they are at most this share of the
/// rim's number of corners apart, counted along the rim.
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

/// Splits the open sides of a mesh into simple closed rims.
class RimFinder {
 public:
  RimFinder(const Mesh& mesh, std::span<const Triangle> corners)
      : mesh_(mesh),
        corners_(corners),
        sides_(open_sides(corners, mesh.positions.size())),
        sides_at_vertex_(
            mesh.positions.size(), sides_.size(), [&](std::size_t i) { return start(sides_[i]); },
            [&](std::size_t i) { return sides_[i]; }),
        is_used_(sides_.size(), false) {}

  /// Returns the sides of each rim, in the order given by the orientation of the faces around the
  /// hole.
  std::vector<std::vector<std::uint32_t>> find() {
    std::vector<std::vector<std::uint32_t>> rims;
    for (std::size_t first = 0; first < sides_.size(); ++first) {
      if (!is_used_[first]) follow_open_sides(first, rims);
    }
    return rims;
  }

  std::uint32_t start(std::uint32_t side) const { return corners_[side / 3][side % 3]; }
  std::uint32_t end(std::uint32_t side) const { return corners_[side / 3][(side + 1) % 3]; }

 private:
  /// Follows open sides from one to the next. Whenever the path returns to one of its own vertices, the loop since that
  /// vertex becomes a rim and is removed from the path.
  void follow_open_sides(std::size_t first, std::vector<std::vector<std::uint32_t>>& rims) {
    std::vector<std::uint32_t> path;
    std::unordered_map<std::uint32_t, std::size_t>
        index_on_path;  // For each vertex on the path, its index on the path
    for (std::size_t next = first; next != kNoOpenSide;) {
      is_used_[next] = true;
      index_on_path[start(sides_[next])] = path.size();
      path.push_back(sides_[next]);
      const std::uint32_t reached = end(path.back());
      if (const auto found = index_on_path.find(reached); found != index_on_path.end()) {
        const std::size_t rim_begin = found->second;
        rims.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(rim_begin), path.end());
        for (std::size_t i = rim_begin; i < path.size(); ++i) index_on_path.erase(start(path[i]));
        path.resize(rim_begin);
        if (path.empty()) return;
      }
      next = next_open_side(path.back());
    }
  }

  /// The unused open side that continues the rim of the same hole at the end of `side`. Where several holes touch at a
  /// vertex, this is the first open side met by rotating around the vertex through the hole, which lies to the right of
  /// its sides.
  std::uint32_t next_open_side(std::uint32_t side) const {
    std::vector<std::uint32_t> found;
    const std::span<const VertexLists::Item> items = sides_at_vertex_.of(end(side));
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
  VertexLists sides_at_vertex_;
  std::vector<bool> is_used_;
};

/// Adds patches to a mesh.
class HoleFiller {
 public:
  HoleFiller(Mesh& mesh, double extent)
      : mesh_(mesh), corners_(welded_triangles(mesh)), max_diagonal_(extent) {}

  LargeHoles run() {
    RimFinder rim_finder(mesh_, corners_);
    const std::vector<std::vector<std::uint32_t>> rims = rim_finder.find();
    if (rims.empty()) return std::move(holes_);
    find_surroundings(rims);
    for (const std::vector<std::uint32_t>& sides : rims) {
      ProgressGuard::poll();
      fill(sides);
    }
    for (const FilledRim& filled_rim : filled_rims_) add(filled_rim);
    return std::move(holes_);
  }

 private:
  /// A corner of a rim: the vertex at which an open side starts, and the corner of the side's face, from which
  /// attributes are taken.
  struct RimCorner {
    CornerOf corner;
    std::uint32_t vertex;  ///< Welded vertex
  };
  using RimCorners = std::vector<RimCorner>;
  struct FilledRim {
    RimCorners rim;
    HolePatch patch;
  };

  /// Finds the triangles that touch rims, and the edges between their vertices.
  void find_surroundings(const std::vector<std::vector<std::uint32_t>>& rims) {
    std::vector<bool> is_on_rim(mesh_.positions.size(), false);
    for (const auto& rim : rims) {
      for (const std::uint32_t side : rim) is_on_rim[corners_[side / 3][side % 3]] = true;
    }
    for (std::uint32_t t = 0; t < corners_.size(); ++t) {
      const Triangle& v = corners_[t];
      for (std::size_t k = 0; k < 3; ++k) {
        if (!is_on_rim[v[k]]) continue;
        triangles_at_vertex_[v[k]].push_back(t);
        if (is_on_rim[v[(k + 1) % 3]]) rim_edges_.insert(edge_key(v[k], v[(k + 1) % 3]));
      }
    }
  }

  HoleRim describe_rim(const RimCorners& corners) const {
    HoleRim rim;
    std::unordered_map<std::uint32_t, std::uint32_t>
        number;  // For each welded vertex, its index in rim.points
    for (const RimCorner& corner : corners) {
      number.emplace(corner.vertex, static_cast<std::uint32_t>(rim.points.size()));
      rim.points.push_back(point_of(mesh_, corner.vertex));
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
      // The edge from a corner to the next is the open side that starts at the next corner, in the opposite direction.
      const std::uint32_t face = corners[(i + 1) % corners.size()].corner.triangle;
      rim.face_normals.push_back(unit_face_normal(mesh_, corners_[face]));
    }
    std::vector<std::uint32_t> surrounding_triangles;
    for (const RimCorner& corner : corners) {
      const std::vector<std::uint32_t>& at = triangles_at_vertex_.at(corner.vertex);
      surrounding_triangles.insert(surrounding_triangles.end(), at.begin(), at.end());
    }
    std::sort(surrounding_triangles.begin(), surrounding_triangles.end());
    surrounding_triangles.erase(
        std::unique(surrounding_triangles.begin(), surrounding_triangles.end()),
        surrounding_triangles.end());
    for (const std::uint32_t t : surrounding_triangles) {
      std::array<std::uint32_t, 3> own{};
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next =
            static_cast<std::uint32_t>(corners.size() + rim.surrounding_points.size());
        const auto [entry, is_new] = number.emplace(corners_[t][k], next);
        if (is_new) rim.surrounding_points.push_back(point_of(mesh_, corners_[t][k]));
        own[k] = entry->second;
      }
      rim.surrounding_triangles.push_back(own);
    }
    return rim;
  }

  static void count(Cleaned& cleaned, const Vec3d& index_on_path) {
    if (cleaned.count++ == 0) cleaned.example = to_float(index_on_path);
  }

  void fill(const std::vector<std::uint32_t>& sides) {
    RimCorners corners;
    Box<Vec3d> box;
    for (auto side = sides.rbegin(); side != sides.rend(); ++side) {
      corners.push_back({{*side / 3, *side % 3}, corners_[*side / 3][*side % 3]});
      box.add(point_of(mesh_, corners.back().vertex));
    }
    const HoleRim rim = describe_rim(corners);
    const double cosine = continuation_cosine(rim), hole_diagonal = box.diagonal();
    const bool finite = std::all_of(rim.points.begin(), rim.points.end(),
                                    [](const Vec3d& p) { return std::isfinite(p.x + p.y + p.z); });
    if (!finite || !(hole_diagonal <= max_diagonal_) ||
        cosine < (std::isinf(max_diagonal_) ? kMinSheetCosine : kMinHoleCosine)) {
      count(holes_.open, rim.points[0]);
      return;
    }
    FilledRim filled_rim{std::move(corners), {}};
    filled_rim.patch = make_hole_patch(rim, [&](std::uint32_t a, std::uint32_t b) {
      return !is_along_rim(a, b, filled_rim.rim.size()) &&
             rim_edges_.contains(edge_key(filled_rim.rim[a].vertex, filled_rim.rim[b].vertex));
    });
    for (const auto& t : filled_rim.patch.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (std::max(a, b) >= filled_rim.rim.size()) continue;
        rim_edges_.insert(edge_key(filled_rim.rim[a].vertex, filled_rim.rim[b].vertex));
      }
    }
    count(holes_.filled, rim.points[0]);
    if (filled_rim.patch.is_flat) ++holes_.flat;
    holes_.largest = std::max(holes_.largest, hole_diagonal);
    filled_rims_.push_back(std::move(filled_rim));
  }

  static bool is_along_rim(std::uint32_t a, std::uint32_t b, std::size_t corners) {
    const auto [low, high] = std::minmax(a, b);
    return high - low == 1 || (low == 0 && high == corners - 1);
  }

  /// Adds a patch, with the attributes of its rim.
  void add(const FilledRim& filled_rim) {
    const std::size_t corners = filled_rim.rim.size();
    const std::vector<std::uint32_t> mesh_vertices = add_vertices(filled_rim);
    const std::vector<std::uint32_t> mesh_normals = add_normals(filled_rim);
    const std::vector<std::uint32_t> chart_of_corner = charts_of(filled_rim.rim);
    for (const auto& t : filled_rim.patch.triangles) {
      std::array<std::uint32_t, 3> nearest_rim_corners{};
      for (std::size_t k = 0; k < 3; ++k) nearest_rim_corners[k] = filled_rim.patch.nearest[t[k]];
      std::array<std::uint32_t, 3> sorted_corners = nearest_rim_corners;
      std::sort(sorted_corners.begin(), sorted_corners.end());
      // This is the median of the three nearest corners: if two of them are the same corner, it is that one
      const CornerOf attribute_source = filled_rim.rim[sorted_corners[1]].corner;
      mesh_.triangles.push_back({mesh_vertices[t[0]], mesh_vertices[t[1]], mesh_vertices[t[2]]});
      if (!mesh_.uv_triangles.empty()) {
        const bool is_in_one_chart = is_within_chart(nearest_rim_corners, chart_of_corner, corners);
        Triangle uvs;
        for (std::size_t k = 0; k < 3; ++k) {
          const CornerOf& of =
              is_in_one_chart ? filled_rim.rim[nearest_rim_corners[k]].corner : attribute_source;
          uvs[k] = mesh_.uv_triangles[of.triangle][of.k];
        }
        mesh_.uv_triangles.push_back(uvs);
      }
      if (!mesh_.normal_triangles.empty()) {
        mesh_.normal_triangles.push_back(
            {mesh_normals[t[0]], mesh_normals[t[1]], mesh_normals[t[2]]});
      }
      if (!mesh_.tangents.empty()) mesh_.tangents.resize(mesh_.tangents.size() + 3);
      for (std::vector<std::uint32_t>* list : {&mesh_.groups, &mesh_.objects, &mesh_.materials}) {
        if (!list->empty()) list->push_back(std::uint32_t{(*list)[attribute_source.triangle]});
      }
      if (!mesh_.polygons.empty()) mesh_.polygons.push_back(mesh_.polygons.back() + 1);
    }
  }

  /// Adds the vertices of a patch.
  /// \returns for each vertex of the patch, the vertex of the mesh
  std::vector<std::uint32_t> add_vertices(const FilledRim& filled_rim) {
    std::vector<std::uint32_t> mesh_vertices;
    std::vector<Vec3d> vertex_colors;
    for (const RimCorner& corner : filled_rim.rim) {
      mesh_vertices.push_back(mesh_.triangles[corner.corner.triangle][corner.corner.k]);
      if (mesh_.colors.empty()) continue;
      const auto& color = mesh_.colors[mesh_vertices.back()];
      vertex_colors.emplace_back(color[0], color[1], color[2]);
    }
    if (!vertex_colors.empty())
      vertex_colors = interpolate_over_patch(filled_rim.patch, vertex_colors);
    for (std::size_t i = filled_rim.rim.size(); i < filled_rim.patch.points.size(); ++i) {
      mesh_vertices.push_back(static_cast<std::uint32_t>(mesh_.positions.size()));
      mesh_.positions.push_back(to_float(filled_rim.patch.points[i]));
      if (vertex_colors.empty()) continue;
      const auto byte = [](double value) {
        return static_cast<std::uint8_t>(std::clamp(std::floor(value + 0.5), 0.0, 255.0));
      };
      const std::uint8_t alpha = mesh_.colors[mesh_vertices[filled_rim.patch.nearest[i]]][3];
      mesh_.colors.push_back(
          {byte(vertex_colors[i].x), byte(vertex_colors[i].y), byte(vertex_colors[i].z), alpha});
    }
    return mesh_vertices;
  }

  /// Adds the normals of a patch.
  /// \returns for each vertex of the patch, the index of its normal; empty if the mesh has no normals
  std::vector<std::uint32_t> add_normals(const FilledRim& filled_rim) {
    if (mesh_.normal_triangles.empty()) return {};
    std::vector<Vec3d> sums(filled_rim.patch.points.size());
    Vec3d area_vector_sum{};
    for (const auto& t : filled_rim.patch.triangles) {
      const std::vector<Vec3d>& p = filled_rim.patch.points;
      const Vec3d n = cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
      area_vector_sum += n;
      for (const std::uint32_t v : t) sums[v] += n;
    }
    const auto push = [&](const Vec3d& sum) {
      const double size = length(sum);
      mesh_.normals.push_back(size > 0 ? to_float(sum * (1 / size)) : Vec3{});
      return static_cast<std::uint32_t>(mesh_.normals.size() - 1);
    };
    std::vector<std::uint32_t> normals;
    if (filled_rim.patch.is_flat) {
      normals.assign(sums.size(), push(area_vector_sum));
      return normals;
    }
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const CornerOf* const corner =
          i < filled_rim.rim.size() ? &filled_rim.rim[i].corner : nullptr;
      normals.push_back(corner != nullptr
                            ? std::uint32_t{mesh_.normal_triangles[corner->triangle][corner->k]}
                            : push(sums[i]));
    }
    return normals;
  }

  /// For each corner of a rim, the number of UV seams between it and the first corner.
  std::vector<std::uint32_t> charts_of(const RimCorners& rim) const {
    std::vector<std::uint32_t> chart_of_corner(rim.size(), 0);
    if (mesh_.uv_triangles.empty()) return chart_of_corner;
    const auto uv_at = [&](const CornerOf& corner, std::uint32_t ahead) -> const Vec2& {
      return mesh_.uvs[mesh_.uv_triangles[corner.triangle][(corner.k + ahead) % 3]];
    };
    for (std::size_t i = 1; i < rim.size(); ++i) {
      // The side of corner i ends where the side of corner i - 1 starts.
      const Vec2 &end = uv_at(rim[i].corner, 1), &start = uv_at(rim[i - 1].corner, 0);
      chart_of_corner[i] = chart_of_corner[i - 1] + (end.x == start.x && end.y == start.y ? 0 : 1);
    }
    return chart_of_corner;
  }

  static bool is_within_chart(const std::array<std::uint32_t, 3>& near,
                              const std::vector<std::uint32_t>& chart_of_corner,
                              std::size_t corners) {
    const auto [low, high] = std::minmax({near[0], near[1], near[2]});
    return chart_of_corner[low] == chart_of_corner[high] &&
           high - low <= std::max<std::size_t>(1, static_cast<std::size_t>(
                                                      kMaxUvSpan * static_cast<double>(corners)));
  }

  Mesh& mesh_;
  std::vector<Triangle> corners_;
  double max_diagonal_;
  LargeHoles holes_;
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>>
      triangles_at_vertex_;                      ///< Triangles at each vertex of a rim
  std::unordered_set<std::uint64_t> rim_edges_;  ///< Edges between vertices of rims
  std::vector<FilledRim> filled_rims_;
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
