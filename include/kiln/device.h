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
class KILN_OPAQUE Context;
}
struct KILN_OPAQUE DeviceAccess;

/// Properties of an OpenCL device that matter to a bake, as its driver gives them.
struct DeviceInfo {
  int index = 0;                           ///< Position in list_devices()
  std::string name = {};                   ///< As the driver gives it
  std::string platform = {};               ///< Name of the OpenCL platform
  std::string vendor = {};                 ///< Vendor of the device
  std::string driver = {};                 ///< Driver's version
  std::string opencl_version = {};         ///< OpenCL version of the device, as its driver gives it
  bool is_gpu = false;                     ///< Its type is CL_DEVICE_TYPE_GPU
  std::uint32_t compute_units = 0;         ///< Cores, or what the driver counts as one
  std::uint64_t memory_bytes = 0;          ///< Global memory
  std::uint64_t largest_buffer_bytes = 0;  ///< The most that one buffer may hold
  bool has_atomics_64 = false;             ///< cl_khr_int64_base_atomics and extended
  bool has_correct_division = false;  ///< Correctly rounded single-precision division and root:
                                      ///< needed for the same bytes as on other devices.
  bool has_denormals = false;         ///< Single precision keeps numbers below 2^-126
};

/// All OpenCL devices of all platforms, GPUs first. Empty where there is no platform. Any thread may call it.
///
/// The first call of this or of Device::open() decides where compiled kernels are kept, which drivers load as code: in
/// POCL_CACHE_DIR, XDG_CACHE_HOME or ~/.cache, where nobody else may write; else in a folder of this user's within
/// TMPDIR or /tmp, which it names to PoCL by setting POCL_CACHE_DIR in the environment of the process. No other thread
/// may read or change the environment meanwhile. What is imperfect about the folder, Source::warnings() says
/// (`kernel-folder`).
/// \throws Error(device), id `kernel-folder`, where that folder is another user's
std::vector<DeviceInfo> list_devices();

/// An open OpenCL device: context, queue and the programs built so far. Cheap to copy (shared).
///
/// Thread safety: any number of threads may use one Device, or copies of it, at the same time.
/// They share its one queue, so the device does their work one after the other, in the order of
/// asking; work on the host goes on beside it. Devices that are opened apart share nothing of
/// Kiln's; on PoCL they share its worker threads and its compiler, of which a process has one
/// each. Lifetimes: what is made of a Device (Source, Scene, sessions) holds it, so it may go
/// before them. The last copy waits, when it goes, for kernels that are being compiled for work
/// that was cancelled: drivers cannot be stopped there (PoCL: up to about a second a program).
class Device {
 public:
  /// Opens a device.
  /// \param selector  index in list_devices(), or part of a name (case ignored); empty: the
  ///                  environment's KILN_DEVICE, else the first GPU, else the first CPU
  /// \throws Error(device) with the devices there are, or how to install one; `self-test` where the device computes
  ///         wrongly, with what was wrong. It is tested once a version of its driver.
  /// Thread safety: may be called from several threads. `selector` is not kept.
  static Device open(std::string_view selector = {});

  /// Properties of the device. Good as long as any copy of this Device.
  const DeviceInfo& info() const;

  /// Seconds spent building kernels so far (little where the driver has them cached).
  double compile_seconds() const;

 private:
  friend DeviceAccess;  // the library's own parts
  explicit Device(std::shared_ptr<ocl::Context> context);
  std::shared_ptr<ocl::Context> context_;
};

}  // namespace kiln
