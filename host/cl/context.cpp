#include "cl/context.h"

#include <algorithm>
#include <chrono>
#include <cstring>

#include "cl/embedded.h"

namespace kiln::cl {
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

std::string status_name(cl_int status) {
  for (const StatusName& entry : kStatusNames) {
    if (entry.status == status) return entry.name;
  }
  return "OpenCL status " + std::to_string(status);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::string megabytes(std::size_t bytes) {
  return std::to_string((bytes + (1 << 20) - 1) >> 20) + " MiB";
}

}  // namespace

void check(cl_int status, std::string_view what) {
  if (status == CL_SUCCESS) return;
  throw Error(ErrorCode::device, std::string(what) + " failed with " + status_name(status) + ".");
}

Buffer::Buffer(Context& context, std::size_t bytes) : bytes_(bytes), context_(&context) {
  if (bytes == 0) return;
  const DeviceInfo& info = context.info();
  if (bytes > info.largest_buffer_bytes) {
    throw Error(ErrorCode::device, "A buffer of " + megabytes(bytes) + " is needed, but " +
                                       info.name + " allows at most " +
                                       megabytes(info.largest_buffer_bytes) +
                                       " in one. Use a smaller mesh, or another device.");
  }
  cl_int status = CL_SUCCESS;
  memory_ = clCreateBuffer(context.get(), CL_MEM_READ_WRITE, bytes, nullptr, &status);
  if (status != CL_SUCCESS) {
    throw Error(ErrorCode::device, "Allocating " + megabytes(bytes) + " on " + info.name +
                                       " failed with " + status_name(status) + "; " +
                                       megabytes(context.device_bytes()) + " are in use.");
  }
  context.device_bytes_ += bytes;
  context.peak_device_bytes_ = std::max(context.peak_device_bytes_, context.device_bytes_);
}

Buffer::~Buffer() {
  if (memory_ == nullptr) return;
  clReleaseMemObject(memory_);
  context_->device_bytes_ -= bytes_;
}

struct Context::Program {
  cl_program program = nullptr;
  std::map<std::string, cl_kernel> kernels;
  ~Program() {
    for (auto& [name, kernel] : kernels) clReleaseKernel(kernel);
    if (program != nullptr) clReleaseProgram(program);
  }
};

Context::Context(cl_platform_id platform, cl_device_id device, DeviceInfo info)
    : info_(std::move(info)), device_(device) {
  const cl_context_properties properties[] = {CL_CONTEXT_PLATFORM,
                                              reinterpret_cast<cl_context_properties>(platform), 0};
  cl_int status = CL_SUCCESS;
  context_ = clCreateContext(properties, 1, &device, nullptr, nullptr, &status);
  check(status, "Opening " + info_.name);
  queue_ = clCreateCommandQueue(context_, device, 0, &status);
  if (status != CL_SUCCESS) clReleaseContext(context_);
  check(status, "Creating a command queue on " + info_.name);
}

Context::~Context() {
  clFinish(queue_);
  programs_.clear();
  clReleaseCommandQueue(queue_);
  clReleaseContext(context_);
}

std::unique_ptr<Context::Program> Context::build(const std::string& source,
                                                 const std::string& builds,
                                                 const std::string& defines, ErrorCode code) {
  const auto start = std::chrono::steady_clock::now();
  auto built = std::make_unique<Program>();
  const char* text = source.data();
  const std::size_t length = source.size();
  cl_int status = CL_SUCCESS;
  built->program = clCreateProgramWithSource(context_, 1, &text, &length, &status);
  check(status, "clCreateProgramWithSource for " + builds);
  std::string options = "-cl-std=CL1.2";
  if (info_.has_correct_division) options += " -cl-fp32-correctly-rounded-divide-sqrt";
  if (info_.is_gpu) options += " -DKILN_GPU=1";
  if (!defines.empty()) options += " " + defines;
  status = clBuildProgram(built->program, 1, &device_, options.c_str(), nullptr, nullptr);
  if (status != CL_SUCCESS) {
    std::size_t size = 0;
    clGetProgramBuildInfo(built->program, device_, CL_PROGRAM_BUILD_LOG, 0, nullptr, &size);
    std::string log(size, '\0');
    clGetProgramBuildInfo(built->program, device_, CL_PROGRAM_BUILD_LOG, size, log.data(), nullptr);
    throw Error(code, "Building " + builds + " (" + options + ") on " + info_.name +
                          " failed with " + status_name(status) + ". The build log:\n" + log);
  }
  build_seconds_ += seconds_since(start);
  return built;
}

Kernel Context::kernel_of(Program& program, const std::string& name) {
  cl_kernel& kernel = program.kernels[name];
  if (kernel == nullptr) {
    cl_int status = CL_SUCCESS;
    kernel = clCreateKernel(program.program, name.c_str(), &status);
    check(status, "clCreateKernel for " + name);
  }
  return {kernel, name};
}

Kernel Context::kernel(const std::string& family, const std::string& name,
                       const std::string& defines) {
  std::unique_ptr<Program>& slot = programs_[family + " " + defines];
  if (!slot) {
    const std::string source(embedded_source(family));
    if (source.empty()) {
      throw Error(ErrorCode::internal, "There is no kernel family '" + family + "'.");
    }
    slot = build(source, "kernels/" + family + ".cl", defines, ErrorCode::device);
  }
  return kernel_of(*slot, name);
}

Kernel Context::kernel_with(const std::string& family, const std::string& name,
                            const std::string& more, const std::string& more_name) {
  std::unique_ptr<Program>& slot = programs_[family + "\n" + more_name + "\n" + more];
  if (!slot) {
    std::string file = more_name;
    for (char& c : file) {
      if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 32) c = '_';
    }
    const std::string source =
        std::string(embedded_source(family)) + "\n#line 1 \"" + file + "\"\n" + more + "\n";
    slot = build(source, "'" + more_name + "'", {}, ErrorCode::input);
  }
  return kernel_of(*slot, name);
}

void Context::set_buffer_argument(const Kernel& kernel, cl_uint index, const Buffer& buffer) {
  const cl_mem memory = buffer.get();
  check(clSetKernelArg(kernel.get(), index, sizeof(cl_mem), &memory),
        "clSetKernelArg " + std::to_string(index) + " of " + kernel.name());
}

void Context::set_raw_argument(const Kernel& kernel, cl_uint index, const void* value,
                               std::size_t bytes) {
  check(clSetKernelArg(kernel.get(), index, bytes, value),
        "clSetKernelArg " + std::to_string(index) + " of " + kernel.name());
}

void Context::enqueue(const Kernel& kernel, std::size_t count, std::size_t local) {
  const std::size_t global = (count + local - 1) / local * local;
  check(clEnqueueNDRangeKernel(queue_, kernel.get(), 1, nullptr, &global, &local, 0, nullptr,
                               nullptr),
        "Launching " + kernel.name() + " on " + info_.name);
}

void Context::finish() { check(clFinish(queue_), "Waiting for " + info_.name); }

void Context::fill_bytes(const Buffer& buffer, const void* value, std::size_t value_bytes,
                         std::size_t bytes) {
  if (bytes == 0) return;
  check(
      clEnqueueFillBuffer(queue_, buffer.get(), value, value_bytes, 0, bytes, 0, nullptr, nullptr),
      "clEnqueueFillBuffer");
}

void Context::write_bytes(const Buffer& buffer, std::size_t offset, const void* data,
                          std::size_t bytes) {
  check(
      clEnqueueWriteBuffer(queue_, buffer.get(), CL_TRUE, offset, bytes, data, 0, nullptr, nullptr),
      "clEnqueueWriteBuffer");
}

void Context::read_bytes(const Buffer& buffer, std::size_t offset, void* data, std::size_t bytes) {
  check(
      clEnqueueReadBuffer(queue_, buffer.get(), CL_TRUE, offset, bytes, data, 0, nullptr, nullptr),
      "clEnqueueReadBuffer");
}

}  // namespace kiln::cl
