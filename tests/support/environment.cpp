#include "support/environment.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "cl/context.h"
#include "cl/program.h"
#include "cl/tuning.h"

namespace kiln::test {
namespace {

std::unique_ptr<Device> shared_device;
std::filesystem::path scratch_root;
int scratch_counter = 0;

class Environment : public testing::Environment {
 public:
  void TearDown() override {
    if (shared_device && shared_device->info().platform == "Portable Computing Language") {
      EXPECT_EQ(ocl::whole_header_builds(), 0U) << "a program needs what kernels/cl/builtins.cl "
                                                   "does not declare: see the driver's output";
    }
    shared_device.reset();
    std::error_code ignored;
    if (!scratch_root.empty()) std::filesystem::remove_all(scratch_root, ignored);
  }
};

[[maybe_unused]] const testing::Environment* const registered =
    testing::AddGlobalTestEnvironment(new Environment);

}  // namespace

const Device* device() {
  if (!shared_device) {
    try {
      shared_device = std::make_unique<Device>(Device::open());
      // Tests do not depend on what this machine was tuned to.
      if (std::getenv("KILN_BVH_BUILDER") == nullptr) context_of(*shared_device).set_tuning({});
    } catch (const Error& error) {
      std::fprintf(stderr, "%s\n", error.what());
    }
  }
  return shared_device.get();
}

std::optional<std::filesystem::path> shared_data(const std::string& name) {
  const char* folder = std::getenv("KILN_SHARED_DATA");
  std::filesystem::path path = std::filesystem::path(folder ? folder : KILN_SHARED_DATA) / name;
  if (!std::filesystem::exists(path)) return std::nullopt;
  return path;
}

std::filesystem::path test_data(const std::string& name) {
  return std::filesystem::path(KILN_TEST_DATA) / name;
}

std::string kiln_command() {
  const char* const other = std::getenv("KILN_COMMAND");
  return other != nullptr ? other : KILN_COMMAND;
}

std::string fault_library() { return KILN_FAULT_LIBRARY; }

std::filesystem::path stability_tables() { return KILN_STABILITY_TABLES; }

std::filesystem::path scratch_folder() {
  if (scratch_root.empty()) {
    scratch_root = std::filesystem::temp_directory_path() /
                   ("kiln-test-" + std::to_string(static_cast<long>(getpid())));
  }
  std::filesystem::path folder = scratch_root / std::to_string(scratch_counter++);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace kiln::test
