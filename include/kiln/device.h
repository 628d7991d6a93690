#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

namespace ocl {
class Context;
}

/// What an OpenCL device says of itself, as far as it matters to a bake.
struct DeviceInfo {
  int index = 0;                           ///< Position in list_devices()
  std::string name;                        ///< As the driver gives it
  std::string platform;                    ///< Name of the OpenCL platform
  std::string vendor;                      ///< Of the device
  std::string driver;                      ///< Driver's version
  std::string opencl_version;              ///< Of the device, as it says
  bool is_gpu = false;                     ///< Its type is CL_DEVICE_TYPE_GPU
  std::uint32_t compute_units = 0;         ///< Cores, or what the driver counts as one
  std::uint64_t memory_bytes = 0;          ///< Global memory
  std::uint64_t largest_buffer_bytes = 0;  ///< The most that one buffer may hold
  bool has_atomics_64 = false;             ///< cl_khr_int64_base_atomics and extended
  bool has_correct_division = false;  ///< Correctly rounded single-precision division and root:
                                      ///< needed for the same bytes as on other devices.
  bool has_denormals = false;         ///< Single precision keeps numbers below 2^-126
};

/// All OpenCL devices of all platforms, GPUs first. Empty where there is no platform.
std::vector<DeviceInfo> list_devices();

/// An open OpenCL device: context, queue and the programs built so far. Cheap to copy (shared).
/// One Device may be used by one thread at a time.
class Device {
 public:
  /// Opens a device.
  /// \param selector  index in list_devices(), or part of a name (case ignored); empty: the
  ///                  environment's KILN_DEVICE, else the first GPU, else the first CPU
  /// \throws Error(device) with the devices there are, or how to install one.
  static Device open(std::string_view selector = {});

  /// What the device says of itself.
  const DeviceInfo& info() const;

  /// Seconds spent building kernels so far (little where the driver has them cached).
  double compile_seconds() const;

  /// \cond Used by the library's own parts and by kiln/opencl.h.
  explicit Device(std::shared_ptr<ocl::Context> context);
  ocl::Context& context() const { return *context_; }
  /// \endcond

 private:
  std::shared_ptr<ocl::Context> context_;
};

}  // namespace kiln
