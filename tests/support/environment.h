// The OpenCL device that tests share.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace kiln {
class Device;
}

namespace kiln::test {

/// The device under test: the one that KILN_DEVICE names, else the first. It is opened once and released before main()
/// returns, since a static destructor would run after that of the OpenCL library. Null if there is no device.
const Device* device();

/// Path of a file in the shared data folder; nullopt if it does not exist.
std::optional<std::filesystem::path> shared_data(const std::string& name);

/// Path of a file or folder in tests/data.
std::filesystem::path test_data(const std::string& name);

/// Path of the kiln command: of this build, or from the variable KILN_COMMAND; empty if there is none.
std::string kiln_command();

/// The library made from tests/faults/shim.cpp, to be preloaded into a program; empty if it was not built.
std::string fault_library();

/// Path of tests/stability/README.md, whose tables a test checks.
std::filesystem::path stability_tables();

/// Creates an empty folder, which is removed when the test program ends.
std::filesystem::path scratch_folder();

}  // namespace kiln::test

/// Skips the test visibly if there is no device; fails in CI, where the environment has CI=true.
#define KILN_REQUIRE_DEVICE()                                         \
  do {                                                                \
    if (kiln::test::device() == nullptr) {                            \
      if (std::getenv("CI") != nullptr) FAIL() << "no OpenCL device"; \
      GTEST_SKIP() << "no OpenCL device";                             \
    }                                                                 \
  } while (false)

/// Skips the test visibly if the shared data is missing; fails in CI.
#define KILN_REQUIRE_DATA(name)                                                 \
  do {                                                                          \
    if (!kiln::test::shared_data(name)) {                                       \
      if (std::getenv("CI") != nullptr) FAIL() << "no shared data: " << (name); \
      GTEST_SKIP() << "no shared data: " << (name);                             \
    }                                                                           \
  } while (false)
