#include <gtest/gtest.h>

#include "accel/vector_results.h"

std::vector<std::uint64_t> plain_vector_results();

namespace kiln {
namespace {

TEST(Vectors, PlainOnesGiveTheSameBits) {
  const std::vector<std::uint64_t> own = vector_results(), plain = plain_vector_results();
  ASSERT_EQ(own.size(), plain.size());
  for (std::size_t i = 0; i < own.size(); ++i) ASSERT_EQ(own[i], plain[i]) << i;
}

}  // namespace
}  // namespace kiln
