// OpenCL wrapper: Context, Array, Kernel. Only this room calls OpenCL.
#pragma once

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "kiln/device.h"
#include "kiln/error.h"

namespace kiln {
namespace ocl {}
/// Alias for internal code. Public headers use `ocl`, since `cl` is the namespace of OpenCL's own C++ bindings.
namespace cl = ocl;
/// Default work-group size: at least a wave of every GPU.
inline constexpr std::size_t kLocal = 64;

/// True for a device of PoCL, whose work-items run as plain functions on the CPU.
inline bool is_pocl(const DeviceInfo& info) {
  return info.platform == "Portable Computing Language";
}
}  // namespace kiln

namespace kiln::ocl {

/// Throws Error(device) for an OpenCL status other than CL_SUCCESS. All statuses are converted here.
void check(cl_int status, std::string_view what);

class BinaryCache;
struct Tuning;

/// Owns device memory, in bytes. Array is the typed interface.
class Buffer {
 public:
  Buffer() = default;
  /// \param data initial contents, or null; copied immediately, without a command in the queue
  Buffer(Context& context, std::size_t bytes, const void* data = nullptr);
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    Buffer moved_buffer(std::move(other));
    swap(moved_buffer);
    return *this;
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer();

  cl_mem get() const { return memory_; }
  std::size_t bytes() const { return bytes_; }
  /// Marks the memory as written, so that count_unwritten() no longer subtracts it.
  void mark_written() const noexcept;

 private:
  void swap(Buffer& other) noexcept {
    std::swap(memory_, other.memory_);
    other.is_unwritten_ = is_unwritten_.exchange(other.is_unwritten_);
    std::swap(bytes_, other.bytes_);
    std::swap(context_, other.context_);
  }
  cl_mem memory_ = nullptr;
  std::size_t bytes_ = 0;
  Context* context_ = nullptr;
  mutable std::atomic<bool> is_unwritten_{
      false};  ///< True while count_unwritten() counts the memory as allocated but not written
};

/// A typed device array of fixed size. An empty array is passed to kernels as a null pointer.
template <typename T>
class Array {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Array() = default;
  /// Allocates without initializing.
  Array(Context& context, std::size_t size) : buffer_(context, size * sizeof(T)), size_(size) {}
  /// Allocates, and copies from the host immediately.
  Array(Context& context, std::span<const T> data)
      : buffer_(context, data.size_bytes(), data.data()), size_(data.size()) {}

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const Buffer& buffer() const { return buffer_; }

  /// Blocking copies; offset in elements.
  void write(Context& context, std::span<const T> data, std::size_t offset = 0);
  void read(Context& context, std::span<T> data, std::size_t offset = 0) const;
  /// Calls `make` with a span of elements [0, count), all of which it must write; in place if the device shares the
  /// host's memory. Previous contents are discarded, even if this throws.
  template <typename Make>
  void write_by(Context& context, std::size_t count, const Make& make);
  std::vector<T> download(Context& context) const {
    std::vector<T> result(size_);
    if (size_ != 0) read(context, result);
    return result;
  }

 private:
  Buffer buffer_;
  std::size_t size_ = 0;
};

/// A kernel of a built program. Context::launch sets arguments in order. All threads share the driver's kernel
/// object, which holds the arguments, so a launch holds a lock.
class Kernel {
 public:
  Kernel() = default;
  Kernel(cl_kernel kernel, std::string name) : kernel_(kernel), name_(std::move(name)) {}
  cl_kernel get() const { return kernel_; }
  const std::string& name() const { return name_; }

 private:
  cl_kernel kernel_ = nullptr;  // owned by the context's program cache
  std::string name_;
};

/// Context, in-order queue, built programs and memory account of one device.
///
/// Thread-safe. The commands of one thread run in the order in which it enqueues them, interleaved with those of other
/// threads. A wait also waits for commands that other threads enqueued before. Access to arrays and buffers is not
/// synchronised: a thread that writes one must be its only user, or hold a lock until the last command that needs the
/// data is enqueued.
class KILN_HIDDEN Context {
 public:
  Context(cl_platform_id platform, cl_device_id device, DeviceInfo info);
  /// Wraps existing OpenCL objects, with references of its own. \param queue  in-order
  Context(cl_context context, cl_device_id device, cl_command_queue queue, DeviceInfo info);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const DeviceInfo& info() const { return info_; }
  cl_context get() const { return context_; }
  cl_command_queue queue() const { return queue_; }
  cl_device_id device() const { return device_; }

  /// Choices that change speed, not results.
  const Tuning& tuning() const { return *tuning_; }
  /// Replaces them. No other thread may use the context meanwhile.
  void set_tuning(const Tuning& tuning);
  /// The work-group size of a kernel: a tuned one, if it is not 0, as far as the device can run the kernel with it, else
  /// the default.
  std::size_t group_size(const Kernel& kernel, std::uint32_t tuned, std::size_t default_size) const;

  /// Returns a kernel, given its program family ("ray" for kernels/accel/ray.cl) and full name. The program is
  /// built at its first use and cached. `defines` holds -D options that change the code's shape.
  /// \throws Error(device) with the whole build log
  Kernel kernel(const std::string& family, const std::string& name,
                const std::string& defines = {});

  /// Returns a kernel of a family to whose program a user's source is appended.
  /// \param more the user's source; compiler messages call it `more_name` and count its lines from 1
  /// \throws Error(input) with the whole build log if it does not compile
  Kernel kernel_with(const std::string& family, const std::string& name, const std::string& more,
                     const std::string& more_name);

  /// Enqueues one dimension of work: `count` items, rounded up to a multiple of `local`. Kernels must check their index
  /// against a count in their arguments. Arguments are trivially copyable values, Arrays and Buffers, in the order of
  /// the kernel's parameters.
  template <typename... Args>
  void launch(const Kernel& kernel, std::size_t count, std::size_t local, const Args&... args) {
    if (count == 0) return;
    const std::lock_guard lock(launch_mutex_);
    cl_uint index = 0;
    (set_argument(kernel, index++, args), ...);
    enqueue(kernel, count, local);
  }

  /// Fills an array with a repeated value.
  template <typename T>
  void fill(const Array<T>& array, const T& value) {
    fill_bytes(array.buffer(), &value, sizeof(T), array.size() * sizeof(T));
  }

  /// Waits for all commands.
  void finish();
  /// Waits at most this long. \returns false if commands are still running; then no driver function is called any more
  bool finish_within(double seconds);

  /// Rejects a device that computes wrong results (host/cl/selftest.h). Each device and driver version is tested
  /// once; a pass is stored in the binary cache. \throws Error(device), id `self-test`
  void require_correct_results();

  /// Seconds spent so far in clBuildProgram and in loading from caches.
  double build_seconds() const;
  /// Bytes of device memory in use, and the peak.
  std::uint64_t device_bytes() const { return device_bytes_; }
  std::uint64_t peak_device_bytes() const { return peak_device_bytes_; }
  /// Number of commands enqueued so far; used by tests of complexity.
  std::uint64_t commands() const { return commands_; }
  /// Device memory that this thread has allocated minus the memory that it has freed, to measure a piece of work
  /// independent of other threads.
  static std::int64_t bytes_of_thread();

 private:
  struct Program;
  /// A program whose build is finished or running.
  struct Build;
  /// Builds a source. \param source_name  name of the source, for messages \param code error code of compiler errors
  std::shared_ptr<Program> build(std::string_view source, const std::string& source_name,
                                 const std::string& defines, ErrorCode code);
  std::shared_ptr<Program> load(std::string_view source, const std::string& options);
  void store_binary(std::string_view source, const std::string& options,
                    const Program& built_program);
  /// Returns a kernel of a program, which is built if the key is new. Waiting threads poll progress; if that cancels
  /// the wait, the build continues for the next caller.
  Kernel find_or_build_kernel(const std::string& key, const std::string& name,
                              std::function<std::shared_ptr<Program>()> build);
  std::shared_ptr<Build> build_by(const std::string& key,
                                  std::function<std::shared_ptr<Program>()>&& build);
  Kernel kernel_of_program(Program& program, const std::string& name);

  friend class Buffer;
  template <typename T>
  friend class Array;

  template <typename T>
  void set_argument(const Kernel& kernel, cl_uint index, const Array<T>& array) {
    set_buffer_argument(kernel, index, array.buffer());
  }
  void set_argument(const Kernel& kernel, cl_uint index, const Buffer& buffer) {
    set_buffer_argument(kernel, index, buffer);
  }
  template <typename T>
  requires std::is_trivially_copyable_v<T>
  void set_argument(const Kernel& kernel, cl_uint index, const T& value) {
    set_raw_argument(kernel, index, &value, sizeof(T));
  }
  void set_buffer_argument(const Kernel& kernel, cl_uint index, const Buffer& buffer);
  void set_raw_argument(const Kernel& kernel, cl_uint index, const void* value, std::size_t bytes);
  void enqueue(const Kernel& kernel, std::size_t count, std::size_t local);
  void wait();
  /// \returns false if the time limit expired
  bool wait_within(std::chrono::steady_clock::duration timeout);
  void fill_bytes(const Buffer& buffer, const void* value, std::size_t value_bytes,
                  std::size_t bytes);
  void write_bytes(const Buffer& buffer, std::size_t offset, const void* data, std::size_t bytes);
  void read_bytes(const Buffer& buffer, std::size_t offset, void* data, std::size_t bytes);
  /// Maps bytes [offset, offset + bytes) of a buffer into the host's memory, calls `use` with their address, and unmaps
  /// them, even if `use` throws.
  /// \param flags  CL_MAP_READ; or CL_MAP_WRITE_INVALIDATE_REGION, which discards the previous contents
  template <typename Use>
  void use_mapped(const Buffer& buffer, cl_map_flags flags, std::size_t offset, std::size_t bytes,
                  const Use& use);
  void* map_bytes(const Buffer& buffer, cl_map_flags flags, std::size_t offset, std::size_t bytes);
  void unmap(const Buffer& buffer, void* data);

  DeviceInfo info_;
  std::unique_ptr<Tuning> tuning_;
  std::unique_ptr<const BinaryCache> binaries_;
  cl_device_id device_ = nullptr;
  cl_context context_ = nullptr;
  cl_command_queue queue_ = nullptr;
  void account_memory(std::int64_t bytes);

  mutable std::mutex programs_mutex_;
  std::map<std::string, std::shared_ptr<Build>> programs_;
  double build_seconds_ = 0;
  std::atomic<bool> has_compiled_{false};
  std::mutex launch_mutex_;  ///< Held from a launch's first argument until it is enqueued
  std::atomic<std::uint64_t> commands_{0};
  std::atomic<std::uint64_t> device_bytes_{0};
  std::atomic<std::uint64_t> peak_device_bytes_{0};
};

template <typename T>
void Array<T>::write(Context& context, std::span<const T> data, std::size_t offset) {
  if (!data.empty()) {
    context.write_bytes(buffer_, offset * sizeof(T), data.data(), data.size_bytes());
  }
}
template <typename T>
void Array<T>::read(Context& context, std::span<T> data, std::size_t offset) const {
  if (!data.empty()) {
    context.read_bytes(buffer_, offset * sizeof(T), data.data(), data.size_bytes());
  }
}

template <typename Use>
void Context::use_mapped(const Buffer& buffer, cl_map_flags flags, std::size_t offset,
                         std::size_t bytes, const Use& use) {
  void* const data = map_bytes(buffer, flags, offset, bytes);
  try {
    use(data);
  } catch (...) {
    unmap(buffer, data);
    throw;
  }
  unmap(buffer, data);
}

template <typename T>
template <typename Make>
void Array<T>::write_by(Context& context, std::size_t count, const Make& make) {
  if (count == 0) return;
  context.use_mapped(buffer_, CL_MAP_WRITE_INVALIDATE_REGION, 0, count * sizeof(T),
                     [&](void* data) { make(std::span<T>(static_cast<T*>(data), count)); });
}

}  // namespace kiln::ocl

namespace kiln {

/// Access to the context that a Device contains.
struct KILN_HIDDEN DeviceAccess {
  static Device make(std::shared_ptr<ocl::Context> context) { return Device(std::move(context)); }
  static ocl::Context& context(const Device& device) { return *device.context_; }
};

/// A device's OpenCL context, for internal code.
inline ocl::Context& context_of(const Device& device) { return DeviceAccess::context(device); }

}  // namespace kiln
