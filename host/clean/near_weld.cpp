// Welds vertices of open edges whose positions differ by rounding.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/disjoint_sets.h"
#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Largest motion of a vertex, as a share of its shortest edge.
constexpr double kMaxMoveShare = 0.25;
/// Maximum number of vertices that are tested per cell. Where vertices are denser, edges are too short for welding.
constexpr int kMaxPerCell = 64;

/// Hash grid of vertices. Each cell is a linked list.
class VertexCells {
 public:
  VertexCells(double size, std::size_t vertices, std::size_t entries)
      : cell_size_(size),
        mask_(std::bit_ceil(2 * entries + 2) - 1),
        first_of_cell_(mask_ + 1, kEnd),
        next_(vertices) {}

  void add(std::uint32_t v, const Vec3d& p) {
    std::uint32_t& head = first_of_cell_[slot(cell(p.x), cell(p.y), cell(p.z))];
    next_[v] = head;
    head = v;
  }
  /// Calls body(vertex) for the vertices in all cells within `search_radius`. Hash collisions may add vertices of other
  /// cells.
  template <typename Body>
  void for_each_near(const Vec3d& p, double search_radius, const Body& body) const {
    for (std::int64_t x = cell(p.x - search_radius); x <= cell(p.x + search_radius); ++x) {
      for (std::int64_t y = cell(p.y - search_radius); y <= cell(p.y + search_radius); ++y) {
        for (std::int64_t z = cell(p.z - search_radius); z <= cell(p.z + search_radius); ++z) {
          int count = 0;
          for (std::uint32_t v = first_of_cell_[slot(x, y, z)]; v != kEnd && count < kMaxPerCell;
               v = next_[v]) {
            body(v);
            ++count;
          }
        }
      }
    }
  }

 private:
  static constexpr std::uint32_t kEnd = std::numeric_limits<std::uint32_t>::max();
  std::int64_t cell(double x) const {
    return static_cast<std::int64_t>(std::floor(x / cell_size_));
  }
  std::size_t slot(std::int64_t x, std::int64_t y, std::int64_t z) const {
    std::uint64_t hash = static_cast<std::uint64_t>(x) * 0x9E3779B97F4A7C15u;
    hash = (hash ^ (hash >> 29) ^ static_cast<std::uint64_t>(y)) * 0xBF58476D1CE4E5B9u;
    hash = (hash ^ (hash >> 31) ^ static_cast<std::uint64_t>(z)) * 0x94D049BB133111EBu;
    return static_cast<std::size_t>(hash >> 20) & mask_;
  }

  double cell_size_;
  std::size_t mask_;
  std::vector<std::uint32_t> first_of_cell_, next_;
};

}  // namespace

Cleaned weld_near(Mesh& mesh, double distance) {
  Cleaned welded;
  const std::vector<std::uint32_t> first = weld_vertices(mesh.positions);
  std::vector<Triangle> corners = mesh.triangles;
  for (Triangle& t : corners) {
    for (std::uint32_t& v : t) v = first[v];
  }
  const std::size_t vertices = mesh.positions.size();
  std::vector<std::uint8_t> is_open_vertex(vertices, 0);
  for (const std::uint32_t side : open_sides(corners, vertices)) {
    const Triangle& t = corners[side / 3];
    is_open_vertex[t[side % 3]] = is_open_vertex[t[(side + 1) % 3]] = 1;
  }
  std::vector<double> search_radius(vertices, std::numeric_limits<double>::infinity());
  for (const Triangle& t : corners) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if ((is_open_vertex[a] | is_open_vertex[b]) == 0 || a == b) continue;
      const double edge = kMaxMoveShare * length(point_of(mesh, a) - point_of(mesh, b));
      search_radius[a] = std::min(search_radius[a], edge);
      search_radius[b] = std::min(search_radius[b], edge);
    }
  }
  const auto entries =
      static_cast<std::size_t>(std::count(is_open_vertex.begin(), is_open_vertex.end(), 1));
  if (entries == 0 || !(distance > 0)) return welded;
  VertexCells vertex_cells(4 * distance, vertices, entries);
  DisjointSets sets(vertices);
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (is_open_vertex[v] == 0 || !is_finite(mesh.positions[v])) continue;
    const Vec3d p = point_of(mesh, v);
    const double own = std::min(distance, search_radius[v]);
    vertex_cells.for_each_near(p, own, [&](std::uint32_t u) {
      if (length(point_of(mesh, u) - p) <= std::min(own, search_radius[u])) sets.join(u, v);
    });
    vertex_cells.add(v, p);
  }
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::uint32_t to = sets.find(first[v]);
    if (to == first[v]) continue;
    if (welded.count++ == 0) welded.example = mesh.positions[v];
    mesh.positions[v] = mesh.positions[to];
  }
  return welded;
}

}  // namespace kiln
