// Arrays of a device: fills and copies of every size, of which large ones run on all threads for CPUs.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "cl/context.h"
#include "support/environment.h"

namespace kiln::ocl {
namespace {

/// Bytes of arrays: one element, the size from which all threads take part and its neighbours, and several pieces of a
/// thread's work with a remainder.
constexpr std::array<std::size_t, 6> kSizes = {
    16, (1U << 20U) - 16, 1U << 20U, (1U << 20U) + 16, 5 * (1U << 18U) + 48, (3U << 20U) + 176};

template <typename T>
T value_at(std::size_t i, unsigned seed) {
  std::array<std::uint8_t, sizeof(T)> bytes{};
  std::uint32_t state = static_cast<std::uint32_t>(i) * 2654435761U + seed;
  for (std::uint8_t& byte : bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::uint8_t>(state >> 24U);
  }
  return std::bit_cast<T>(bytes);
}

template <typename T>
std::vector<T> values(std::size_t count, unsigned seed) {
  std::vector<T> result(count);
  for (std::size_t i = 0; i < count; ++i) result[i] = value_at<T>(i, seed);
  return result;
}

template <typename T>
std::size_t first_difference(std::span<const T> found, std::span<const T> expected) {
  std::size_t i = 0;
  while (i < found.size() && i < expected.size() && found[i] == expected[i]) ++i;
  return i;
}

template <typename T>
void expect_equal(std::span<const T> found, std::span<const T> expected, const char* what) {
  ASSERT_EQ(found.size(), expected.size());
  EXPECT_EQ(first_difference(found, expected), expected.size())
      << what << ", element of " << sizeof(T) << " bytes, array of " << found.size_bytes();
}

/// The whole life of an array: written, filled, made in place, written in part, read in part.
template <typename T>
void expect_arrays_hold_what_is_written() {
  Context& context = context_of(*test::device());
  for (const std::size_t bytes : kSizes) {
    const std::size_t count = bytes / sizeof(T);
    const std::vector<T> first = values<T>(count, 1);
    Array<T> array(context, std::span<const T>(first));
    expect_equal<T>(array.download(context), first, "copied at once");

    const T repeated = value_at<T>(7, 3);
    context.fill(array, repeated);
    expect_equal<T>(array.download(context), std::vector<T>(count, repeated), "filled");

    std::vector<T> second = values<T>(count, 2);
    array.write(context, std::span<const T>(second));
    expect_equal<T>(array.download(context), second, "written");

    // A part in the middle, from an offset that no block of threads begins at.
    const std::size_t from = count / 5, size = count - from - count / 7;
    const std::vector<T> part = values<T>(size, 4);
    array.write(context, std::span<const T>(part), from);
    std::copy(part.begin(), part.end(), second.begin() + static_cast<std::ptrdiff_t>(from));
    expect_equal<T>(array.download(context), second, "written in part");
    for (const std::size_t at : {std::size_t{0}, std::size_t{1}, from, count - 1}) {
      if (at >= count) continue;
      std::vector<T> read(count - at);
      array.read(context, read, at);
      expect_equal<T>(read, std::span<const T>(second).subspan(at), "read from an offset");
    }

    array.write_by(context, count, [&](std::span<T> made) {
      ASSERT_EQ(made.size(), count);
      for (std::size_t i = 0; i < count; ++i) made[i] = value_at<T>(i, 5);
    });
    expect_equal<T>(array.download(context), values<T>(count, 5), "made in place");
  }
}

TEST(Array, HoldsWhatIsWrittenAtEverySizeAndOffset) {
  KILN_REQUIRE_DEVICE();
  expect_arrays_hold_what_is_written<std::uint8_t>();
  expect_arrays_hold_what_is_written<std::uint16_t>();
  expect_arrays_hold_what_is_written<std::uint32_t>();
  expect_arrays_hold_what_is_written<std::uint64_t>();
}

/// An exception of the function that fills a large array in place leaves the array mapped nowhere.
TEST(Array, ThatAMakerFailedToFillIsUsableAgain) {
  KILN_REQUIRE_DEVICE();
  Context& context = context_of(*test::device());
  const std::size_t count = (1U << 20U) + 3;
  Array<std::uint32_t> array(context, count);
  EXPECT_THROW(array.write_by(context, count,
                              [](std::span<std::uint32_t>) { throw std::runtime_error("maker"); }),
               std::runtime_error);
  context.fill(array, std::uint32_t{9});
  expect_equal<std::uint32_t>(array.download(context), std::vector<std::uint32_t>(count, 9),
                              "filled after a failure");
}

}  // namespace
}  // namespace kiln::ocl
