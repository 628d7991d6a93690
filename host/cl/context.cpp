#include "cl/context.h"

#include <CL/cl_icd.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <thread>

#include "base/memory.h"
#include "base/option.h"
#include "base/parallel.h"
#include "base/progress_guard.h"
#include "cl/binary_cache.h"
#include "cl/driver.h"
#include "cl/kernel_folder.h"
#include "cl/program.h"
#include "cl/tuning.h"
#include "kiln/limits.h"

namespace kiln::ocl {
namespace {

struct StatusName {
  cl_int status;
  const char* name;
};
constexpr StatusName kStatusNames[] = {
    {CL_DEVICE_NOT_FOUND, "CL_DEVICE_NOT_FOUND"},
    {CL_DEVICE_NOT_AVAILABLE, "CL_DEVICE_NOT_AVAILABLE"},
    {CL_COMPILER_NOT_AVAILABLE, "CL_COMPILER_NOT_AVAILABLE"},
    {CL_MEM_OBJECT_ALLOCATION_FAILURE, "CL_MEM_OBJECT_ALLOCATION_FAILURE"},
    {CL_OUT_OF_RESOURCES, "CL_OUT_OF_RESOURCES"},
    {CL_OUT_OF_HOST_MEMORY, "CL_OUT_OF_HOST_MEMORY"},
    {CL_BUILD_PROGRAM_FAILURE, "CL_BUILD_PROGRAM_FAILURE"},
    {CL_INVALID_VALUE, "CL_INVALID_VALUE"},
    {CL_INVALID_CONTEXT, "CL_INVALID_CONTEXT"},
    {CL_INVALID_COMMAND_QUEUE, "CL_INVALID_COMMAND_QUEUE"},
    {CL_INVALID_MEM_OBJECT, "CL_INVALID_MEM_OBJECT"},
    {CL_INVALID_KERNEL_NAME, "CL_INVALID_KERNEL_NAME"},
    {CL_INVALID_KERNEL_ARGS, "CL_INVALID_KERNEL_ARGS"},
    {CL_INVALID_ARG_INDEX, "CL_INVALID_ARG_INDEX"},
    {CL_INVALID_ARG_VALUE, "CL_INVALID_ARG_VALUE"},
    {CL_INVALID_ARG_SIZE, "CL_INVALID_ARG_SIZE"},
    {CL_INVALID_WORK_GROUP_SIZE, "CL_INVALID_WORK_GROUP_SIZE"},
    {CL_INVALID_BUFFER_SIZE, "CL_INVALID_BUFFER_SIZE"},
};

/// Name and version of the platform, which for PoCL include the compiler's version. Empty if the driver does
/// not provide them.
std::string platform_version(cl_device_id device) {
  cl_platform_id platform = nullptr;
  std::size_t size = 0;
  std::string text;
  driver([&] {
    return clGetDeviceInfo(device, CL_DEVICE_PLATFORM, sizeof(void*), &platform, nullptr);
  });
  const auto query = [&](std::size_t room, char* to) {
    return driver(
        [&] { return clGetPlatformInfo(platform, CL_PLATFORM_VERSION, room, to, &size); });
  };
  if (platform == nullptr || query(0, nullptr) != CL_SUCCESS) return {};
  text.resize(size);
  return query(text.size(), text.data()) == CL_SUCCESS ? text : std::string();
}

std::unique_ptr<const BinaryCache> binaries_of(cl_device_id device, const DeviceInfo& info) {
  return std::make_unique<BinaryCache>(
      BinaryCache::of(info, platform_version(device), kernel_folder().kiln));
}

std::string megabytes(std::size_t bytes) {
  return std::to_string((bytes + (1 << 20) - 1) >> 20) + " MiB";
}

}  // namespace

std::string status_name(cl_int status) {
  for (const StatusName& entry : kStatusNames) {
    if (entry.status == status) return entry.name;
  }
  return "OpenCL status " + std::to_string(status);
}

void check(cl_int status, std::string_view what) {
  if (status == CL_SUCCESS) return;
  throw Error(ErrorCode::device, std::string(what) + " failed with " + status_name(status) + ".");
}

Buffer::Buffer(Context& context, std::size_t bytes, const void* data)
    : bytes_(bytes), context_(&context) {
  if (bytes == 0) return;
  const DeviceInfo& info = context.info();
  if (bytes > info.largest_buffer_bytes) {
    throw Error(ErrorCode::device, "A buffer of " + megabytes(bytes) + " is needed, but " +
                                       info.name + " allows at most " +
                                       megabytes(info.largest_buffer_bytes) +
                                       " in one. Use a smaller mesh, or another device.");
  }
  // A CPU device uses the process's memory, so the budget is checked; small buffers skip the check.
  if (!info.is_gpu && bytes > (std::size_t{1} << 20) && !memory_fits(bytes)) {
    throw Error(ErrorCode::internal, "A buffer of the device would take " + megabytes(bytes) +
                                         " of memory, but only " + megabytes(memory_left()) +
                                         " are left of the memory limit. Use smaller inputs or a "
                                         "smaller size, or raise the " +
                                         option("memory_limit") + ".");
  }
  cl_int status = CL_SUCCESS;
  driver([&] {
    // The driver only reads the data that it copies, though the parameter is not const.
    memory_ = clCreateBuffer(context.get(),
                             CL_MEM_READ_WRITE | (data == nullptr ? 0 : CL_MEM_COPY_HOST_PTR),
                             bytes, const_cast<void*>(data), &status);
    return status;
  });
  if (status != CL_SUCCESS) {
    throw Error(ErrorCode::device, "Allocating " + megabytes(bytes) + " on " + info.name +
                                       " failed with " + status_name(status) + "; " +
                                       megabytes(context.device_bytes()) + " are in use.");
  }
  context.account_memory(static_cast<std::int64_t>(bytes));
  if (info.is_gpu || data != nullptr) return;
  is_unwritten_ = true;
  count_unwritten(static_cast<std::int64_t>(bytes));
}

void Buffer::mark_written() const noexcept {
  if (is_unwritten_ && is_unwritten_.exchange(false))
    count_unwritten(-static_cast<std::int64_t>(bytes_));
}

Buffer::~Buffer() {
  if (memory_ == nullptr) return;
  mark_written();
  release([&] { clReleaseMemObject(memory_); });
  context_->account_memory(-static_cast<std::int64_t>(bytes_));
}

Context::Context(cl_platform_id platform, cl_device_id device, DeviceInfo info)
    : info_(std::move(info)),
      tuning_(std::make_unique<Tuning>(load_tuning(info_))),
      binaries_(binaries_of(device, info_)),
      device_(device) {
  const cl_context_properties properties[] = {CL_CONTEXT_PLATFORM,
                                              reinterpret_cast<cl_context_properties>(platform), 0};
  cl_int status = CL_SUCCESS;
  check(
      driver([&] {
        context_ = clCreateContext(properties, 1, &device, nullptr, nullptr, &status);
        if (status == CL_INVALID_PLATFORM) {
          // If ocl-icd lists no platform, as with KILN_OPENCL_DRIVER, it rejects every device. In that case the
          // driver's function is called directly: each object of a driver starts with a pointer to the table of its
          // functions.
          const cl_icd_dispatch& table = **reinterpret_cast<const cl_icd_dispatch**>(device);
          context_ = table.clCreateContext(properties, 1, &device, nullptr, nullptr, &status);
        }
        return status;
      }),
      "Opening " + info_.name);
  record_opened();
  try {
    check(driver([&] {
            queue_ = clCreateCommandQueue(context_, device, 0, &status);
            return status;
          }),
          "Creating a command queue on " + info_.name);
  } catch (...) {
    release([&] { clReleaseContext(context_); });
    throw;
  }
}

Context::Context(cl_context context, cl_device_id device, cl_command_queue queue, DeviceInfo info)
    : info_(std::move(info)),
      tuning_(std::make_unique<Tuning>(load_tuning(info_))),
      binaries_(binaries_of(device, info_)),
      device_(device),
      context_(context),
      queue_(queue) {
  check(driver([&] { return clRetainContext(context_); }), "Sharing a context of " + info_.name);
  record_opened();
  try {
    check(driver([&] { return clRetainCommandQueue(queue_); }),
          "Sharing a command queue of " + info_.name);
  } catch (...) {
    release([&] { clReleaseContext(context_); });
    throw;
  }
}

Context::~Context() {
  // Waits for threads that still compile programs, since they use this context.
  for (const auto& [key, build] : programs_) {
    if (build->thread.joinable()) build->thread.join();
  }
  release([&] { clFinish(queue_); });
  programs_.clear();
  release([&] { clReleaseCommandQueue(queue_); });
  release([&] { clReleaseContext(context_); });
}

void Context::set_tuning(const Tuning& tuning) { *tuning_ = tuning; }

std::size_t Context::group_size(const Kernel& kernel, std::uint32_t tuned,
                                std::size_t default_size) const {
  if (tuned == 0) return default_size;
  std::size_t largest = 0;
  check(driver([&] {
          return clGetKernelWorkGroupInfo(kernel.get(), device_, CL_KERNEL_WORK_GROUP_SIZE,
                                          sizeof largest, &largest, nullptr);
        }),
        "Querying " + kernel.name());
  // PoCL reports 4096 for every kernel, but keeps the private arrays of all work-items of a group on a thread's stack.
  constexpr std::size_t kMaxProcessorGroup = kLocal;
  if (!info_.is_gpu) largest = std::min(largest, kMaxProcessorGroup);
  return std::min<std::size_t>(tuned, std::max<std::size_t>(largest, 1));
}

namespace {
thread_local std::int64_t thread_bytes = 0;
}  // namespace

std::int64_t Context::bytes_of_thread() { return thread_bytes; }

void Context::account_memory(std::int64_t bytes) {
  thread_bytes += bytes;
  const std::uint64_t now = device_bytes_ += static_cast<std::uint64_t>(bytes);
  std::uint64_t peak = peak_device_bytes_;
  while (bytes > 0 && now > peak && !peak_device_bytes_.compare_exchange_weak(peak, now)) {
  }
}

void Context::set_buffer_argument(const Kernel& kernel, cl_uint index, const Buffer& buffer) {
  const cl_mem memory = buffer.get();
  buffer.mark_written();
  set_raw_argument(kernel, index, &memory, sizeof(void*));
}

void Context::set_raw_argument(const Kernel& kernel, cl_uint index, const void* value,
                               std::size_t bytes) {
  const cl_int status = driver([&] { return clSetKernelArg(kernel.get(), index, bytes, value); });
  if (status == CL_SUCCESS) return;
  check(status, "clSetKernelArg " + std::to_string(index) + " of " + kernel.name());
}

void Context::enqueue(const Kernel& kernel, std::size_t count, std::size_t local) {
  ++commands_;
  const std::size_t global = (count + local - 1) / local * local;
  check(driver([&] {
          return clEnqueueNDRangeKernel(queue_, kernel.get(), 1, nullptr, &global, &local, 0,
                                        nullptr, nullptr);
        }),
        "Launching " + kernel.name() + " on " + info_.name);
}

/// Waits for all commands, and polls the progress callback if there is one.
void Context::wait() {
  if (ProgressGuard::is_active()) wait_within(std::chrono::steady_clock::duration::max());
}

bool Context::wait_within(std::chrono::steady_clock::duration timeout) {
  struct Event {
    cl_event event = nullptr;
    ~Event() {
      if (event != nullptr) release([&] { clReleaseEvent(event); });
    }
  } marker;
  const std::string what = "Waiting for " + info_.name;
  check(driver([&] { return clEnqueueMarkerWithWaitList(queue_, 0, nullptr, &marker.event); }),
        what);
  check(driver([&] { return clFlush(queue_); }), what);
  // Each pause between polls is a sixteenth of the time waited so far, so that polling prolongs the wait only slightly.
  const auto start = std::chrono::steady_clock::now();
  for (;;) {
    cl_int status = CL_COMPLETE;
    check(driver([&] {
            return clGetEventInfo(marker.event, CL_EVENT_COMMAND_EXECUTION_STATUS, sizeof status,
                                  &status, nullptr);
          }),
          what);
    if (status <= CL_COMPLETE) return true;
    const auto time_waited = std::chrono::steady_clock::now() - start;
    if (time_waited > timeout) return false;
    std::this_thread::sleep_for(std::clamp<std::chrono::nanoseconds>(
        time_waited / 16, std::chrono::microseconds{10}, std::chrono::microseconds{4000}));
    if (ProgressGuard::is_active()) ProgressGuard::poll();
  }
}

void Context::finish() {
  wait();
  check(driver([&] { return clFinish(queue_); }), "Waiting for " + info_.name);
}

bool Context::finish_within(double seconds) {
  using Clock = std::chrono::steady_clock;
  if (wait_within(
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds))))
    return true;
  record_driver_failure();
  return false;
}

namespace {

// Blocks of a CPU device's buffers of at least this size are copied and filled by all threads, directly in the memory
// that the device shares with the host. Drivers would use one thread, while the others wait.
constexpr std::size_t kMinSharedBytes = std::size_t{1} << 20;
// A multiple of the size of each type
constexpr std::size_t kSharedBytesPerTask = std::size_t{1} << 18;
// Maximum bytes of repeated values that fill_with_copies() copies at once, so that they stay in the first-level cache.
constexpr std::size_t kMaxRepeatedBytes = std::size_t{1} << 13;

bool is_shared(const DeviceInfo& info, std::size_t bytes) {
  return !info.is_gpu && bytes >= kMinSharedBytes;
}

/// Fills memory with copies of a value. The copied block doubles in size with each copy, up to kMaxRepeatedBytes.
void fill_with_copies(const void* value, std::size_t value_bytes, char* to, std::size_t bytes) {
  std::size_t done = std::min(value_bytes, bytes);
  std::memcpy(to, value, done);
  while (done < bytes) {
    const std::size_t more = std::min({done, bytes - done, kMaxRepeatedBytes});
    std::memcpy(to + done, to, more);
    done += more;
  }
}

/// Calls copy(offset, bytes) for the whole range. If there is a progress callback, copies in pieces, and polls progress
/// before each piece.
template <typename Copy>
void copy_in_pieces(std::size_t bytes, const Copy& copy) {
  constexpr std::size_t kBytesPerPiece = std::size_t{1} << 26;
  for (std::size_t at = 0; at < bytes;) {
    const std::size_t piece =
        !ProgressGuard::is_active() ? bytes : std::min(kBytesPerPiece, bytes - at);
    copy(at, piece);
    at += piece;
    if (ProgressGuard::is_active()) ProgressGuard::poll();
  }
}

}  // namespace

void Context::fill_bytes(const Buffer& buffer, const void* value, std::size_t value_bytes,
                         std::size_t bytes) {
  if (is_shared(info_, bytes)) {
    return use_mapped(buffer, CL_MAP_WRITE_INVALIDATE_REGION, 0, bytes, [&](void* data) {
      parallel_for(bytes, kSharedBytesPerTask, [&](std::size_t begin, std::size_t end) {
        fill_with_copies(value, value_bytes, static_cast<char*>(data) + begin, end - begin);
      });
    });
  }
  ++commands_;
  if (bytes == 0) return;
  buffer.mark_written();
  check(driver([&] {
          return clEnqueueFillBuffer(queue_, buffer.get(), value, value_bytes, 0, bytes, 0, nullptr,
                                     nullptr);
        }),
        "clEnqueueFillBuffer");
}

// A blocking copy waits for all earlier commands, which may include compiling.
void Context::write_bytes(const Buffer& buffer, std::size_t offset, const void* data,
                          std::size_t bytes) {
  ++commands_;
  wait();
  buffer.mark_written();
  copy_in_pieces(bytes, [&](std::size_t at, std::size_t piece) {
    check(driver([&] {
            return clEnqueueWriteBuffer(queue_, buffer.get(), CL_TRUE, offset + at, piece,
                                        static_cast<const char*>(data) + at, 0, nullptr, nullptr);
          }),
          "clEnqueueWriteBuffer");
  });
}

void* Context::map_bytes(const Buffer& buffer, cl_map_flags flags, std::size_t offset,
                         std::size_t bytes) {
  ++commands_;
  wait();
  if (flags != CL_MAP_READ) buffer.mark_written();
  cl_int status = CL_SUCCESS;
  void* data = nullptr;
  check(driver([&] {
          data = clEnqueueMapBuffer(queue_, buffer.get(), CL_TRUE, flags, offset, bytes, 0, nullptr,
                                    nullptr, &status);
          return status;
        }),
        "clEnqueueMapBuffer");
  return data;
}

void Context::unmap(const Buffer& buffer, void* data) {
  check(driver([&] {
          return clEnqueueUnmapMemObject(queue_, buffer.get(), data, 0, nullptr, nullptr);
        }),
        "clEnqueueUnmapMemObject");
}

void Context::read_bytes(const Buffer& buffer, std::size_t offset, void* data, std::size_t bytes) {
  if (is_shared(info_, bytes)) {
    return use_mapped(buffer, CL_MAP_READ, offset, bytes, [&](const void* mapped) {
      parallel_for(bytes, kSharedBytesPerTask, [&](std::size_t begin, std::size_t end) {
        std::memcpy(static_cast<char*>(data) + begin, static_cast<const char*>(mapped) + begin,
                    end - begin);
      });
    });
  }
  ++commands_;
  wait();
  copy_in_pieces(bytes, [&](std::size_t at, std::size_t piece) {
    check(driver([&] {
            return clEnqueueReadBuffer(queue_, buffer.get(), CL_TRUE, offset + at, piece,
                                       static_cast<char*>(data) + at, 0, nullptr, nullptr);
          }),
          "clEnqueueReadBuffer");
  });
}

}  // namespace kiln::ocl
