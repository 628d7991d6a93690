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

}  // namespace
}  // namespace kiln
