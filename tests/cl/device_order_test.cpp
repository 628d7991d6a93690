// Which of several devices is taken.
#include "cl/device_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace kiln {
namespace {

constexpr std::uint64_t kGib = std::uint64_t{1} << 30;
constexpr DeviceRank kProcessor{false, true, 64 * kGib, 32}, kIntegrated{true, true, 32 * kGib, 96},
    kDiscrete{true, false, 8 * kGib, 20}, kLarge{true, false, 24 * kGib, 16},
    kWide{true, false, 24 * kGib, 128};

std::vector<DeviceRank> ordered(std::vector<DeviceRank> ranks) {
  std::stable_sort(ranks.begin(), ranks.end(), is_preferred);
  return ranks;
}

TEST(DeviceOrder, PutsTheDiscreteGpuWithTheMostMemoryFirst) {
  const std::vector<DeviceRank> expected{kWide, kLarge, kDiscrete, kIntegrated, kProcessor};
  std::vector<DeviceRank> mixed = expected;
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    std::shuffle(mixed.begin(), mixed.end(), random);
    const std::vector<DeviceRank> found = ordered(mixed);
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_EQ(found[k].memory_bytes, expected[k].memory_bytes);
      EXPECT_EQ(found[k].compute_units, expected[k].compute_units);
    }
  }
}

TEST(DeviceOrder, SaysWhyTheFirstIsTaken) {
  EXPECT_EQ(explain_preference({kProcessor, kProcessor}), "since there is no GPU");
  EXPECT_EQ(explain_preference({kIntegrated, kProcessor}), "the only GPU");
  EXPECT_EQ(explain_preference({kDiscrete, kIntegrated, kProcessor}), "the only discrete GPU");
  EXPECT_EQ(explain_preference({kLarge, kDiscrete}), "the discrete GPU with the most memory");
  EXPECT_EQ(explain_preference({kWide, kLarge, kDiscrete}),
            "the discrete GPU with the most compute units");
  EXPECT_EQ(explain_preference({kWide, kWide}), "the first of several equal GPUs");
}

// Memory and compute units are compared among GPUs of the first one's kind alone: an integrated GPU reports the host's
// memory as its own, so that it often has as much as the discrete one, or more.
TEST(DeviceOrder, ComparesDiscreteGpusWithDiscreteOnes) {
  constexpr DeviceRank kAsMuch{true, true, kLarge.memory_bytes, kLarge.compute_units};
  constexpr DeviceRank kMore{true, true, 4 * kLarge.memory_bytes, 4 * kLarge.compute_units};
  for (const DeviceRank& integrated : {kAsMuch, kMore}) {
    EXPECT_TRUE(is_preferred(kLarge, integrated));
    EXPECT_FALSE(is_preferred(integrated, kLarge));
    EXPECT_EQ(explain_preference({kLarge, integrated}), "the only discrete GPU");
    EXPECT_EQ(explain_preference({kLarge, kDiscrete, integrated}),
              "the discrete GPU with the most memory");
    EXPECT_EQ(explain_preference({kWide, kLarge, integrated}),
              "the discrete GPU with the most compute units");
    EXPECT_EQ(explain_preference({kLarge, kLarge, integrated}), "the first of several equal GPUs");
  }
  // Where all are integrated, the processor's memory does not count either.
  constexpr DeviceRank kProcessorOfAsMuch{false, true, kMore.memory_bytes, kMore.compute_units};
  EXPECT_EQ(explain_preference({kMore, kAsMuch, kProcessorOfAsMuch}),
            "the integrated GPU with the most memory");
}

}  // namespace
}  // namespace kiln
