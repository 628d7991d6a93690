// Edge collapse piece by piece: nothing is torn where pieces meet.
#include "lowpoly/collapse_pieces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "kiln/threads.h"
#include "lowpoly/collapse_queue.h"
#include "mesh/vertex_lists.h"

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
  Work work = dense;
  collapse_in_pieces(work, 5000, {}, {});
  EXPECT_LT(work.triangles.size(), dense.triangles.size() / 4);
  EXPECT_GT(work.triangles.size(), 2500U);
  ASSERT_TRUE(is_closed(dense));
  EXPECT_TRUE(is_closed(work));
  EXPECT_EQ(work.points.size(), work.triangles.size() / 2);  // Of genus 1; no vertex is left over.
  EXPECT_NEAR(volume(work), volume(dense), 1e-4 * volume(dense));
}

TEST(CollapsePieces, DoNotDependOnThreads) {
  Work one = ring(400, 120), three = one;
  set_thread_limit(1);
  collapse_in_pieces(one, 5000, {}, {});
  set_thread_limit(3);
  collapse_in_pieces(three, 5000, {}, {});
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
  Work work = dense;
  const Place place{{0.35, 0, 0.1}, 0.03};
  const auto inside = [&](const Vec3d& p) {
    const Vec3d way = p - place.center;
    return dot(way, way) < place.radius * place.radius;
  };
  for (const Triangle& t : work.triangles) work.labels.push_back(t[0] < work.points.size() / 2);
  collapse_in_pieces(work, 5000, {&place, 1}, {});
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
  Work labelled = dense;
  for (const Triangle& t : dense.triangles) labelled.labels.push_back(t[0] < 400 * 120 / 2);
  EXPECT_EQ(line(work), line(labelled));
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
    // What is dropped unseen may be cheaper.
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
