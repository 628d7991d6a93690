// The order of the devices of a machine: Device::open() selects the first one by default.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kiln {

/// Properties of a device that determine its position in the order.
struct DeviceRank {
  bool is_gpu = false;
  /// The device shares the host's memory (CL_DEVICE_HOST_UNIFIED_MEMORY)
  bool is_integrated = false;
  std::uint64_t memory_bytes = 0;
  std::uint32_t compute_units = 0;
};

/// True if `a` is preferred to `b`: GPUs before other devices, discrete GPUs before integrated ones, then the larger
/// memory, then the greater number of compute units. Equal devices keep the loader's order. Compute units come last,
/// since vendors define them differently.
bool is_preferred(const DeviceRank& a, const DeviceRank& b);

/// Explains why the first of several devices in that order is preferred, as in "the discrete GPU", "the discrete GPU
/// with the most memory", "the only GPU" or "no GPU was found". \param ranks at least one, in order
std::string explain_preference(const std::vector<DeviceRank>& ranks);

/// "device: NAME, PREFERENCE of N devices" for the device that Device::open() selects by default; empty if there is
/// one device, or KILN_DEVICE in the environment selects one.
std::string describe_device_choice();

}  // namespace kiln
