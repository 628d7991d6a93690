#include "kiln/device.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "kiln/bake.h"
#include "support/environment.h"
#include "support/process.h"
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

/// PoCL's library stands for one that no loader lists. The device passes the self-test, which is computed anew.
TEST(Device, ComesFromALibraryThatIsNamedWhereTheSystemHasNone) {
  KILN_REQUIRE_DEVICE();
  std::string library;
  std::ifstream("/etc/OpenCL/vendors/pocl.icd") >> library;
  if (library.empty()) GTEST_SKIP() << "no Debian package of PoCL";
  const auto devices_with = [](const std::string& driver) {
    return test::run_kiln({"devices"}, {.environment = {{"OCL_ICD_VENDORS", test::scratch_folder()},
                                                        {"KILN_OPENCL_DRIVER", driver},
                                                        {"KILN_KEEP_BINARIES", "0"}}});
  };
  const test::ProcessResult found = devices_with(library);
  EXPECT_EQ(found.exit_code, 0) << found.errors;
  EXPECT_NE(found.output.find("computes as it should: yes"), std::string::npos) << found.output;
  for (const std::string none : {"", "/no/such/library.so", "libm.so.6"}) {
    const test::ProcessResult refused = devices_with(none);
    EXPECT_EQ(refused.exit_code, 4) << none;
    EXPECT_NE(refused.errors.find("pip install kiln[cpu]"), std::string::npos) << refused.errors;
    EXPECT_NE(refused.errors.find(none), std::string::npos) << refused.errors;
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
