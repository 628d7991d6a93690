// The only folder that calls OpenCL. Everything else in host/ speaks Context, Array and Kernel.
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
/// Short name for the library's own code; public headers say `ocl`, since `cl` is OpenCL's own in C++.
namespace cl = ocl;
/// Work items of a group, of all kernels that do not say otherwise: a wave of every GPU fits in it.
inline constexpr std::size_t kLocal = 64;
}  // namespace kiln

namespace kiln::ocl {

/// Turns an OpenCL status into Error(device). The one conversion point.
void check(cl_int status, std::string_view what);

class BinaryCache;

/// Device memory that owns itself. Byte-level; use Array.
class Buffer {
 public:
  Buffer() = default;
  /// \param data  if not null, what it holds; it is copied at once: no command that waits for others
  Buffer(Context& context, std::size_t bytes, const void* data = nullptr);
  Buffer(Buffer&& other) noexcept { swap(other); }
  Buffer& operator=(Buffer&& other) noexcept {
    Buffer moved(std::move(other));
    swap(moved);
    return *this;
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
  ~Buffer();

  cl_mem get() const { return memory_; }
  std::size_t bytes() const { return bytes_; }
  /// It is about to be written to, or was.
  void touch() const noexcept;

 private:
  void swap(Buffer& other) noexcept {
    std::swap(memory_, other.memory_);
    other.untouched_ = untouched_.exchange(other.untouched_);
    std::swap(bytes_, other.bytes_);
    std::swap(context_, other.context_);
  }
  cl_mem memory_ = nullptr;
  std::size_t bytes_ = 0;
  Context* context_ = nullptr;
  mutable std::atomic<bool> untouched_{false};  ///< In count_untouched()
};

/// A typed device array of fixed size. An empty one may be passed to kernels as a null pointer.
template <typename T>
class Array {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Array() = default;
  /// Uninitialised.
  Array(Context& context, std::size_t size) : buffer_(context, size * sizeof(T)), size_(size) {}
  /// Copied from the host, at once.
  Array(Context& context, std::span<const T> data)
      : buffer_(context, data.size_bytes(), data.data()), size_(data.size()) {}

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const Buffer& buffer() const { return buffer_; }

  /// Blocking copies; offset in elements.
  void write(Context& context, std::span<const T> data, std::size_t offset = 0);
  void read(Context& context, std::span<T> data, std::size_t offset = 0) const;
  /// Elements [0, count) are what `make` writes to a span of them, each of them: where the device has the host's
  /// memory, in place. What they were is lost, also where it throws.
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

/// A kernel of a built program. Arguments are set in order by Context::launch. All threads share one object
/// of the driver, which holds the arguments: hence the lock of a launch.
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
/// Any number of threads may use one. A thread sees its own commands done in its order, and those
/// of others somewhere between; what a thread waits for includes what others had enqueued before.
/// Arrays and buffers are not guarded: a thread that writes one keeps it to itself, or holds a
/// lock. The lock lasts until the last command that needs the data is enqueued.
class KILN_HIDDEN Context {
 public:
  Context(cl_platform_id platform, cl_device_id device, DeviceInfo info);
  /// On what somebody else made, with references of its own. \param queue  in order
  Context(cl_context context, cl_device_id device, cl_command_queue queue, DeviceInfo info);
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const DeviceInfo& info() const { return info_; }
  cl_context get() const { return context_; }
  cl_command_queue queue() const { return queue_; }
  cl_device_id device() const { return device_; }

  /// A kernel by program family ("ray" for kernels/accel/ray.cl) and full kernel name. The program is
  /// built at first use and kept. `defines` is a string of -D options that change the code's shape.
  /// \throws Error(device) with the whole build log
  Kernel kernel(const std::string& family, const std::string& name,
                const std::string& defines = {});

  /// A kernel of a family whose program ends in a text of the user's.
  /// \param more       the text; messages of the compiler call it `more_name` and count its lines from 1
  /// \throws Error(input) with the whole build log where it does not compile
  Kernel kernel_with(const std::string& family, const std::string& name, const std::string& more,
                     const std::string& more_name);

  /// Enqueues one dimension of work: `count` items, padded up to a multiple of `local`. Kernels must
  /// check their index against a count that they are given. Trivially copyable values, Arrays and
  /// Buffers may be arguments, in the order of the kernel's parameters.
  template <typename... Args>
  void launch(const Kernel& kernel, std::size_t count, std::size_t local, const Args&... args) {
    if (count == 0) return;
    const std::lock_guard lock(launch_mutex_);
    cl_uint index = 0;
    (set_argument(kernel, index++, args), ...);
    enqueue(kernel, count, local);
  }

  /// Fills with a repeated byte-pattern value.
  template <typename T>
  void fill(const Array<T>& array, const T& value) {
    fill_bytes(array.buffer(), &value, sizeof(T), array.size() * sizeof(T));
  }

  /// Waits for everything enqueued.
  void finish();
  /// Waits so long at most. \returns false where something is still running; then no driver is called any more
  bool finish_within(double seconds);

  /// Refuses a device that computes wrongly (host/cl/selftest.h). Once a device and version of its driver: a pass
  /// is kept beside the programs. \throws Error(device), id `self-test`
  void require_sound();

  /// Seconds spent in clBuildProgram (and loading from the driver's cache) so far.
  double build_seconds() const;
  /// Bytes of device memory held now, and the most there ever were.
  std::uint64_t device_bytes() const { return device_bytes_; }
  std::uint64_t peak_device_bytes() const { return peak_device_bytes_; }
  /// Commands enqueued so far: what tests of growth count.
  std::uint64_t commands() const { return commands_; }
  /// Bytes that this thread has taken of any device, less those that it has given back: what a piece of
  /// work holds, whatever other threads do beside it.
  static std::int64_t bytes_of_thread();

 private:
  struct Program;
  /// A program that is built, or that some thread is building.
  struct Build;
  /// Builds a source. \param builds  its name in messages  \param code  of an error of the compiler's
  std::shared_ptr<Program> build(std::string_view source, const std::string& builds,
                                 const std::string& defines, ErrorCode code);
  std::shared_ptr<Program> load(std::string_view source, const std::string& options);
  void keep(std::string_view source, const std::string& options, const Program& built);
  /// Kernel of a program, which is built if there is none of its key yet. Whoever waits gives signs of life; where
  /// those end the wait the build goes on, for the next who needs it.
  Kernel kernel_by(const std::string& key, const std::string& name,
                   std::function<std::shared_ptr<Program>()> build);
  std::shared_ptr<Build> build_by(const std::string& key,
                                  std::function<std::shared_ptr<Program>()>&& build);
  Kernel kernel_of(Program& program, const std::string& name);

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
  /// \param most  waits no longer \returns false where it took longer
  bool wait_within(std::chrono::steady_clock::duration most);
  void fill_bytes(const Buffer& buffer, const void* value, std::size_t value_bytes,
                  std::size_t bytes);
  void write_bytes(const Buffer& buffer, std::size_t offset, const void* data, std::size_t bytes);
  void read_bytes(const Buffer& buffer, std::size_t offset, void* data, std::size_t bytes);
  /// The first bytes of a buffer on the host, to be written. Content lost. unmap() makes them the device's.
  void* map_bytes(const Buffer& buffer, std::size_t bytes);
  void unmap(const Buffer& buffer, void* data);

  DeviceInfo info_;
  std::unique_ptr<const BinaryCache> binaries_;
  cl_device_id device_ = nullptr;
  cl_context context_ = nullptr;
  cl_command_queue queue_ = nullptr;
  void account(std::int64_t bytes);

  mutable std::mutex programs_mutex_;
  std::map<std::string, std::shared_ptr<Build>> programs_;
  double build_seconds_ = 0;
  std::atomic<bool> has_compiled_{false};
  std::mutex launch_mutex_;  ///< From the first argument of a launch to its place in the queue
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

template <typename T>
template <typename Make>
void Array<T>::write_by(Context& context, std::size_t count, const Make& make) {
  if (count == 0) return;
  void* const data = context.map_bytes(buffer_, count * sizeof(T));
  try {
    make(std::span<T>(static_cast<T*>(data), count));
  } catch (...) {
    context.unmap(buffer_, data);
    throw;
  }
  context.unmap(buffer_, data);
}

}  // namespace kiln::ocl

namespace kiln {

/// Access to the context that Device hides from its users.
struct KILN_HIDDEN DeviceAccess {
  static Device make(std::shared_ptr<ocl::Context> context) { return Device(std::move(context)); }
  static ocl::Context& context(const Device& device) { return *device.context_; }
};

/// OpenCL context of a device, for the library's own parts.
inline ocl::Context& context_of(const Device& device) { return DeviceAccess::context(device); }

}  // namespace kiln
