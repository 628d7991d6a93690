// Labels beside marks: inside, apart, the same every time.
#include "lab/chart_labels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace kiln::cli {
namespace {

LabelScene scene_of(double width, double height) {
  LabelScene scene;
  scene.panel = {{width / 2, height / 2}, width, height};
  return scene;
}

/// Marks in a crowd: most of them in a small part of the panel.
std::vector<Point> crowd(std::size_t count, std::uint32_t seed) {
  std::vector<Point> marks;
  const auto next = [&] {
    seed = seed * 1664525U + 1013904223U;
    return static_cast<double>(seed >> 8) / 16777216.0;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const double spread = i % 3 == 0 ? 700 : 180;
    marks.push_back({30 + spread * next(), 20 + spread * 0.7 * next()});
  }
  return marks;
}

TEST(ChartLabels, LiesBesideItsMarkWhereThereIsRoom) {
  const std::vector<PlacedLabel> places =
      place_labels({{400, 300}}, {{{}, 120, 20}}, scene_of(800, 600));
  ASSERT_EQ(places.size(), 1U);
  EXPECT_FALSE(places[0].leader);
  EXPECT_NEAR(places[0].box.center.y, 300, 1e-9);
  EXPECT_LT(std::abs(places[0].box.center.x - 400) - 60, 20);
  EXPECT_GT(std::abs(places[0].box.center.x - 400) - 60, 9.9);
}

TEST(ChartLabels, NoneCoversAnotherNorAMark) {
  LabelScene scene = scene_of(800, 600);
  scene.kept.push_back({{70, 560}, 140, 80});
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    const std::vector<Point> marks = crowd(16, seed);
    const std::vector<Box> sizes(marks.size(), Box{{}, 150, 20});
    const std::vector<PlacedLabel> places = place_labels(marks, sizes, scene);
    ASSERT_EQ(places.size(), marks.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Box& box = places[i].box;
      EXPECT_GE(box.center.x - box.width / 2, 0) << seed;
      EXPECT_LE(box.center.x + box.width / 2, 800) << seed;
      EXPECT_GE(box.center.y - box.height / 2, 0) << seed;
      EXPECT_LE(box.center.y + box.height / 2, 600) << seed;
      EXPECT_FALSE(overlap(box, scene.kept[0])) << seed;
      for (std::size_t k = 0; k < places.size(); ++k) {
        EXPECT_FALSE(overlap(box, {marks[k], 2 * scene.mark_radius, 2 * scene.mark_radius}))
            << "label " << i << ", mark " << k << ", seed " << seed;
        if (k != i) {
          EXPECT_FALSE(overlap(box, places[k].box)) << i << " and " << k << ", seed " << seed;
        }
      }
    }
    const std::vector<PlacedLabel> again = place_labels(marks, sizes, scene);
    for (std::size_t i = 0; i < places.size(); ++i) {
      EXPECT_EQ(again[i].box.center.x, places[i].box.center.x);
      EXPECT_EQ(again[i].box.center.y, places[i].box.center.y);
    }
  }
}

TEST(ChartLabels, AvoidsLines) {
  LabelScene scene = scene_of(800, 600);
  // Along the right side of the mark, where it would go otherwise.
  scene.lines.push_back({{400, 300}, {790, 300}});
  const PlacedLabel place = place_labels({{400, 300}}, {{{}, 120, 20}}, scene)[0];
  const bool covers = place.box.center.x + 60 > 400 && std::abs(place.box.center.y - 300) < 10;
  EXPECT_FALSE(covers && place.box.center.x > 400);
}

}  // namespace
}  // namespace kiln::cli
