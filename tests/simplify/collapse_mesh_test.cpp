// Meshes whose vertices are merged, beside a plain list of triangles.
#include "simplify/collapse_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "support/shapes.h"

namespace kiln {
namespace {

/// The triangles that are left, by their number in the whole mesh, with the vertices that they have now.
using PlainMesh = std::map<std::uint32_t, Triangle>;

bool has(const Triangle& t, std::uint32_t vertex) {
  return std::find(t.begin(), t.end(), vertex) != t.end();
}

void merge_plainly(PlainMesh& mesh, std::uint32_t kept, std::uint32_t gone) {
  std::erase_if(mesh, [&](const auto& t) { return has(t.second, kept) && has(t.second, gone); });
  for (auto& [index, t] : mesh) std::replace(t.begin(), t.end(), gone, kept);
}

std::map<std::uint32_t, std::uint32_t> neighbours_of(const PlainMesh& mesh, std::uint32_t vertex) {
  std::map<std::uint32_t, std::uint32_t> result;
  for (const auto& [index, t] : mesh) {
    if (!has(t, vertex)) continue;
    for (const std::uint32_t other : t) {
      if (other != vertex) ++result[other];
    }
  }
  return result;
}

/// Labels and two-sided triangles by the number of the triangle.
std::uint32_t label_of(std::uint32_t triangle) { return 7 + triangle % 5; }
std::uint8_t sides_of(std::uint32_t triangle) { return triangle % 3 == 0 ? 1 : 0; }

/// Compares everything with a plain list whose triangles name vertices of the given mesh.
void expect_same(CollapseMesh& mesh, const PlainMesh& plain, std::size_t vertices) {
  ASSERT_EQ(mesh.faces, plain.size());
  std::size_t with_backs = 0;
  std::set<std::uint64_t> edges;
  for (const auto& [index, t] : plain) {
    with_backs += 1 + sides_of(index);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [a, b] = std::minmax({t[k], t[(k + 1) % 3]});
      edges.insert(std::uint64_t{a} << 32 | b);
    }
  }
  ASSERT_EQ(mesh.face_count_with_back_faces(), with_backs);
  std::set<std::uint64_t> own_edges;
  for (const std::uint64_t edge : mesh.edges()) {
    own_edges.insert(std::uint64_t{mesh.given_vertex(static_cast<std::uint32_t>(edge >> 32))}
                         << 32 |
                     mesh.given_vertex(static_cast<std::uint32_t>(edge)));
  }
  ASSERT_EQ(own_edges, edges);
  PlainMesh own;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (mesh.alive[t] == 0) continue;
    Triangle corners = mesh.triangles[t];
    for (std::uint32_t& v : corners) v = mesh.given_vertex(v);
    own[mesh.given_triangle(t)] = corners;
    ASSERT_EQ(mesh.labels[t], label_of(mesh.given_triangle(t)));
    ASSERT_EQ(mesh.two_sided[t], sides_of(mesh.given_triangle(t)));
  }
  ASSERT_EQ(own, plain);
  std::vector<CollapseMesh::Neighbour> list, last;
  std::vector<std::uint32_t> common;
  std::set<std::uint32_t> used;
  std::map<std::uint32_t, std::uint32_t> neighbours_of_last;
  for (std::uint32_t v = 0; v < mesh.points.size(); ++v) {
    const std::map<std::uint32_t, std::uint32_t> neighbours =
        neighbours_of(plain, mesh.given_vertex(v));
    std::uint32_t corners = 0;
    for (const auto& [other, triangles] : neighbours) corners += triangles;
    ASSERT_EQ(mesh.valence[v], corners / 2) << v;
    if (corners != 0) used.insert(mesh.given_vertex(v));
    // Dead triangles in a list are the minority.
    ASSERT_LE(mesh.around(v).size(), 2 * std::size_t{mesh.valence[v]}) << v;
    mesh.gather(v, list);
    std::map<std::uint32_t, std::uint32_t> own_neighbours;
    for (const auto& n : list) own_neighbours[mesh.given_vertex(n.vertex)] = n.triangles;
    ASSERT_EQ(own_neighbours, neighbours) << v;
    mesh.find_common_neighbours(list, last, common);
    std::set<std::uint32_t> own_common, wanted;
    for (const std::uint32_t c : common) own_common.insert(mesh.given_vertex(c));
    for (const auto& [other, triangles] : neighbours) {
      if (neighbours_of_last.count(other) != 0) wanted.insert(other);
    }
    ASSERT_EQ(own_common, wanted) << v;
    last = list;
    neighbours_of_last = neighbours;
  }
  std::vector<Vec3d> points;
  std::vector<Triangle> left;
  std::vector<std::uint32_t> sources;
  mesh.extract(points, left, sources);
  ASSERT_EQ(points.size(), used.size());
  ASSERT_EQ(left.size(), plain.size());
  ASSERT_EQ(sources.size(), plain.size());
  const std::vector<std::uint32_t> order(used.begin(), used.end());
  for (std::size_t v = 0; v < points.size(); ++v) {
    ASSERT_EQ(points[v].x, static_cast<double>(order[v])) << "each point holds its number";
  }
  for (std::size_t i = 0; i < left.size(); ++i) {
    const Triangle& t = plain.at(sources[i]);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(order[left[i][k]], t[k]);
  }
  ASSERT_LE(used.size(), vertices);
}

TEST(CollapseMesh, IsWhatAPlainListOfTrianglesIs) {
  for (const Mesh& shape : {test::torus(12, 8), test::plane(9, 7), test::icosphere(1)}) {
    SCOPED_TRACE(shape.name);
    std::vector<Vec3d> points;
    for (std::size_t v = 0; v < shape.positions.size(); ++v)
      points.push_back({static_cast<double>(v), 0, 0});
    PlainMesh plain;
    std::vector<std::uint32_t> labels;
    std::vector<std::uint8_t> two_sided;
    for (std::uint32_t t = 0; t < shape.triangles.size(); ++t) {
      plain[t] = shape.triangles[t];
      labels.push_back(label_of(t));
      two_sided.push_back(sides_of(t));
    }
    CollapseMesh mesh(points, shape.triangles, labels);
    mesh.set_two_sided(two_sided);
    std::mt19937 random(5);
    for (int step = 0; mesh.faces > 4; ++step) {
      if (step % 7 == 0) {
        expect_same(mesh, plain, points.size());
        if (testing::Test::HasFatalFailure()) return;
      }
      if (step % 20 == 19) {
        // Values of vertices keep to their vertices.
        std::vector<std::uint32_t> values;
        for (std::uint32_t v = 0; v < mesh.points.size(); ++v)
          values.push_back(mesh.given_vertex(v));
        renumber_values(values, mesh.compact());
        ASSERT_EQ(values.size(), mesh.points.size());
        for (std::uint32_t v = 0; v < values.size(); ++v) {
          ASSERT_EQ(values[v], mesh.given_vertex(v));
          ASSERT_EQ(mesh.points[v].x, static_cast<double>(values[v]));
        }
      }
      const std::vector<std::uint64_t> edges = mesh.edges();
      const std::uint64_t edge = edges[random() % edges.size()];
      const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
      const bool is_first_kept = random() % 2 == 0;
      const std::uint32_t kept = is_first_kept ? a : b, gone = is_first_kept ? b : a;
      merge_plainly(plain, mesh.given_vertex(kept), mesh.given_vertex(gone));
      mesh.merge(kept, gone);
    }
    expect_same(mesh, plain, points.size());
  }
}

}  // namespace
}  // namespace kiln
