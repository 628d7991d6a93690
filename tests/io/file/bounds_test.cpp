#include "io/file/bounds.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <limits>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/limits.h"

namespace kiln {
namespace {

constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();

const FailWith kFail = [](const std::string& place, const std::string& problem,
                          const Message& remedy) {
  throw Error(ErrorCode::input, "file: " + place + ": " + problem + ". " + remedy);
};

TEST(Bounds, ProductsAreCapped) {
  EXPECT_EQ(saturated_product(0, kMost), 0u);
  EXPECT_EQ(saturated_product(kMost, 0), 0u);
  EXPECT_EQ(saturated_product(kMost, 1), kMost);
  EXPECT_EQ(saturated_product(kMost, 2), kMost);
  EXPECT_EQ(saturated_product(std::uint64_t{1} << 32, std::uint64_t{1} << 32), kMost);
  EXPECT_EQ(saturated_product(std::uint64_t{1} << 32, (std::uint64_t{1} << 32) - 1),
            (std::uint64_t{1} << 32) * ((std::uint64_t{1} << 32) - 1));
  EXPECT_EQ(max_unpacked_bytes(Packing::exr_dwa, kMost), kMost);
}

// Nothing becomes larger than the bound, and the bound is no larger than it must be.
TEST(Bounds, DeflateComesNearItsBound) {
  const std::vector<Bytef> zeros(std::size_t{64} << 20);
  std::vector<Bytef> packed(compressBound(zeros.size()));
  uLongf size = packed.size();
  ASSERT_EQ(compress2(packed.data(), &size, zeros.data(), zeros.size(), 9), Z_OK);
  EXPECT_GE(max_unpacked_bytes(Packing::deflate, size), zeros.size());
  EXPECT_LE(max_unpacked_bytes(Packing::deflate, size), zeros.size() + zeros.size() / 100);
}

TEST(Bounds, PlainBytesHoldThemselves) { EXPECT_EQ(max_unpacked_bytes(Packing::none, 325), 325u); }

TEST(Bounds, MoreThanTheFreeMemoryIsRefused) {
  EXPECT_GT(free_memory(), std::uint64_t{1} << 20);
  EXPECT_NO_THROW(require_memory("its pixels", 1 << 20, memory_failure(kFail, "pixels")));
  if (free_memory() == kMost) GTEST_SKIP() << "the system does not say how much is free";
  try {
    require_memory("its 9 x 9 pixels", std::uint64_t{1} << 60, memory_failure(kFail, "pixels"));
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_NE(text.find("pixels: its 9 x 9 pixels would take 1099511627776 MiB"), std::string::npos)
        << text;
    EXPECT_NE(text.find("Free some memory"), std::string::npos) << text;
  }
  // Stages say it without a file.
  try {
    require_memory("The maps", std::uint64_t{1} << 60);
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::internal);
    EXPECT_EQ(std::string(error.what()).find("The maps would take 1099511627776 MiB"), 0u)
        << error.what();
  }
}

}  // namespace
}  // namespace kiln
