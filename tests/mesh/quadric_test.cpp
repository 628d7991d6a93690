// Places of vertices by quadrics.
#include "mesh/quadric.h"

#include <gtest/gtest.h>

#include <cmath>

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

/// The cost of moving a vertex that a line of curvature holds: full where few of its edges are lines.
TEST(Quadric, LinesHoldLessTheMoreOfTheEdgesTheyAre) {
  for (const auto& [lines, weight] :
       {std::pair(0.0, 1.0), std::pair(0.5, 1.0), std::pair(1.0, 1.0), std::pair(1.25, 0.75),
        std::pair(1.5, 0.5), std::pair(1.75, 0.25), std::pair(2.0, 0.0), std::pair(3.0, 0.0)}) {
    EXPECT_NEAR(max_line_weight(lines, 4), weight, 1e-12) << lines;
  }
  EXPECT_EQ(max_line_weight(0, 0), 0);
}

TEST(Quadric, LinesWeighByTheCosineBetweenTheirFaces) {
  EXPECT_NEAR(line_weight({0, 0, 2}, {0, 0, 5}), 1, 1e-12);
  EXPECT_NEAR(line_weight({0, 0, 2}, {3, 0, 3}), std::sqrt(0.5), 1e-12);
  EXPECT_EQ(line_weight({0, 0, 2}, {1, 0, 0}), 0);
  EXPECT_EQ(line_weight({0, 0, 2}, {0, 1, -1}), 0);
  EXPECT_EQ(line_weight({0, 0, 0}, {0, 0, 1}), 0);
}

}  // namespace
}  // namespace kiln
