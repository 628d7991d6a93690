// Functions of the C library that results depend on: on every platform they give the same values to single precision, in
// which results are written. Double precision differs in the last place between C libraries (host/base/README.md).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/cube_root.h"
#include "base/fnv.h"

namespace kiln {
namespace {

/// Numbers evenly spread within a range, by a linear congruence.
class Numbers {
 public:
  double next(double low, double high) {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return low + (high - low) * static_cast<double>(state_ >> 11) / 9007199254740992.0;
  }

 private:
  std::uint64_t state_ = 1;
};

constexpr int kArguments = 20000;

std::uint64_t hash_of(const std::function<double(Numbers&)>& function) {
  Numbers numbers;
  std::string bytes;
  for (int i = 0; i < kArguments; ++i) {
    const auto value = static_cast<float>(function(numbers));
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return fnv1a(bytes);
}

TEST(Libm, FunctionsAreTheSameToSinglePrecision) {
  struct Row {
    const char* name;
    std::uint64_t hash;  ///< By glibc 2.36
    std::function<double(Numbers&)> function;
  };
  const std::vector<Row> rows = {
      {"sin", 0x34314ccb508b9b, [](Numbers& n) { return std::sin(n.next(-7, 7)); }},
      {"cos", 0xfcb9ea3a48919c10, [](Numbers& n) { return std::cos(n.next(-7, 7)); }},
      {"asin", 0xc94f8e67b5f293a0, [](Numbers& n) { return std::asin(n.next(-1, 1)); }},
      {"acos", 0x40298243ad3cca07, [](Numbers& n) { return std::acos(n.next(-1, 1)); }},
      {"atan", 0x76bb80f6f5b8ae48, [](Numbers& n) { return std::atan(n.next(-10, 10)); }},
      {"exp2", 0xf86b13813136149c, [](Numbers& n) { return std::exp2(n.next(-20, 20)); }},
      {"log", 0xf08b4c7181203663, [](Numbers& n) { return std::log(n.next(1e-6, 1000)); }},
      {"log2", 0xf30422374bce4581, [](Numbers& n) { return std::log2(n.next(1e-6, 1000)); }},
      {"log10", 0x6d0a2f4c56a78f7f, [](Numbers& n) { return std::log10(n.next(1e-6, 1000)); }},
      {"atan2", 0x81f037addaeb28ba,
       [](Numbers& n) {
         const double y = n.next(-10, 10);
         return std::atan2(y, n.next(-10, 10));
       }},
      {"pow", 0xf3ab7e8f03b63421,
       [](Numbers& n) {
         const double x = n.next(0, 10);
         return std::pow(x, n.next(-3, 3));
       }},
      {"hypot", 0x1e44211086faef4d,
       [](Numbers& n) {
         const double x = n.next(-10, 10);
         return std::hypot(x, n.next(-10, 10));
       }},
      {"hypot of three", 0x431fd1681e938bd3,
       [](Numbers& n) {
         const double x = n.next(-10, 10), y = n.next(-10, 10);
         return std::hypot(x, y, n.next(-10, 10));
       }},
      {"fmod", 0x9645b54c78efa94e,
       [](Numbers& n) {
         const double x = n.next(-1000, 1000);
         return std::fmod(x, n.next(0.01, 10));
       }},
      {"cube_root", 0x728efe426f482016, [](Numbers& n) { return cube_root(n.next(1e-6, 1000)); }},
  };
  for (const Row& row : rows) EXPECT_EQ(hash_of(row.function), row.hash) << row.name;
}

// An angle that is nearly a multiple of a quarter turn has the sine or cosine of what is missing: processors that reduce
// angles by a short pi have few of its digits right (base/windows/math.cpp). The exact values are pi's next digits.
TEST(Libm, SineAndCosineAreExactNearTheirZeros) {
  const volatile double half = 3.141592653589793, quarter = half / 2;
  EXPECT_EQ(std::sin(half), 1.2246467991473532e-16);
  EXPECT_EQ(std::sin(2 * half), -2.4492935982947064e-16);
  EXPECT_EQ(std::sin(-half), -1.2246467991473532e-16);
  EXPECT_EQ(std::cos(quarter), 6.123233995736766e-17);
  EXPECT_EQ(std::cos(3 * quarter), -1.8369701987210297e-16);
  EXPECT_EQ(std::cos(-quarter), 6.123233995736766e-17);
}

// Ties of whole numbers and halves, which functions that round must not take for something else.
TEST(Libm, FunctionsThatRoundAreExact) {
  for (int i = -1000; i <= 1000; ++i) {
    const double half = i / 2.0;
    // Away from 0, and to the even number.
    EXPECT_EQ(std::lround(half), static_cast<long>(half + (half < 0 ? -0.5 : 0.5))) << half;
    const double down = std::floor(half), up = std::ceil(half);
    EXPECT_EQ(std::nearbyint(half), std::fmod(down, 2) == 0 ? down : up) << half;
  }
  // Decimal logarithms of whole powers, whose floor() is used.
  double power = 1;
  for (int i = 0; i <= 22; ++i, power *= 10) EXPECT_EQ(std::log10(power), i);
}

#ifdef _WIN32
// Not those of msvcrt.dll, which is another on each Windows (base/windows/math.cpp).
TEST(Libm, FunctionsAreTheProgramsOwn) {
  Numbers numbers;
  for (int i = 0; i < kArguments; ++i) {
    const double x = numbers.next(-1, 1), y = numbers.next(-10, 10);
    EXPECT_EQ(std::acos(x), static_cast<double>(acosl(x)));
    EXPECT_EQ(std::asin(x), static_cast<double>(asinl(x)));
    EXPECT_EQ(std::atan(y), static_cast<double>(atanl(y)));
    EXPECT_EQ(std::tan(x), static_cast<double>(tanl(x)));
    EXPECT_EQ(std::log10(x + 2), static_cast<double>(log10l(x + 2)));
    EXPECT_EQ(std::hypot(x, y), static_cast<double>(hypotl(x, y)));
  }
}
#endif

/// 0.6 units in the last place: half of one, and what Newton's step leaves.
TEST(CubeRoot, IsNearestButForSome) {
  Numbers numbers;
  int off = 0;
  for (int i = 0; i < kArguments; ++i) {
    const double x = std::ldexp(numbers.next(1, 2), i % 120 - 60), root = cube_root(x);
    const long double exact = std::cbrt(static_cast<long double>(x));
    const auto nearest = static_cast<double>(exact);
    if (root == nearest) continue;
    ++off;
    EXPECT_TRUE(root == std::nextafter(nearest, 0) || root == std::nextafter(nearest, 2 * nearest))
        << x;
    EXPECT_LE(std::abs(root - exact), 0.6L * (std::nextafter(nearest, 2 * nearest) - nearest)) << x;
  }
  EXPECT_LE(off, kArguments / 1000);
}

}  // namespace
}  // namespace kiln
