// Places of vertices by quadrics.
#include "mesh/quadric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

#include "simplify/quadric_pair.h"

namespace kiln {
namespace {

/// A horizontal plane and one that rises by an angle, from x = 0.3 on.
Quadric fold(double angle) {
  Quadric quadric;
  quadric.add_plane({0, 0, 1}, {0, 0, 0}, 1);
  quadric.add_plane({-std::sin(angle), 0, std::cos(angle)}, {0.3, 0, 0}, 1);
  return quadric;
}

TEST(Quadric, AShallowFoldHoldsAVertex) {
  for (const double angle : {0.3, 0.05, 0.02}) {
    const Vec3d best = fold(angle).best_near({0, 0, 0}, {1, 0, 0});
    EXPECT_NEAR(best.x, 0.3, 0.01) << angle;
    EXPECT_NEAR(best.z, 0, 1e-3) << angle;
  }
}

TEST(Quadric, WherePlanesLeaveADirectionFreeAVertexStaysInTheMiddle) {
  for (const double angle : {0.3, 0.02, 0.0}) {
    EXPECT_NEAR(fold(angle).best_near({0, -1, 0}, {0.6, 1, 0}).y, 0, 1e-6) << angle;
  }
  EXPECT_NEAR(fold(0).best_near({0, 0, 0}, {1, 0, 0}).x, 0.5, 1e-6);
}

TEST(TwoQuadrics, AreWhatEachIsToTheBit) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  const auto point = [&] { return Vec3d(number(random), number(random), number(random)); };
  // Few planes, too: then the best place is far off, and one of the ends or the middle is taken.
  const auto some_planes = [&](int count) {
    Quadric sum;
    for (int i = 0; i < count; ++i) {
      const Vec3d normal = point();
      sum.add_plane(normal * (1 / length(normal)), point(), std::abs(number(random)));
      sum.area += std::abs(number(random));
    }
    return sum;
  };
  int far = 0;
  for (int i = 0; i < 2000; ++i) {
    const Quadric a = some_planes(i % 4), b = some_planes(i % 3), c = some_planes(i % 5), d = a;
    const Vec3d from = point(), to = point(), other_from = point(), other_to = point();
    const TwoQuadrics both(a, b, c, d);
    const TwoQuadrics::Point best = both.best_near({from, other_from}, {to, other_to});
    const Double2 off = both.off(best);
    for (int k = 0; k < 2; ++k) {
      const Quadric sum = k == 0 ? a + b : c + d;
      const Vec3d place = k == 0 ? sum.best_near(from, to) : sum.best_near(other_from, other_to);
      ASSERT_EQ(best.x[k], place.x) << i;
      ASSERT_EQ(best.y[k], place.y) << i;
      ASSERT_EQ(best.z[k], place.z) << i;
      ASSERT_EQ(off[k], sum.off(place)) << i;
      const Vec3d end = k == 0 ? from : other_from;
      far += place.x == end.x && place.y == end.y;
    }
  }
  EXPECT_GT(far, 100);
}

}  // namespace
}  // namespace kiln
