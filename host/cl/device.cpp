#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <mutex>

#include "base/file.h"
#include "base/lower_case.h"
#include "base/memory.h"
#include "base/option.h"
#include "base/process.h"
#include "cl/context.h"
#include "cl/describe.h"
#include "cl/device_order.h"
#include "cl/driver.h"
#include "cl/driver_state.h"
#include "cl/kernel_folder.h"
#include "cl/tuning.h"
#include "kiln/version.h"

namespace kiln {
namespace {

#ifdef _WIN32
constexpr bool kHasDelayedLoading = true;
constexpr const char* kHowToInstall =
    "OpenCL comes with the driver of your GPU: install that of its vendor (AMD, Intel, NVIDIA). "
    "A machine without a GPU can have Intel's CPU Runtime for OpenCL.";
#else
constexpr bool kHasDelayedLoading = false;
constexpr const char* kHowToInstall =
    "Install one with 'apt install pocl-opencl-icd' or, for Python, with 'pip install kiln[cpu]' "
    "(any CPU), or your GPU vendor's OpenCL driver. If one is installed, it may have no "
    "writable folder for its kernels: set HOME or POCL_CACHE_DIR to one that can be written.";
#endif

struct FoundDevice {
  cl_platform_id platform = nullptr;
  cl_device_id device = nullptr;
  DeviceInfo info;
  DeviceRank rank;
};

std::string device_text(cl_device_id device, cl_device_info what) {
  std::size_t size = 0;
  if (clGetDeviceInfo(device, what, 0, nullptr, &size) != CL_SUCCESS || size == 0) return {};
  std::string text(size, '\0');
  clGetDeviceInfo(device, what, size, text.data(), nullptr);
  while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
  return text;
}

template <typename T>
T device_value(cl_device_id device, cl_device_info what) {
  T value{};
  clGetDeviceInfo(device, what, sizeof(T), &value, nullptr);
  return value;
}

std::string platform_name(cl_platform_id platform) {
  std::size_t size = 0;
  if (clGetPlatformInfo(platform, CL_PLATFORM_NAME, 0, nullptr, &size) != CL_SUCCESS) return {};
  std::string text(size, '\0');
  clGetPlatformInfo(platform, CL_PLATFORM_NAME, size, text.data(), nullptr);
  while (!text.empty() && text.back() == '\0') text.pop_back();
  return text;
}

DeviceInfo describe(cl_platform_id platform, cl_device_id device) {
  DeviceInfo info;
  info.name = device_text(device, CL_DEVICE_NAME);
  info.platform = platform_name(platform);
  info.vendor = device_text(device, CL_DEVICE_VENDOR);
  info.driver = device_text(device, CL_DRIVER_VERSION);
  info.opencl_version = device_text(device, CL_DEVICE_VERSION);
  info.is_gpu = (device_value<cl_device_type>(device, CL_DEVICE_TYPE) & CL_DEVICE_TYPE_GPU) != 0;
  info.compute_units = device_value<cl_uint>(device, CL_DEVICE_MAX_COMPUTE_UNITS);
  info.memory_bytes = device_value<cl_ulong>(device, CL_DEVICE_GLOBAL_MEM_SIZE);
  info.largest_buffer_bytes = device_value<cl_ulong>(device, CL_DEVICE_MAX_MEM_ALLOC_SIZE);
  std::string extension_list(" ");
  extension_list.append(device_text(device, CL_DEVICE_EXTENSIONS)).append(" ");
  const auto has = [&](const char* name) { return extension_list.find(name) != std::string::npos; };
  info.has_atomics_64 =
      has(" cl_khr_int64_base_atomics ") && has(" cl_khr_int64_extended_atomics ");
  const auto single = device_value<cl_device_fp_config>(device, CL_DEVICE_SINGLE_FP_CONFIG);
  info.has_correct_division = (single & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) != 0;
  info.has_denormals = (single & CL_FP_DENORM) != 0;
  return info;
}

// Type of clGetPlatformIDs and clIcdGetPlatformIDsKHR; the loader calls the latter in each driver.
using PlatformsCall = cl_int(CL_API_CALL*)(cl_uint, cl_platform_id*, cl_uint*);

/// Returns the function that lists the platforms of the driver named by KILN_OPENCL_DRIVER, which loaders do
/// not list; null if there is none.
/// \param reason [out] why the driver cannot be used; empty if the variable is not set
PlatformsCall driver_of_variable(std::string& reason) {
  const char* path = std::getenv("KILN_OPENCL_DRIVER");
  if (path == nullptr || *path == '\0') return nullptr;
  reason = "KILN_OPENCL_DRIVER";
  std::string library_error;
  void* const library = os::load_library(path, library_error);
  if (library == nullptr) {
    reason += ": " + library_error;
    return nullptr;
  }
  using GetFunction = void*(CL_API_CALL*)(const char*);
  const auto get_function = reinterpret_cast<GetFunction>(
      os::find_library_function(library, "clGetExtensionFunctionAddress"));
  if (get_function != nullptr) {
    reason += ": '" + std::string(path) + "' gives no device";
    return reinterpret_cast<PlatformsCall>(get_function("clIcdGetPlatformIDsKHR"));
  }
  reason += ": '" + std::string(path) + "' is no OpenCL driver";
  return nullptr;
}

std::vector<FoundDevice> query_devices(PlatformsCall get_platforms) {
  cl_uint platform_count = 0;
  if (get_platforms == nullptr || get_platforms(0, nullptr, &platform_count) != CL_SUCCESS) {
    return {};
  }
  std::vector<cl_platform_id> platforms(platform_count);
  if (platform_count == 0 ||
      get_platforms(platform_count, platforms.data(), nullptr) != CL_SUCCESS) {
    return {};
  }
  std::vector<FoundDevice> found_devices;
  for (cl_platform_id platform : platforms) {
    cl_uint count = 0;
    if (clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 0, nullptr, &count) != CL_SUCCESS) continue;
    std::vector<cl_device_id> devices(count);
    if (count == 0 || clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, count, devices.data(),
                                     nullptr) != CL_SUCCESS) {
      continue;
    }
    for (cl_device_id device : devices) {
      if (device_value<cl_bool>(device, CL_DEVICE_AVAILABLE) == CL_FALSE ||
          device_value<cl_bool>(device, CL_DEVICE_COMPILER_AVAILABLE) == CL_FALSE) {
        continue;
      }
      const DeviceInfo info = describe(platform, device);
      const bool is_integrated =
          device_value<cl_bool>(device, CL_DEVICE_HOST_UNIFIED_MEMORY) != CL_FALSE;
      found_devices.push_back(
          {platform,
           device,
           info,
           {info.is_gpu, is_integrated, info.memory_bytes, info.compute_units}});
    }
  }
  std::stable_sort(
      found_devices.begin(), found_devices.end(),
      [](const FoundDevice& a, const FoundDevice& b) { return is_preferred(a.rank, b.rank); });
  for (std::size_t i = 0; i < found_devices.size(); ++i)
    found_devices[i].info.index = static_cast<int>(i);
  return found_devices;
}

/// \param reason  why KILN_OPENCL_DRIVER provides no device; empty if it was not used
std::vector<FoundDevice> find_devices(std::string& reason) {
  // A lower bound of the memory of a driver: PoCL's needs 68 MiB
  constexpr std::uint64_t kDriverBytes = std::uint64_t{60} << 20;
  require_memory("Loading OpenCL drivers", kDriverBytes);
  cl::kernel_folder();  // This is set before the first call of OpenCL, since PoCL reads the environment only once
  // PoCL compiles a kernel again for each work-group size, and for small and large grids, so maps of another size would
  // not find their kernels in its cache. Kernels that call one function per item (kernels/lib/call.clh) do not benefit
  // from that.
  constexpr const char* kSpecializeVariable = "POCL_WORK_GROUP_SPECIALIZATION";
  if (std::getenv(kSpecializeVariable) == nullptr)
    os::set_environment_variable(kSpecializeVariable, "0");
  std::vector<FoundDevice> found_devices;
  // With delayed loading, the first call of OpenCL loads its library, and would end the process if there is none.
  std::string load_error;
  const bool has_loader =
      !kHasDelayedLoading || os::load_library("OpenCL.dll", load_error) != nullptr;
  cl::driver([&] {
    if (has_loader) found_devices = query_devices(clGetPlatformIDs);
    // The query is repeated, since a driver that failed to start before, such as PoCL without a writable folder, may
    // succeed now.
    if (has_loader && found_devices.empty()) found_devices = query_devices(clGetPlatformIDs);
    if (found_devices.empty()) found_devices = query_devices(driver_of_variable(reason));
    return CL_SUCCESS;
  });
  return found_devices;
}

const FoundDevice* select_device(const std::vector<FoundDevice>& found_devices,
                                 std::string_view selector) {
  if (selector.empty()) {
    const auto safe_device =
        std::find_if(found_devices.begin(), found_devices.end(),
                     [](const FoundDevice& f) { return !may_deadlock(f.info); });
    return safe_device != found_devices.end() ? &*safe_device : found_devices.data();
  }
  if (std::all_of(selector.begin(), selector.end(),
                  [](unsigned char c) { return std::isdigit(c); })) {
    const std::size_t index =
        selector.size() < 6 ? std::stoul(std::string(selector)) : found_devices.size();
    return index < found_devices.size() ? &found_devices[index] : nullptr;
  }
  const std::string wanted_name = lower_case(selector);
  for (const FoundDevice& candidate : found_devices) {
    const std::string text = lower_case(candidate.info.name + " " + candidate.info.platform);
    if (text.find(wanted_name) != std::string::npos) return &candidate;
  }
  return nullptr;
}

}  // namespace

DeviceInfo describe_device(cl_platform_id platform, cl_device_id device) {
  return describe(platform, device);
}

Device checked_device(std::shared_ptr<cl::Context> context) {
  try {
    context->require_correct_results();
  } catch (const Error&) {
    // Never freed: PoCL 3.0, which computes wrong results, aborts when a context is released, which would
    // hide the message.
    static auto* const refused = new std::vector<std::shared_ptr<cl::Context>>();
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    refused->push_back(std::move(context));
    throw;
  }
  return DeviceAccess::make(std::move(context));
}

#define KILN_TEXT(number) #number
#define KILN_DOTTED(major, minor, patch) KILN_TEXT(major) "." KILN_TEXT(minor) "." KILN_TEXT(patch)

const char* version() noexcept {
  return KILN_DOTTED(KILN_VERSION_MAJOR, KILN_VERSION_MINOR, KILN_VERSION_PATCH);
}

std::vector<Warning> kernel_folder_warnings() {
  std::vector<Warning> warnings = cl::kernel_folder().warnings;
  for (Warning& warning : cl::tuning_warnings()) warnings.push_back(std::move(warning));
  return warnings;
}

bool may_deadlock(const DeviceInfo& info) {
  return is_pocl(info) && info.name.starts_with("basic");
}

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> result;
  std::string reason;
  for (FoundDevice& entry : find_devices(reason)) result.push_back(std::move(entry.info));
  return result;
}

Device Device::open(std::string_view selector) {
  std::string reason;
  const std::vector<FoundDevice> found_devices = find_devices(reason);
  if (found_devices.empty()) {
    if (!reason.empty()) reason += ". ";
    throw Error(ErrorCode::device, "No OpenCL device was found. " + reason + kHowToInstall);
  }
  Message origin = option("device");
  if (selector.empty()) {
    if (const char* environment = std::getenv("KILN_DEVICE")) {
      selector = environment;
      origin = "KILN_DEVICE";
    }
  }
  const FoundDevice* chosen = select_device(found_devices, selector);
  if (chosen == nullptr) {
    Message message = "No OpenCL device matches " + origin + " '" + std::string(selector) +
                      "'. Use an index or part of a name:";
    for (const FoundDevice& entry : found_devices) {
      message += "\n  " + std::to_string(entry.info.index) + "  " + entry.info.name + " (" +
                 entry.info.platform + ")";
    }
    throw Error(ErrorCode::device, message);
  }
  return checked_device(
      std::make_shared<cl::Context>(chosen->platform, chosen->device, chosen->info));
}

std::string describe_device_choice() {
  if (std::getenv("KILN_DEVICE") != nullptr) return {};
  std::string reason;
  const std::vector<FoundDevice> found_devices = find_devices(reason);
  const FoundDevice* const chosen = select_device(found_devices, {});
  if (found_devices.size() < 2 || chosen != found_devices.data()) return {};
  std::vector<DeviceRank> device_ranks;
  for (const FoundDevice& entry : found_devices) device_ranks.push_back(entry.rank);
  return "device: " + chosen->info.name + ", " + explain_preference(device_ranks) + " (of " +
         std::to_string(found_devices.size()) + " devices)";
}

Device::Device(std::shared_ptr<cl::Context> context) : context_(std::move(context)) {}

const DeviceInfo& Device::info() const { return context_->info(); }

double Device::compile_seconds() const { return context_->build_seconds(); }

}  // namespace kiln
