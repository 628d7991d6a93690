#include "kiln/device.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "support/environment.h"

namespace kiln {
namespace {

TEST(Device, IsListedWithWhatMatters) {
  KILN_REQUIRE_DEVICE();
  const DeviceInfo& info = test::device()->info();
  EXPECT_FALSE(info.name.empty());
  EXPECT_FALSE(info.driver.empty());
  EXPECT_GT(info.memory_bytes, 0u);
  EXPECT_GT(info.largest_buffer_bytes, 0u);
  const std::vector<DeviceInfo> all = list_devices();
  ASSERT_GT(all.size(), static_cast<std::size_t>(info.index));
  EXPECT_EQ(all[static_cast<std::size_t>(info.index)].name, info.name);
}

TEST(Device, UnknownSelectorNamesTheDevicesThereAre) {
  KILN_REQUIRE_DEVICE();
  try {
    Device::open("no such device");
    FAIL() << "opened a device that is not there";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::device);
    EXPECT_NE(std::string(error.what()).find(test::device()->info().name), std::string::npos);
  }
}

}  // namespace
}  // namespace kiln
