// Functions of the C library that results depend on: to single precision, in which most results are written, they give the
// same values on every platform. Searches branch on their last digit in double precision: kiln.exe has the functions of
// glibc 2.36 (host/base/README.md).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "base/cube_root.h"
#include "base/fnv.h"
#ifdef __GLIBC__
#include <gnu/libc-version.h>
#endif

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

template <class Number>
std::uint64_t hash_of(const std::function<double(Numbers&)>& function) {
  Numbers numbers;
  std::string bytes;
  for (int i = 0; i < kArguments; ++i) {
    const auto value = static_cast<Number>(function(numbers));
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  return fnv1a(bytes);
}

struct Row {
  const char* name;
  std::uint64_t single;  ///< Hash of results, rounded to single precision
  /// Hashes of results of glibc 2.36 on processors with FMA and AVX2, and on others.
  std::uint64_t with_fma, without_fma;
  std::function<double(Numbers&)> function;
};

const std::vector<Row>& rows() {
  static const std::vector<Row> all = {
      {"exp", 0xa22a6a3f7c261db7, 0xf294ca4bfaf01eb1, 0xb096306794e50ebd,
       [](Numbers& n) { return std::exp(n.next(-20, 20)); }},
      {"tan", 0x3be0c11487123b4f, 0x41b35dafa1eccef, 0x41b35dafa1eccef,
       [](Numbers& n) { return std::tan(n.next(-7, 7)); }},
      {"sin", 0x34314ccb508b9b, 0x335005891e65643e, 0xdda5aaf48cb68879,
       [](Numbers& n) { return std::sin(n.next(-7, 7)); }},
      {"cos", 0xfcb9ea3a48919c10, 0xfa07b5a45ffd771b, 0xf7979a72cd24df4e,
       [](Numbers& n) { return std::cos(n.next(-7, 7)); }},
      {"asin", 0xc94f8e67b5f293a0, 0x4d61365c004792e3, 0x48b93a7bd32a62c5,
       [](Numbers& n) { return std::asin(n.next(-1, 1)); }},
      {"acos", 0x40298243ad3cca07, 0xa5569fcda0dab1bc, 0x53fb7a4d5adb7be9,
       [](Numbers& n) { return std::acos(n.next(-1, 1)); }},
      {"atan", 0x76bb80f6f5b8ae48, 0xdebb752c13144702, 0x48a75f83009fbec1,
       [](Numbers& n) { return std::atan(n.next(-10, 10)); }},
      {"exp2", 0xf86b13813136149c, 0x2242fa677c79f9f5, 0x2242fa677c79f9f5,
       [](Numbers& n) { return std::exp2(n.next(-20, 20)); }},
      {"log", 0xf08b4c7181203663, 0x9931d04ea84d3de5, 0x9931d04ea84d3de5,
       [](Numbers& n) { return std::log(n.next(1e-6, 1000)); }},
      {"log2", 0xf30422374bce4581, 0xb00f3ef15e7f81a1, 0xd529ad8bce637676,
       [](Numbers& n) { return std::log2(n.next(1e-6, 1000)); }},
      {"log10", 0x6d0a2f4c56a78f7f, 0x9dd81dbcb14eacbe, 0x9dd81dbcb14eacbe,
       [](Numbers& n) { return std::log10(n.next(1e-6, 1000)); }},
      {"atan2", 0x81f037addaeb28ba, 0x3035343b41d52d62, 0x1b830394ac9e96d9,
       [](Numbers& n) {
         const double y = n.next(-10, 10);
         return std::atan2(y, n.next(-10, 10));
       }},
      {"pow", 0xf3ab7e8f03b63421, 0x2e5bdbf41a0a890e, 0x76e2c03b9ca5c1d7,
       [](Numbers& n) {
         const double x = n.next(0, 10);
         return std::pow(x, n.next(-3, 3));
       }},
      {"hypot", 0x1e44211086faef4d, 0x83df2ac7cd021c31, 0x83df2ac7cd021c31,
       [](Numbers& n) {
         const double x = n.next(-10, 10);
         return std::hypot(x, n.next(-10, 10));
       }},
      {"sqrt", 0x759be7e3a75165ab, 0x59894bfe1bcde5f0, 0x59894bfe1bcde5f0,
       [](Numbers& n) {
         double (*const volatile function)(double) = std::sqrt;  // not the compiler's instruction
         return function(n.next(0, 1000));
       }},
      {"hypot of three", 0x431fd1681e938bd3, 0x52d7bec640dbcb98, 0x52d7bec640dbcb98,
       [](Numbers& n) {
         const double x = n.next(-10, 10), y = n.next(-10, 10);
         return std::hypot(x, y, n.next(-10, 10));
       }},
      {"fmod", 0x9645b54c78efa94e, 0x50c4a65030ab126d, 0x50c4a65030ab126d,
       [](Numbers& n) {
         const double x = n.next(-1000, 1000);
         return std::fmod(x, n.next(0.01, 10));
       }},
      {"cube_root", 0x728efe426f482016, 0x25596e415d42425, 0x25596e415d42425,
       [](Numbers& n) { return cube_root(n.next(1e-6, 1000)); }},
  };
  return all;
}

TEST(Libm, FunctionsAreTheSameToSinglePrecision) {
  for (const Row& row : rows()) EXPECT_EQ(hash_of<float>(row.function), row.single) << row.name;
}

// Windows' program must take the code for this processor. On Linux, GLIBC_TUNABLES may have switched FMA off.
TEST(Libm, DoublesAreThoseOfGlibc) {
#ifdef _WIN32
  const bool fma = __builtin_cpu_supports("fma") != 0 && __builtin_cpu_supports("avx2") != 0;
  for (const Row& row : rows()) {
    EXPECT_EQ(hash_of<double>(row.function), fma ? row.with_fma : row.without_fma) << row.name;
  }
#elif defined __GLIBC__ && defined __x86_64__
  if (gnu_get_libc_version() != std::string("2.36")) GTEST_SKIP() << "another glibc";
  for (const Row& row : rows()) {
    const std::uint64_t hash = hash_of<double>(row.function);
    EXPECT_TRUE(hash == row.with_fma || hash == row.without_fma)
        << row.name << ": " << std::hex << hash;
  }
#else
  GTEST_SKIP() << "another C library";
#endif
}

// An angle that is nearly a multiple of a quarter turn has the sine or cosine of what is missing: processors that reduce
// angles by a short pi have few of its digits right. The exact values are pi's next digits.
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
