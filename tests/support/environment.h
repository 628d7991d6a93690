// The OpenCL device that tests share.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "kiln/device.h"

namespace kiln::test {

/// The device under test (KILN_DEVICE, else the first). Opened once, released before main returns: a
/// static destructor that released it would run after the OpenCL library's own.
/// Null where there is no device.
const Device* device();

/// A file of the shared data folder, or nothing where it is absent.
std::optional<std::filesystem::path> shared_data(const std::string& name);

/// A file or folder of tests/data.
std::filesystem::path test_data(const std::string& name);

/// The kiln command that was built, or that the variable KILN_COMMAND names; empty where there is none.
std::string kiln_command();

/// tests/faults/shim.cpp as a library to load before a program; empty where it was not built.
std::string fault_library();

/// tests/stability/README.md, whose tables a test checks.
std::filesystem::path stability_tables();

/// A fresh empty folder, removed when the test program ends.
std::filesystem::path scratch_folder();

}  // namespace kiln::test

/// Skips visibly without a device; fails in CI (where the environment says CI=true).
#define KILN_REQUIRE_DEVICE()                                         \
  do {                                                                \
    if (kiln::test::device() == nullptr) {                            \
      if (std::getenv("CI") != nullptr) FAIL() << "no OpenCL device"; \
      GTEST_SKIP() << "no OpenCL device";                             \
    }                                                                 \
  } while (false)

/// Skips visibly without the shared data; fails in CI.
#define KILN_REQUIRE_DATA(name)                                                 \
  do {                                                                          \
    if (!kiln::test::shared_data(name)) {                                       \
      if (std::getenv("CI") != nullptr) FAIL() << "no shared data: " << (name); \
      GTEST_SKIP() << "no shared data: " << (name);                             \
    }                                                                           \
  } while (false)
