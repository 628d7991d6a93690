// Fills holes of few edges in a surface that continues across them.
#include <algorithm>
#include <limits>

#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxRimEdges = 12;
/// Smallest cosine between the hole's plane and each face around it. Ends of tubes and rims of sheets are below it, and
/// do not count as holes.
constexpr double kMinContinuationCosine = 0.5;
/// Largest area of all holes together, as a share of the mesh's area. A sieve has a larger share, and its holes are
/// intended.
constexpr double kMaxHoleShare = 0.15;

Vec3d normal_of(const Vec3d& a, const Vec3d& b, const Vec3d& c) { return cross(b - a, c - a); }

/// A corner of a rim: the corner of the triangle at which an open side starts.
struct RimCorner {
  CornerOf corner;
  Vec3d point{};
};

/// The corners of a hole's rim, in the orientation of the triangles that fill it.
using Rim = std::vector<RimCorner>;
using Fill = std::vector<std::array<CornerOf, 3>>;

/// Fills a rim by ear clipping, the ear with the shortest new edge first.
/// \returns false if no ear is left
bool cut_ears(Rim rim, const Vec3d& normal, Fill& fill) {
  while (rim.size() > 3) {
    std::size_t best = rim.size();
    double shortest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < rim.size(); ++i) {
      const Vec3d &a = rim[(i + rim.size() - 1) % rim.size()].point, &b = rim[i].point,
                  &c = rim[(i + 1) % rim.size()].point;
      const double size = length(c - a);
      if (size < shortest && dot(normal_of(a, b, c), normal) > 0) {
        shortest = size;
        best = i;
      }
    }
    if (best == rim.size()) return false;
    fill.push_back({rim[(best + rim.size() - 1) % rim.size()].corner, rim[best].corner,
                    rim[(best + 1) % rim.size()].corner});
    rim.erase(rim.begin() + static_cast<std::ptrdiff_t>(best));
  }
  if (!(dot(normal_of(rim[0].point, rim[1].point, rim[2].point), normal) > 0)) return false;
  fill.push_back({rim[0].corner, rim[1].corner, rim[2].corner});
  return true;
}

/// The open sides of a mesh, by the vertex at which they start.
class OpenSides {
 public:
  OpenSides(const Mesh& mesh, std::span<const Triangle> corners)
      : corners_(corners),
        sides_(open_sides(corners, mesh.positions.size())),
        sides_at_vertex_(
            mesh.positions.size(), sides_.size(), [&](std::size_t i) { return start(sides_[i]); },
            [&](std::size_t i) { return sides_[i]; }) {}

  std::uint32_t start(std::uint32_t side) const { return corners_[side / 3][side % 3]; }
  std::uint32_t end(std::uint32_t side) const { return corners_[side / 3][(side + 1) % 3]; }
  const std::vector<std::uint32_t>& all() const { return sides_; }

  /// The shortest rim (in number of edges) that contains the open side `first`; empty if it has too many edges. Rims
  /// may touch at vertices.
  std::vector<std::uint32_t> rim(std::uint32_t first) const {
    struct Step {
      std::uint32_t side;
      std::size_t before, length;
    };
    std::vector<Step> steps{{first, 0, 1}};
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const Step step = steps[i];
      if (end(step.side) == start(first)) {
        std::vector<std::uint32_t> rim(step.length);
        for (std::size_t k = step.length, at = i; k-- > 0; at = steps[at].before)
          rim[k] = steps[at].side;
        return rim;
      }
      if (step.length == kMaxRimEdges) continue;
      for (const VertexLists::Item& item : sides_at_vertex_.of(end(step.side))) {
        steps.push_back({sides_[item.index], i, step.length + 1});
        // Many sides may start at one vertex, so the limit is checked at each.
        if (steps.size() == kMaxRimSteps) return {};
      }
    }
    return {};
  }

 private:
  static constexpr std::size_t kMaxRimSteps = 64;
  std::span<const Triangle> corners_;
  std::vector<std::uint32_t> sides_;
  VertexLists sides_at_vertex_;
};

}  // namespace

Cleaned fill_small_holes(Mesh& mesh, double perimeter) {
  const std::vector<Triangle> corners = welded_triangles(mesh);
  const OpenSides open(mesh, corners);
  const auto face = [&](std::uint32_t t) {
    const Triangle& v = corners[t];
    return normal_of(point_of(mesh, v[0]), point_of(mesh, v[1]), point_of(mesh, v[2]));
  };
  Cleaned filled_holes;
  Fill fill_triangles;
  double area = 0;
  // 1 for each open side whose rim was found already
  std::vector<std::uint8_t> is_known_side(3 * corners.size(), 0);
  for (const std::uint32_t first : open.all()) {
    if (is_known_side[first] != 0) continue;
    const std::vector<std::uint32_t> sides = open.rim(first);
    if (sides.size() < 3) continue;
    double perimeter_sum = 0;
    Rim rim;
    for (auto side = sides.rbegin(); side != sides.rend(); ++side) {
      const Vec3d from = point_of(mesh, open.start(*side));
      perimeter_sum += length(point_of(mesh, open.end(*side)) - from);
      rim.push_back({{*side / 3, *side % 3}, from});
    }
    const bool is_side_taken = std::any_of(
        sides.begin(), sides.end(), [&](std::uint32_t side) { return is_known_side[side] != 0; });
    if (is_side_taken || perimeter_sum > perimeter) continue;
    for (const std::uint32_t side : sides) is_known_side[side] = 1;
    Vec3d rim_normal{};
    for (std::size_t i = 2; i < rim.size(); ++i) {
      rim_normal += normal_of(rim[0].point, rim[i - 1].point, rim[i].point);
    }
    const double size = length(rim_normal);
    const bool does_surface_continue =
        std::all_of(sides.begin(), sides.end(), [&](std::uint32_t side) {
          const Vec3d beside = face(side / 3);
          return dot(beside, rim_normal) > kMinContinuationCosine * length(beside) * size;
        });
    Fill fill;
    if (!does_surface_continue || !cut_ears(rim, rim_normal, fill)) continue;
    if (filled_holes.count++ == 0) filled_holes.example = to_float(rim[0].point);
    fill_triangles.insert(fill_triangles.end(), fill.begin(), fill.end());
    area += size;
  }
  double mesh_area = 0;
  for (std::uint32_t t = 0; t < corners.size() && !fill_triangles.empty(); ++t)
    mesh_area += length(face(t));
  if (area > kMaxHoleShare * mesh_area) return {};
  for (const auto& triangle : fill_triangles) add_triangle(mesh, triangle);
  return filled_holes;
}

}  // namespace kiln
