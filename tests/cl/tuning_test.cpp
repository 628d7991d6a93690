// The file of a device's tuning: read back whole, or ignored with a reason, and never in the way.
#include "cl/tuning.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "cl/context.h"
#include "kiln/version.h"
#include "support/environment.h"
#include "support/process.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;
using cl::Tuning;

DeviceInfo info_of(const std::string& name) {
  DeviceInfo info;
  info.name = name;
  info.platform = "A platform";
  info.driver = "1.2";
  return info;
}

const Tuning kUnusual{.min_device_build_triangles = 12345,
                      .ray_group = 1,
                      .closest_group = 1024,
                      .occlusion_group = 0,
                      .raster_group = 2,
                      .view_group = 128};

std::string replace(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

TEST(Tuning, IsReadAsWritten) {
  for (const char* name :
       {"A device", "Quotes \" and \\ and \ttabs \x01 and\nlines", "\xC3\xA4\xE2\x82\xAC"}) {
    for (const Tuning& tuning : {kUnusual, Tuning{}, Tuning{.min_device_build_triangles = 0}}) {
      std::string problem;
      const std::string text = cl::format_tuning(info_of(name), tuning);
      EXPECT_EQ(cl::parse_tuning(text, info_of(name), problem), tuning) << text;
      EXPECT_EQ(problem, "") << text;
    }
  }
}

/// Every text cut short, and other values: the defaults, with a reason.
TEST(Tuning, InvalidTextsAreIgnoredWithAReason) {
  const DeviceInfo info = info_of("A device");
  const std::string text = cl::format_tuning(info, kUnusual);
  const auto expect_ignored = [&](const std::string& changed, const std::string& reason) {
    std::string problem;
    EXPECT_EQ(cl::parse_tuning(changed, info, problem), Tuning{}) << changed;
    EXPECT_NE(problem.find(reason), std::string::npos) << problem << "\n" << changed;
  };
  // Cut short, a text ends within a line, or lacks a key.
  for (std::size_t length = 0; length < text.size(); ++length) {
    const bool is_whole_line = length == 0 || text[length - 1] == '\n';
    expect_ignored(text.substr(0, length), is_whole_line ? "" : "not those that Kiln writes");
  }
  expect_ignored("", "names no device");
  expect_ignored(text + "}", "not those that Kiln writes");
  expect_ignored(text + "none\n", "not those that Kiln writes");
  expect_ignored(text + "ray_group 1\n", "not those that Kiln writes");
  for (const char* triangles : {"-1", "1.5", "99999999999999999999", "many", "", "12345 "})
    expect_ignored(replace(text, "12345", triangles), "min_device_build_triangles must be");
  expect_ignored(replace(text, "min_device", "max_device"), "min_device_build_triangles must be");
  for (const char* size : {"0", "3", "2048", "4294967297", "64x", ""})
    expect_ignored(replace(text, "1024", size), "closest_group must be a power of two up to 1024");
  expect_ignored(replace(text, "view_group", "views_group"), "view_group must be");
  expect_ignored(replace(text, "A device", "B device"), "that of 'B device', not of 'A device'");
  expect_ignored(replace(text, "A platform", "B platform"), "not of 'A device'");
}

TEST(Tuning, OtherVersionsAreIgnoredSilently) {
  const DeviceInfo info = info_of("A device");
  const std::string text = cl::format_tuning(info, kUnusual);
  for (const std::string& other :
       {replace(text, version(), "0.0.1"), replace(text, "driver 1.2", "driver 1.3")}) {
    std::string problem;
    EXPECT_EQ(cl::parse_tuning(other, info, problem), Tuning{}) << other;
    EXPECT_EQ(problem, "");
  }
}

TEST(Tuning, FilesDifferByDevicePlatformAndDriver) {
  const fs::path file = cl::tuning_file(info_of("A device"));
  EXPECT_EQ(file, cl::tuning_file(info_of("A device")));
  EXPECT_NE(file, cl::tuning_file(info_of("B device")));
  DeviceInfo other = info_of("A device");
  other.driver = "1.3";
  EXPECT_NE(file, cl::tuning_file(other));
  other = info_of("A device");
  other.platform = "B platform";
  EXPECT_NE(file, cl::tuning_file(other));
}

/// Removes a device's file at the end of a test.
struct FileOf {
  fs::path path;
  explicit FileOf(const DeviceInfo& info) : path(cl::tuning_file(info)) {}
  ~FileOf() { fs::remove_all(path); }
  FileOf(const FileOf&) = delete;
  FileOf& operator=(const FileOf&) = delete;
};

std::size_t count_warnings(const std::string& about) {
  std::size_t count = 0;
  for (const Warning& warning : cl::tuning_warnings()) {
    EXPECT_EQ(warning.code, "tuning");
    if (warning.message.text().find(about) != std::string::npos) ++count;
  }
  return count;
}

TEST(Tuning, IsStoredAndLoadedByDevice) {
  const DeviceInfo info = info_of("A device that no machine has");
  const FileOf file(info);
  EXPECT_EQ(cl::load_tuning(info), Tuning{});
  EXPECT_EQ(count_warnings(file.path.string()), 0U) << "no file is no problem";
  cl::store_tuning(info, kUnusual);
  EXPECT_EQ(cl::load_tuning(info), kUnusual);
  cl::store_tuning(info, Tuning{});
  EXPECT_EQ(cl::load_tuning(info), Tuning{});
  struct stat status {};
  ASSERT_EQ(stat(file.path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  EXPECT_EQ(count_warnings(file.path.string()), 0U);
  // A corrupt file: one warning, however often it is read.
  std::ofstream(file.path) << "nonsense";
  EXPECT_EQ(cl::load_tuning(info), Tuning{});
  EXPECT_EQ(cl::load_tuning(info), Tuning{});
  EXPECT_EQ(count_warnings(file.path.string()), 1U);
  // Others could have written it.
  cl::store_tuning(info, kUnusual);
  ASSERT_EQ(chmod(file.path.c_str(), 0666), 0);
  EXPECT_EQ(cl::load_tuning(info), Tuning{});
  EXPECT_EQ(count_warnings("other users may write"), 1U);
  fs::remove(file.path);
  fs::create_directory(file.path);
  EXPECT_EQ(cl::load_tuning(info), Tuning{});
  EXPECT_EQ(count_warnings("it is no file"), 1U);
  EXPECT_THROW(cl::store_tuning(info, kUnusual), Error);
  fs::remove(file.path);
  std::ofstream(file.path) << std::string(100000, ' ');
  EXPECT_EQ(cl::load_tuning(info), Tuning{});
  EXPECT_EQ(count_warnings("too large"), 1U);
}

TEST(Tuning, TheEnvironmentOverridesTheBuilder) {
  const DeviceInfo info = info_of("Another device that no machine has");
  const FileOf file(info);
  cl::store_tuning(info, kUnusual);
  const auto loaded_with = [&](const char* builder) {
    setenv("KILN_BVH_BUILDER", builder, 1);
    const Tuning tuning = cl::load_tuning(info);
    unsetenv("KILN_BVH_BUILDER");
    return tuning;
  };
  Tuning expected = kUnusual;
  expected.min_device_build_triangles = 0;
  EXPECT_EQ(loaded_with("device"), expected);
  expected.min_device_build_triangles = Tuning::kNever;
  EXPECT_EQ(loaded_with("host"), expected);
}

/// A device that is opened uses its file; its group sizes are limited to what a kernel can run with.
TEST(Tuning, AnOpenedDeviceHasItsTuning) {
  KILN_REQUIRE_DEVICE();
  const DeviceInfo& info = test::device()->info();
  const fs::path path = cl::tuning_file(info);
  std::string before;
  if (std::ifstream in(path); in) before.assign(std::istreambuf_iterator<char>(in), {});
  cl::store_tuning(info, kUnusual);
  const Device device = Device::open(std::to_string(info.index));
  fs::remove(path);
  if (!before.empty()) std::ofstream(path) << before;
  cl::Context& context = context_of(device);
  EXPECT_EQ(context.tuning(), kUnusual);
  const cl::Kernel kernel = context.kernel("bvh", "kiln_bvh_scan_up");
  EXPECT_EQ(context.group_size(kernel, 0, 48), 48U);
  EXPECT_EQ(context.group_size(kernel, 16, 48), 16U);
  const std::size_t largest = context.group_size(kernel, 1U << 31, 48);
  EXPECT_GE(largest, 1U);
  EXPECT_LE(largest, info.is_gpu ? 1U << 30 : 64U);
}

TEST(Tuning, AnUnknownBuilderIsRefused) {
  const test::ProcessResult result =
      test::run_kiln({"devices"}, {.environment = {{"KILN_BVH_BUILDER", "gpu"}}});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.errors.find("KILN_BVH_BUILDER is 'gpu': set it to 'host' or 'device'"),
            std::string::npos)
      << result.errors;
}

}  // namespace
}  // namespace kiln
