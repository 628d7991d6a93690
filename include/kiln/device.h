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

/// Properties of an OpenCL device that matter to a bake, as reported by its driver.
struct DeviceInfo {
  int index = 0;                           ///< Index in list_devices()
  std::string name = {};                   ///< Device name
  std::string platform = {};               ///< Name of the OpenCL platform
  std::string vendor = {};                 ///< Vendor of the device
  std::string driver = {};                 ///< Version of the driver
  std::string opencl_version = {};         ///< OpenCL version of the device
  bool is_gpu = false;                     ///< True if the type is CL_DEVICE_TYPE_GPU
  std::uint32_t compute_units = 0;         ///< Number of cores, or the driver's equivalent
  std::uint64_t memory_bytes = 0;          ///< Size of the global memory, bytes
  std::uint64_t largest_buffer_bytes = 0;  ///< Largest size of a single buffer, bytes
  /// True if the device supports cl_khr_int64_base_atomics and cl_khr_int64_extended_atomics
  bool has_atomics_64 = false;
  /// True if single-precision division and square root are correctly rounded, which results that are
  /// identical to those of other devices require.
  bool has_correct_division = false;
  /// True if single precision supports denormals, numbers below 2^-126
  bool has_denormals = false;
};

/// All OpenCL devices of all platforms, GPUs first. Empty if there is no platform. Any thread may call it.
///
/// The first call of this or of Device::open() decides where drivers cache compiled kernels, which they load as code.
/// The folder is POCL_CACHE_DIR, XDG_CACHE_HOME or ~/.cache if no other user may write to it; else a private folder in
/// TMPDIR or /tmp, announced to PoCL by setting POCL_CACHE_DIR in the environment of the process. No other thread may
/// read or change the environment meanwhile. Source::warnings() reports problems of the folder (`kernel-folder`).
/// \throws Error(device), id `kernel-folder`, if that folder belongs to another user
std::vector<DeviceInfo> list_devices();

/// An open OpenCL device: context, queue and compiled programs. Copies share these and are cheap.
///
/// Thread safety: any number of threads may use one Device, or copies of it, at the same time. They
/// share one queue, so the device runs their work in the order of submission, in parallel to work
/// on the host. Devices that are opened separately share nothing of Kiln's; on PoCL they share its
/// worker threads and compiler, which exist once per process. Lifetimes: objects made with a Device
/// (Source, Scene, sessions) hold a reference, so the Device may be destroyed before them. The last
/// copy's destructor waits for compilations that cancelled work started, since drivers cannot abort
/// them (PoCL: up to about a second per program).
class Device {
 public:
  /// Opens a device.
  /// \param selector  index in list_devices(), or part of a name (case ignored); empty: the
  ///                  environment's KILN_DEVICE, else the first GPU, else the first CPU
  /// \throws Error(device) which lists the available devices, or how to install one; `self-test` if the device
  ///         computes wrong results, which the message names. The test runs once per driver version.
  /// Thread safety: may be called from several threads. `selector` is not kept.
  static Device open(std::string_view selector = {});

  /// Properties of the device. Valid as long as any copy of this Device.
  const DeviceInfo& info() const;

  /// Seconds spent building kernels so far (short if the driver has them cached).
  double compile_seconds() const;

 private:
  friend DeviceAccess;  // internal access
  explicit Device(std::shared_ptr<ocl::Context> context);
  std::shared_ptr<ocl::Context> context_;
};

}  // namespace kiln
