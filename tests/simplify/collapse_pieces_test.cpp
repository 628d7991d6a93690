// Edge collapse piece by piece: nothing is torn where pieces meet.
#include "simplify/collapse_pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "kiln/limits.h"
#include "mesh/vertex_lists.h"
#include "simplify/collapse_queue.h"
#include "simplify/mesh_pieces.h"

namespace kiln {
namespace {

/// A ring with flat sides: a torus whose section is a rounded square.
Work ring(std::uint32_t around, std::uint32_t across) {
  Work work;
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t k = 0; k < across; ++k) {
      const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * k / across;
      const double x = 0.35 + std::clamp(0.14 * std::cos(v), -0.1, 0.1);
      const double z = std::clamp(0.14 * std::sin(v), -0.1, 0.1);
      work.points.push_back({x * std::cos(u), x * std::sin(u), z});
      const auto at = [&](std::uint32_t a, std::uint32_t b) {
        return (a % around) * across + b % across;
      };
      work.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      work.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return work;
}

Work collapsed(const Work& dense, std::span<const Ball> untouched = {}) {
  return collapse_in_pieces(dense, to_floats(dense.points), 5000, untouched, {});
}

double volume(const Work& work) {
  double sum = 0;
  for (const Triangle& t : work.triangles) {
    sum += dot(work.points[t[0]], cross(work.points[t[1]], work.points[t[2]])) / 6;
  }
  return sum;
}

bool is_closed(const Work& work) {
  bool closed = true;
  SideLists(work.triangles, work.points.size())
      .each_edge([&](std::uint32_t, std::span<const SideLists::Item> sides) {
        closed = closed && sides.size() == 2 && SideLists::forward(sides[0]) &&
                 !SideLists::forward(sides[1]);
      });
  return closed;
}

TEST(CollapsePieces, KeepTheShape) {
  const Work dense = ring(400, 120);
  const Work work = collapsed(dense);
  EXPECT_LT(work.triangles.size(), dense.triangles.size() / 4);
  EXPECT_GT(work.triangles.size(), 2500U);
  ASSERT_TRUE(is_closed(dense));
  EXPECT_TRUE(is_closed(work));
  EXPECT_EQ(work.points.size(), work.triangles.size() / 2);  // Of genus 1; no vertex is left over.
  EXPECT_NEAR(volume(work), volume(dense), 1e-4 * volume(dense));
}

TEST(CollapsePieces, DoNotDependOnThreads) {
  const Work dense = ring(400, 120);
  set_thread_limit(1);
  const Work one = collapsed(dense);
  set_thread_limit(3);
  const Work three = collapsed(dense);
  set_thread_limit(0);
  EXPECT_EQ(one.triangles, three.triangles);
  ASSERT_EQ(one.points.size(), three.points.size());
  for (std::size_t v = 0; v < one.points.size(); ++v) {
    const Vec3d way = one.points[v] - three.points[v];
    ASSERT_EQ(dot(way, way), 0);
  }
}

TEST(CollapsePieces, LeaveBordersOfLabelsAndPlaces) {
  const Work dense = ring(400, 120);
  Work labelled = dense;
  for (const Triangle& t : dense.triangles) labelled.labels.push_back(t[0] < 400 * 120 / 2);
  const Ball place{{0.35, 0, 0.1}, 0.03};
  const auto inside = [&](const Vec3d& p) {
    const Vec3d way = p - place.center;
    return dot(way, way) < place.radius * place.radius;
  };
  const Work work = collapsed(labelled, {&place, 1});
  EXPECT_EQ(std::count_if(work.points.begin(), work.points.end(), inside),
            std::count_if(dense.points.begin(), dense.points.end(), inside));
  ASSERT_EQ(work.labels.size(), work.triangles.size());
  const auto line = [](const Work& of) {
    std::vector<std::set<std::uint32_t>> labels(of.points.size());
    for (std::size_t t = 0; t < of.triangles.size(); ++t) {
      for (const std::uint32_t v : of.triangles[t]) labels[v].insert(of.labels[t]);
    }
    return std::count_if(labels.begin(), labels.end(), [](const auto& s) { return s.size() > 1; });
  };
  EXPECT_EQ(line(work), line(labelled));
}

TEST(MeshPieces, AreHalvesAlongTheLongestSide) {
  const Work work = ring(700, 120);  // More than one thread looks at at a time.
  std::vector<Vec3> points = to_floats(work.points);
  for (Vec3& p : points) p.y *= 3;
  for (std::size_t v = 0; v < points.size(); v += 3) points[v].y = 0.25F;  // Many are alike.
  std::vector<std::vector<std::uint32_t>> expected(1);
  for (std::uint32_t t = 0; t < work.triangles.size(); ++t) expected[0].push_back(t);
  const auto corner = [&](std::uint32_t t) { return points[work.triangles[t][0]]; };
  for (int level = 0; level < 3; ++level) {
    std::vector<std::vector<std::uint32_t>> halves;
    for (std::vector<std::uint32_t>& all : expected) {
      const auto side = [&](auto axis) {
        const auto [low, high] = std::minmax_element(all.begin(), all.end(), [&](auto a, auto b) {
          return corner(a).*axis < corner(b).*axis;
        });
        return corner(*high).*axis - corner(*low).*axis;
      };
      const float x = side(&Vec3::x), y = side(&Vec3::y), z = side(&Vec3::z);
      const auto axis = x >= y && x >= z ? &Vec3::x : y >= z ? &Vec3::y : &Vec3::z;
      std::stable_sort(all.begin(), all.end(),
                       [&](auto a, auto b) { return corner(a).*axis < corner(b).*axis; });
      const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
      halves.emplace_back(all.begin(), middle);
      halves.emplace_back(middle, all.end());
    }
    for (std::vector<std::uint32_t>& half : halves) std::sort(half.begin(), half.end());
    expected = std::move(halves);
  }
  EXPECT_EQ(pieces_of(points, work.triangles, work.triangles.size() / 8), expected);
}

TEST(CollapseMesh, IsTheSameAfterItIsCompact) {
  const Work work = ring(40, 12);
  CollapseMesh whole(work.points, work.triangles), compact = whole;
  std::vector<std::uint32_t> number(work.points.size());
  std::iota(number.begin(), number.end(), 0U);
  std::mt19937 random(7);
  std::vector<CollapseMesh::Neighbour> near, other;
  for (int step = 0; step < 420; ++step) {
    const auto kept = static_cast<std::uint32_t>(random() % whole.points.size());
    if (whole.valence[kept] == 0) continue;
    whole.gather(kept, near);
    const std::uint32_t gone = near[random() % near.size()].vertex;
    whole.merge(kept, gone);
    compact.merge(number[kept], number[gone]);
    if (step % 60 != 59) continue;
    const std::vector<std::uint32_t> next = compact.compact();
    for (std::uint32_t& v : number) v = v == kNoVertex ? v : next[v];
    ASSERT_EQ(compact.triangles.size(), whole.faces);
    for (std::uint32_t v = 0; v < number.size(); ++v) {
      ASSERT_EQ(number[v] == kNoVertex, whole.valence[v] == 0);
      if (whole.valence[v] == 0) continue;
      ASSERT_EQ(compact.given_vertex(number[v]), v);
      ASSERT_EQ(compact.valence[number[v]], whole.valence[v]);
      whole.gather(v, near);
      compact.gather(number[v], other);
      ASSERT_EQ(other.size(), near.size());
      for (std::size_t i = 0; i < near.size(); ++i) {
        ASSERT_EQ(other[i].vertex, number[near[i].vertex]);
        ASSERT_EQ(other[i].triangles, near[i].triangles);
      }
    }
  }
  ASSERT_LT(whole.faces, work.triangles.size() / 2);
  std::vector<Vec3d> points, compact_points;
  std::vector<Triangle> left, compact_left;
  std::vector<std::uint32_t> sources, compact_sources;
  whole.extract(points, left, sources);
  compact.extract(compact_points, compact_left, compact_sources);
  EXPECT_EQ(compact_left, left);
  EXPECT_EQ(compact_sources, sources);
  EXPECT_EQ(compact_points.size(), points.size());
}

TEST(CollapseQueue, FollowsVerticesToNewNumbers) {
  CollapseQueue queue;
  std::vector<std::uint32_t> stamps(6, 0);
  queue.assign({{3, 4, 5, 0, 0, 0}, {1, 0, 2, 0, 0, 0}, {2, 2, 4, 0, 0, 0}});
  ASSERT_EQ(queue.front(stamps)->cost, 1);
  queue.push({0.5, 2, 5, 0, 0, 0});
  stamps[0] = 1;  // It is gone.
  queue.renumber({kNoVertex, kNoVertex, 0, kNoVertex, 1, 2}, stamps);
  const std::vector<std::uint32_t> new_stamps(3, 0);
  for (const CollapseEntry& expected :
       {CollapseEntry{0.5, 0, 2, 0, 0, 0}, CollapseEntry{2, 0, 1, 0, 0, 0},
        CollapseEntry{3, 1, 2, 0, 0, 0}}) {
    const CollapseEntry* const front = queue.front(new_stamps);
    ASSERT_NE(front, nullptr);
    EXPECT_EQ(front->cost, expected.cost);
    EXPECT_EQ(front->a, expected.a);
    EXPECT_EQ(front->b, expected.b);
    queue.pop();
  }
  EXPECT_EQ(queue.front(new_stamps), nullptr);
}

TEST(CollapseQueue, GivesTheCheapestFirst) {
  std::mt19937 random(3);
  std::vector<CollapseEntry> all;
  std::vector<std::uint32_t> stamps(20'000, 0);
  for (std::uint32_t i = 0; i < 20'000; ++i) all.push_back({random() % 5000 * 1.0, i, i, 0, 0, 0});
  CollapseQueue queue;
  queue.assign(std::vector<CollapseEntry>(all.begin(), all.begin() + 15'000));
  std::size_t pushed = 15'000, given = 0;
  stamps[7] = 1;  // Of another time.
  std::multiset<double> left;
  for (std::size_t i = 0; i < pushed; ++i) left.insert(all[i].cost);
  while (const CollapseEntry* front = queue.front(stamps)) {
    const CollapseEntry entry = *front;
    queue.pop();
    left.erase(left.find(entry.cost));
    ++given;
    // Entries that are dropped unseen may be cheaper.
    if (!left.empty() && *left.begin() != all[7].cost) {
      ASSERT_LE(entry.cost, *left.begin());
    }
    if (pushed < all.size()) {
      left.insert(all[pushed].cost);
      queue.push(all[pushed++]);
    }
  }
  EXPECT_GE(given, all.size() - 1);
}

}  // namespace
}  // namespace kiln
