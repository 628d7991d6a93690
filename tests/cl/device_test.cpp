#include "kiln/device.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/shapes.h"

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

/// The driver's threads are not in a forked child, where a call would wait for them for good.
TEST(Device, InAForkedChildIsAnError) {
  KILN_REQUIRE_DEVICE();
  const Mesh high = test::plane(2, 2), low = test::plane(1, 1);
  const Source source(*test::device(), high);
  BakeOptions options;
  options.width = options.height = 16;
  bake(source, low, options);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(60);  // ends a child that waits
    int exit_code = 1;
    try {
      bake(source, low, options);
    } catch (const Error& error) {
      const bool says = std::string(error.what()).find("fork") != std::string::npos;
      exit_code = error.code() == ErrorCode::device && says ? 0 : 2;
    }
    _exit(exit_code);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  bake(source, low, options);  // The parent goes on.
}

}  // namespace
}  // namespace kiln
