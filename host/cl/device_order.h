// The order of the devices of a machine: the first one is taken where nobody names one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kiln {

/// What decides between devices.
struct DeviceRank {
  bool is_gpu = false;
  bool is_integrated = false;  ///< It shares the host's memory (CL_DEVICE_HOST_UNIFIED_MEMORY)
  std::uint64_t memory_bytes = 0;
  std::uint32_t compute_units = 0;
};

/// True if `a` is preferred to `b`: GPUs before other devices, discrete GPUs before integrated ones, then the larger
/// memory, then the greater number of compute units. Equal devices keep the loader's order. Compute units come last,
/// since vendors count different things as one.
bool is_preferred(const DeviceRank& a, const DeviceRank& b);

/// Why the first of several devices in that order is taken, as in "the discrete GPU", "the discrete GPU with the most
/// memory", "the only GPU" or "no GPU was found". \param ranks  at least one, in order
std::string explain_preference(const std::vector<DeviceRank>& ranks);

/// "device: NAME, PREFERENCE of N devices" for the device that Device::open() takes without a selector; empty where there
/// is one device, or the environment's KILN_DEVICE names one.
std::string describe_device_choice();

}  // namespace kiln
