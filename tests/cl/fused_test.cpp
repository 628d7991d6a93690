// The fused multiply-add against exact arithmetic: integers of 128 bits, rounded once.
#include "base/fused.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace kiln {
namespace {

using Wide = __int128;

/// An integer times a power of two, to the nearest float, ties to even. Within the range of normal floats.
float rounded(Wide value, int exponent) {
  const bool negative = value < 0;
  auto magnitude = static_cast<unsigned __int128>(negative ? -value : value);
  int length = 0;
  for (auto rest = magnitude; rest != 0; rest >>= 1) ++length;
  if (const int excess = length - 24; excess > 0) {
    const auto unit = static_cast<unsigned __int128>(1) << excess;
    const auto left_out = magnitude & (unit - 1);
    magnitude >>= excess;
    exponent += excess;
    if (left_out > unit / 2 || (left_out == unit / 2 && (magnitude & 1) != 0)) ++magnitude;
  }
  const auto result =
      std::ldexp(static_cast<float>(static_cast<std::uint32_t>(magnitude)), exponent);
  return negative ? -result : result;
}

TEST(FusedMultiplyAdd, RoundsOnce) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 400000; ++i) {
    const auto mantissa = [&] {
      const auto m = static_cast<std::int64_t>(random() >> 40);
      return random() % 2 == 0 ? m : -m;
    };
    const std::int64_t a = mantissa(), b = mantissa(), c = mantissa();
    const int up = static_cast<int>(random() % 90) - 30;  // exponent of c above that of a * b
    const Wide exact = up >= 0 ? Wide{a} * b + (Wide{c} << up) : (Wide{a} * b << -up) + c;
    const float right = rounded(exact, std::min(up, 0));
    const float found = fused_multiply_add(static_cast<float>(a), static_cast<float>(b),
                                           std::ldexp(static_cast<float>(c), up));
    ASSERT_EQ(std::bit_cast<std::uint32_t>(found + 0.0F),
              std::bit_cast<std::uint32_t>(right + 0.0F))
        << a << " * " << b << " + " << c << " * 2^" << up;
  }
}

// Sums that a double cannot hold, and that it rounds to the middle of two floats: the second rounding would go to the
// even one, whichever side the sum lies on. Products of two floats that are a power of two, and one more or less.
TEST(FusedMultiplyAdd, KnowsOnWhichSideOfATieItLies) {
  struct Product {
    std::int64_t a, b;
    int exponent;
  };
  std::mt19937_64 random(8);
  int differ = 0;
  for (const Product& p : {Product{177, 3033169, 29}, Product{411849, 20857, 33},
                           Product{398739, 86171, 35}, Product{256999, 2089, 29}}) {
    ASSERT_EQ(std::abs(p.a * p.b - (std::int64_t{1} << p.exponent)), 1);
    for (int i = 0; i < 1000; ++i) {
      const auto c = static_cast<std::int64_t>(random() >> 41 | std::uint64_t{1} << 23);
      for (const std::int64_t sign : {1, -1}) {
        const float right =
            rounded(Wide{sign * p.a} * p.b + (Wide{sign * c} << (p.exponent + 1)), 0);
        const auto x = static_cast<float>(sign * p.a), y = static_cast<float>(p.b),
                   z = std::ldexp(static_cast<float>(sign * c), p.exponent + 1);
        ASSERT_EQ(fused_multiply_add(x, y, z), right) << p.a << " " << c;
        differ += static_cast<float>(double{x} * y + z) != right ? 1 : 0;
      }
    }
  }
  EXPECT_GT(differ, 2000);
}

TEST(FusedMultiplyAdd, KeepsWhatIsNotFiniteAndTheSmallest) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kLeast = std::numeric_limits<float>::denorm_min();
  EXPECT_EQ(fused_multiply_add(kInfinity, 1, 1), kInfinity);
  EXPECT_EQ(fused_multiply_add(1e30F, 1e30F, 0), kInfinity);
  EXPECT_TRUE(std::isnan(fused_multiply_add(kInfinity, 0, 1)));
  EXPECT_TRUE(std::isnan(fused_multiply_add(kInfinity, 1, -kInfinity)));
  EXPECT_EQ(fused_multiply_add(1e30F, 1e30F, -kInfinity), -kInfinity);
  // Half of the least float is a tie, to 0; any more than that is the least float.
  EXPECT_EQ(fused_multiply_add(kLeast, 0.5F, 0), 0.0F);
  EXPECT_EQ(fused_multiply_add(kLeast, 0.5F + 0x1p-24F, 0), kLeast);
  EXPECT_EQ(fused_multiply_add(kLeast, 1.5F, 0), 2 * kLeast);
  EXPECT_EQ(fused_multiply_add(kLeast, 1.5F - 0x1p-23F, 0), kLeast);
  EXPECT_TRUE(std::signbit(fused_multiply_add(-0.0F, 1, -0.0F)));
}

}  // namespace
}  // namespace kiln
