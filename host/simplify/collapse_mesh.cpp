#include "simplify/collapse_mesh.h"

#include <algorithm>
#include <numeric>

namespace kiln {

CollapseMesh::CollapseMesh(std::span<const Vec3d> positions, std::span<const Triangle> given,
                           std::span<const std::uint32_t> of_triangles)
    : points(positions.begin(), positions.end()),
      triangles(given.begin(), given.end()),
      labels(of_triangles.begin(), of_triangles.end()),
      alive(given.size(), 1),
      valence(positions.size(), 0),
      faces(given.size()),
      triangle_lists_(positions.size()),
      triangle_pool_(3 * given.size()),
      triangle_counts_(positions.size(), 0) {
  for (const Triangle& t : triangles) {
    for (const std::uint32_t vertex : t) ++valence[vertex];
  }
  std::uint32_t first = 0;
  for (std::size_t v = 0; v < triangle_lists_.size(); ++v) {
    triangle_lists_[v] = {first, 0, valence[v]};
    first += valence[v];
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (const std::uint32_t vertex : triangles[t]) {
      List& list = triangle_lists_[vertex];
      triangle_pool_[list.first + list.size++] = t;
    }
  }
}

void CollapseMesh::set_two_sided(std::vector<std::uint8_t> of_triangles) {
  two_sided = std::move(of_triangles);
  back_face_count = 0;
  for (std::size_t t = 0; t < two_sided.size(); ++t) {
    if (alive[t] != 0) back_face_count += two_sided[t];
  }
}

void CollapseMesh::gather_unordered(std::uint32_t vertex, std::vector<Neighbour>& neighbours) {
  neighbours.clear();
  visits += valence[vertex];
  each_triangle_around(vertex, [&](std::uint32_t t) {
    for (const std::uint32_t other : triangles[t]) {
      if (other == vertex) continue;
      if (triangle_counts_[other] != 0) {
        ++neighbours[triangle_counts_[other] - 1].triangles;
        continue;
      }
      neighbours.push_back({other, 1});
      triangle_counts_[other] = static_cast<std::uint32_t>(neighbours.size());
    }
  });
  for (const Neighbour& n : neighbours) triangle_counts_[n.vertex] = 0;
}

void CollapseMesh::gather(std::uint32_t vertex, std::vector<Neighbour>& neighbours) {
  gather_unordered(vertex, neighbours);
  std::sort(neighbours.begin(), neighbours.end(),
            [](const Neighbour& a, const Neighbour& b) { return a.vertex < b.vertex; });
}

void CollapseMesh::find_common_neighbours(const std::vector<Neighbour>& one,
                                          const std::vector<Neighbour>& other,
                                          std::vector<std::uint32_t>& common) {
  common.clear();
  for (const Neighbour& n : one) triangle_counts_[n.vertex] = 1;
  for (const Neighbour& n : other) {
    if (triangle_counts_[n.vertex] != 0) common.push_back(n.vertex);
  }
  for (const Neighbour& n : one) triangle_counts_[n.vertex] = 0;
}

std::vector<std::uint64_t> CollapseMesh::edges() const {
  // Edges are sorted into buckets by their lower vertex. Each bucket is short, and is sorted by the higher vertex.
  std::vector<std::uint32_t> list_start(points.size() + 1, 0);
  const auto for_each_side = [&](const auto& body) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      if (alive[t] == 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
        body(std::min(a, b), std::max(a, b));
      }
    }
  };
  for_each_side([&](std::uint32_t a, std::uint32_t) { ++list_start[a + 1]; });
  for (std::size_t v = 1; v < list_start.size(); ++v) list_start[v] += list_start[v - 1];
  std::vector<std::uint32_t> higher_vertices(list_start.back()),
      next(list_start.begin(), list_start.end() - 1);
  for_each_side([&](std::uint32_t a, std::uint32_t b) { higher_vertices[next[a]++] = b; });
  std::vector<std::uint64_t> edge_keys;
  edge_keys.reserve(higher_vertices.size() / 2 + 1);
  for (std::size_t a = 0; a + 1 < list_start.size(); ++a) {
    const auto neighbours_begin = higher_vertices.begin() + list_start[a],
               neighbours_end = higher_vertices.begin() + list_start[a + 1];
    std::sort(neighbours_begin, neighbours_end);
    for (auto b = neighbours_begin; b != neighbours_end; ++b) {
      if (b == neighbours_begin || *b != *(b - 1)) edge_keys.push_back(std::uint64_t{a} << 32 | *b);
    }
  }
  return edge_keys;
}

/// Removes dead triangles from a vertex's list once they are the majority: amortized O(1) per removed triangle.
void CollapseMesh::remove_dead(std::uint32_t vertex) {
  List& list = triangle_lists_[vertex];
  if (list.size <= 2 * std::size_t{valence[vertex]}) return;
  visits += list.size;
  const auto begin = triangle_pool_.begin() + list.first;
  const auto end =
      std::remove_if(begin, begin + list.size, [&](std::uint32_t t) { return alive[t] == 0; });
  list.size = static_cast<std::uint32_t>(end - begin);
}

/// Makes room for `more` triangles in a vertex's list. A full list moves to the end of the pool and gets twice its
/// capacity.
void CollapseMesh::make_room(std::uint32_t vertex, std::uint32_t more) {
  List& list = triangle_lists_[vertex];
  if (list.size + more <= list.capacity) return;
  const auto first = static_cast<std::uint32_t>(triangle_pool_.size());
  const std::uint32_t capacity = 2 * (list.size + more);
  triangle_pool_.resize(triangle_pool_.size() + capacity);
  std::copy_n(triangle_pool_.begin() + list.first, list.size, triangle_pool_.begin() + first);
  list.first = first;
  list.capacity = capacity;
}

void CollapseMesh::merge(std::uint32_t kept, std::uint32_t gone) {
  visits += triangle_lists_[gone].size;
  make_room(kept, valence[gone]);
  List& list = triangle_lists_[kept];
  for (const std::uint32_t t : around(gone)) {
    if (alive[t] == 0) continue;
    if (contains(t, kept)) {
      alive[t] = 0;
      --faces;
      if (!two_sided.empty()) back_face_count -= two_sided[t];
      for (const std::uint32_t vertex : triangles[t]) {
        --valence[vertex];
        if (vertex != gone && vertex != kept) remove_dead(vertex);
      }
    } else {
      for (std::uint32_t& vertex : triangles[t]) {
        if (vertex == gone) vertex = kept;
      }
      triangle_pool_[list.first + list.size++] = t;
      ++valence[kept];
    }
  }
  triangle_lists_[gone] = {};
  valence[gone] = 0;
  remove_dead(kept);
}

std::vector<std::uint32_t> CollapseMesh::compact() {
  std::vector<std::uint32_t> new_vertex(points.size(), kNoVertex), of_triangle(triangles.size());
  if (given_triangles_.empty()) {
    given_triangles_.resize(triangles.size());
    std::iota(given_triangles_.begin(), given_triangles_.end(), 0U);
    given_vertices_.resize(points.size());
    std::iota(given_vertices_.begin(), given_vertices_.end(), 0U);
  }
  std::uint32_t vertex_count = 0, count = 0;
  for (std::size_t v = 0; v < new_vertex.size(); ++v) {
    if (valence[v] != 0) new_vertex[v] = vertex_count++;
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (alive[t] == 0) continue;
    of_triangle[t] = count;
    const Triangle& corners = triangles[t];
    triangles[count] = {new_vertex[corners[0]], new_vertex[corners[1]], new_vertex[corners[2]]};
    given_triangles_[count] = given_triangles_[t];
    if (!labels.empty()) labels[count] = labels[t];
    if (!two_sided.empty()) two_sided[count] = two_sided[t];
    ++count;
  }
  std::vector<std::uint32_t> pool;
  pool.reserve(3 * std::size_t{count});
  for (std::size_t v = 0; v < new_vertex.size(); ++v) {
    if (new_vertex[v] == kNoVertex) continue;
    const auto first = static_cast<std::uint32_t>(pool.size());
    for (const std::uint32_t t : around(static_cast<std::uint32_t>(v))) {
      if (alive[t] != 0) pool.push_back(of_triangle[t]);
    }
    triangle_lists_[new_vertex[v]] = {first, valence[v], valence[v]};
  }
  triangle_pool_ = std::move(pool);
  triangle_lists_.resize(vertex_count);
  triangle_counts_.resize(vertex_count);
  triangles.resize(count);
  given_triangles_.resize(count);
  if (!labels.empty()) labels.resize(count);
  if (!two_sided.empty()) two_sided.resize(count);
  alive.assign(count, 1);
  renumber_values(points, new_vertex);
  renumber_values(given_vertices_, new_vertex);
  renumber_values(valence, new_vertex);
  return new_vertex;
}

void CollapseMesh::extract(std::vector<Vec3d>& positions, std::vector<Triangle>& left,
                           std::vector<std::uint32_t>& sources) const {
  std::vector<std::uint32_t> renumbered(points.size(), kNoVertex);
  positions.clear();
  left.clear();
  sources.clear();
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (valence[v] == 0) continue;
    renumbered[v] = static_cast<std::uint32_t>(positions.size());
    positions.push_back(points[v]);
  }
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (alive[t] == 0) continue;
    const Triangle& v = triangles[t];
    left.push_back({renumbered[v[0]], renumbered[v[1]], renumbered[v[2]]});
    sources.push_back(given_triangle(t));
  }
}

}  // namespace kiln
