#include "lowpoly/collapse_mesh.h"

#include <algorithm>

namespace kiln {

CollapseMesh::CollapseMesh(std::span<const Vec3d> positions, std::span<const Triangle> given,
                           std::span<const std::uint32_t> of_triangles)
    : points(positions.begin(), positions.end()),
      triangles(given.begin(), given.end()),
      labels(of_triangles.begin(), of_triangles.end()),
      alive(given.size(), 1),
      valence(positions.size(), 0),
      around(positions.size()),
      faces(given.size()) {
  for (const Triangle& t : triangles) {
    for (const std::uint32_t vertex : t) ++valence[vertex];
  }
  for (std::size_t v = 0; v < around.size(); ++v) around[v].reserve(valence[v]);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (const std::uint32_t vertex : triangles[t]) around[vertex].push_back(t);
  }
}

void CollapseMesh::count_sides(std::vector<std::uint8_t> of_triangles) {
  two_sided = std::move(of_triangles);
  backs = 0;
  for (std::size_t t = 0; t < two_sided.size(); ++t) {
    if (alive[t] != 0) backs += two_sided[t];
  }
}

void CollapseMesh::gather(std::uint32_t vertex, std::vector<Neighbour>& neighbours) {
  neighbours.clear();
  visits += valence[vertex];
  each_around(vertex, [&](std::uint32_t t) {
    for (const std::uint32_t other : triangles[t]) {
      if (other != vertex) neighbours.push_back({other, 1});
    }
  });
  std::sort(neighbours.begin(), neighbours.end(),
            [](const Neighbour& a, const Neighbour& b) { return a.vertex < b.vertex; });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    if (kept != 0 && neighbours[kept - 1].vertex == neighbours[i].vertex) {
      ++neighbours[kept - 1].triangles;
    } else {
      neighbours[kept++] = neighbours[i];
    }
  }
  neighbours.resize(kept);
}

std::vector<std::uint64_t> CollapseMesh::edges() const {
  // Half-edges bucketed by their lower vertex; the few in a bucket are then sorted.
  std::vector<std::uint32_t> start(points.size() + 1, 0);
  const auto each = [&](const auto& body) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      if (alive[t] == 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
        body(std::min(a, b), std::max(a, b));
      }
    }
  };
  each([&](std::uint32_t a, std::uint32_t) { ++start[a + 1]; });
  for (std::size_t v = 1; v < start.size(); ++v) start[v] += start[v - 1];
  std::vector<std::uint32_t> higher(start.back()), next(start.begin(), start.end() - 1);
  each([&](std::uint32_t a, std::uint32_t b) { higher[next[a]++] = b; });
  std::vector<std::uint64_t> result;
  result.reserve(higher.size() / 2 + 1);
  for (std::size_t a = 0; a + 1 < start.size(); ++a) {
    const auto first = higher.begin() + start[a], last = higher.begin() + start[a + 1];
    std::sort(first, last);
    for (auto b = first; b != last; ++b) {
      if (b == first || *b != *(b - 1)) result.push_back(std::uint64_t{a} << 32 | *b);
    }
  }
  return result;
}

/// Drops dead triangles from a list once they are the greater part: a step for each that died.
void CollapseMesh::tidy(std::uint32_t vertex) {
  if (around[vertex].size() <= 2 * std::size_t{valence[vertex]}) return;
  visits += around[vertex].size();
  std::erase_if(around[vertex], [&](std::uint32_t t) { return alive[t] == 0; });
}

void CollapseMesh::merge(std::uint32_t kept, std::uint32_t gone) {
  visits += around[gone].size();
  for (const std::uint32_t t : around[gone]) {
    if (alive[t] == 0) continue;
    if (contains(t, kept)) {
      alive[t] = 0;
      --faces;
      if (!two_sided.empty()) backs -= two_sided[t];
      for (const std::uint32_t vertex : triangles[t]) {
        --valence[vertex];
        if (vertex != gone && vertex != kept) tidy(vertex);
      }
    } else {
      for (std::uint32_t& vertex : triangles[t]) {
        if (vertex == gone) vertex = kept;
      }
      around[kept].push_back(t);
      ++valence[kept];
    }
  }
  around[gone] = {};
  valence[gone] = 0;
  tidy(kept);
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
    sources.push_back(t);
  }
}

}  // namespace kiln
