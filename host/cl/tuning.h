// Choices that change the speed of a device, but no result, and the file of them per device.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/device.h"

namespace kiln::ocl {

/// Measured by `kiln devices --tune`; the defaults apply to devices that were not measured.
struct Tuning {
  static constexpr std::uint64_t kNever = ~std::uint64_t{0};
  static constexpr std::uint32_t kMaxGroup = 1024;

  /// Minimum number of triangles of a BVH that the device builds; kNever: the host builds all
  std::uint64_t min_device_build_triangles = kNever;
  /// Work-group sizes of the kernels of rays, nearest points, any-hit rays, depth views (on GPUs), and their match:
  /// powers of two up to kMaxGroup, which CPUs limit to 64. 0: the default
  std::uint32_t ray_group = 0;
  std::uint32_t closest_group = 0;
  std::uint32_t occlusion_group = 0;
  std::uint32_t raster_group = 0;
  std::uint32_t view_group = 0;

  friend bool operator==(const Tuning&, const Tuning&) = default;
};

/// The file of a device: lines `KEY VALUE` in the folder `tuning` within KernelFolder::kiln. Its name is a hash of the
/// device's name, platform and driver.
std::filesystem::path tuning_file(const DeviceInfo& device);

/// The text of a device's file: the device's name, platform and driver, Kiln's version, and the tuning.
std::string format_tuning(const DeviceInfo& device, const Tuning& tuning);

/// Parses such a text.
/// \param problem [out] why the defaults are returned instead, as the end of a sentence; empty if the text is valid, or
/// that of another version of Kiln
Tuning parse_tuning(std::string_view text, const DeviceInfo& device, std::string& problem);

/// Reads the tuning of a device from its file. Without a file, or if the file is invalid or that of another version,
/// returns the defaults. An invalid file adds to tuning_warnings(). KILN_BVH_BUILDER in the environment, `host` or
/// `device`, overrides who builds BVHs.
Tuning load_tuning(const DeviceInfo& device);

/// Writes a device's file, atomically. \throws Error(output) if it cannot be written
void store_tuning(const DeviceInfo& device, const Tuning& tuning);

/// Warnings (`tuning`) about the files that this process has ignored, one for each.
std::vector<Warning> tuning_warnings();

}  // namespace kiln::ocl
