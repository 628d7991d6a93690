// Results of all that base/vectors.h has, as bits: included once with the compiler's vectors and once with plain ones,
// whose namespace is another.
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "base/vectors.h"

namespace kiln {

inline std::vector<std::uint64_t> vector_results() {
  std::vector<std::uint64_t> bits;
  const auto keep = [&](const auto& lanes, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      if constexpr (sizeof(lanes[0]) == 4) {
        bits.push_back(std::bit_cast<std::uint32_t>(lanes[i]));
      } else {
        bits.push_back(std::bit_cast<std::uint64_t>(lanes[i]));
      }
    }
  };
  std::mt19937 random(1);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float special[] = {0.0F, -0.0F, kInfinity, -kInfinity, std::nanf(""), 1e30F, -3e9F, 0.5F};
  const auto number = [&] {
    const std::uint32_t r = random();
    return r % 8 == 0 ? special[r / 8 % 8] : static_cast<float>(static_cast<int>(r)) * 1e-6F;
  };
  for (int round = 0; round < 500; ++round) {
    const Float4 a{number(), number(), number(), number()},
        b{number(), number(), number(), number()};
    keep(a + b, 4), keep(a - b, 4), keep(a * b, 4), keep(a / b, 4), keep(-a, 4);
    keep(lower(a, b), 4), keep(upper(a, b), 4), keep(select(a < b, a, b), 4);
    keep(to_int4(a), 4), keep(floor_int4(b), 4), keep(to_float4(to_int4(a)), 4);
    const float row[] = {number(), number(), number(), number(), number()};
    keep(load_float4(row + 1), 4);
    const Int4 i = to_int4(a), last = Int4{} + 7;
    keep(select(i < last, i, last), 4), keep(select(i > 0, i, Int4{}), 4);
    const Double2 c{number(), number()}, d{number(), number()};
    keep(c + d, 2), keep(c - d, 2), keep(c * d, 2), keep(c / d, 2), keep(2 * c, 2), keep(1 / d, 2);
    keep(larger(c, d), 2), keep(select(c <= d, c, d), 2), keep(select(c == d, c, d), 2);
    keep(select((c > d) & (c < d * d), c, d), 2), keep(select((c > d) | (c < d), c, d), 2);
    Word2 e{random(), random()};
    const Word2 f{random(), random()};
    keep(e | f >> 3 | f << 1 << 40, 2);
    e &= f;
    keep(e, 2);
  }
  return bits;
}

}  // namespace kiln
