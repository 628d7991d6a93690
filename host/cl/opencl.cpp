// Interoperation with the caller's own OpenCL objects.
#include "kiln/opencl.h"

#include <string>
#include <vector>

#include "cl/context.h"
#include "cl/describe.h"
#include "cl/driver.h"

namespace kiln {
namespace {

[[noreturn]] void fail(const std::string& message, const char* id) {
  throw Error(ErrorCode::usage, message, id);
}

/// Queries a property of an object that the caller passed.
template <typename T, typename Object, typename Info, typename Get>
T query(Get get, Object object, Info what, const char* name) {
  struct {
    T value{};
  } answer;
  if (object == nullptr || cl::driver([&] {
                             return get(object, what, sizeof answer, &answer, nullptr);
                           }) != CL_SUCCESS) {
    fail(std::string(name) + " is null, or no OpenCL object of its kind.", "opencl-handle");
  }
  return answer.value;
}

void check_queue(const OpenClHandles& given) {
  const auto context =
      query<cl_context>(clGetCommandQueueInfo, given.queue, CL_QUEUE_CONTEXT, "queue");
  const auto device =
      query<cl_device_id>(clGetCommandQueueInfo, given.queue, CL_QUEUE_DEVICE, "queue");
  const auto properties = query<cl_command_queue_properties>(clGetCommandQueueInfo, given.queue,
                                                             CL_QUEUE_PROPERTIES, "queue");
  if (context != given.context || device != given.device) {
    fail("The queue belongs to another context or device: give those it was made for.",
         "opencl-queue");
  }
  if ((properties & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) != 0) {
    fail("The queue runs out of order: Kiln needs one in order.", "opencl-queue");
  }
}

Rectangle target_rectangle(const Image& image, const OpenClTarget& target,
                           const ConvertOptions& options) {
  const Rectangle& part = target.part;
  if (part.width == 0 || part.height == 0) return {0, 0, image.width, image.height};
  const bool is_inside_image = part.x < image.width && part.width <= image.width - part.x &&
                               part.y < image.height && part.height <= image.height - part.y;
  if (!is_inside_image || options.bottom_up) {
    fail("The part lies beyond the image, or bottom_up turns it upside down.", "opencl-part");
  }
  return part;
}

/// OpenCL's channel order and type for a pixel format.
cl_image_format image_format(PixelFormat format) {
  switch (format) {
    case PixelFormat::rgba8:
      return {CL_RGBA, CL_UNORM_INT8};
    case PixelFormat::bgra8:
      return {CL_BGRA, CL_UNORM_INT8};
    case PixelFormat::rgba16:
      return {CL_RGBA, CL_UNORM_INT16};
    case PixelFormat::rgba16_float:
      return {CL_RGBA, CL_HALF_FLOAT};
    case PixelFormat::rgba32_float:
      break;
  }
  return {CL_RGBA, CL_FLOAT};
}

struct PixelLayout {
  std::vector<std::byte> bytes;  // pixels of the whole image, without row padding
  std::size_t size;              // bytes of a pixel
  std::size_t row;               // bytes of a row
};

void write_image(cl::Context& context, const Image& image, PixelFormat format,
                 const OpenClTarget& target, const Rectangle& part, const PixelLayout& pixels) {
  const auto size = [&](cl_image_info what) {
    return query<std::size_t>(clGetImageInfo, target.memory, what, "memory");
  };
  const auto has = query<cl_image_format>(clGetImageInfo, target.memory, CL_IMAGE_FORMAT, "memory");
  const cl_image_format wanted = image_format(format);
  if (size(CL_IMAGE_WIDTH) != image.width || size(CL_IMAGE_HEIGHT) != image.height ||
      has.image_channel_order != wanted.image_channel_order ||
      has.image_channel_data_type != wanted.image_channel_data_type) {
    fail("The image object has another size or format than the map and the PixelFormat.",
         "opencl-memory");
  }
  const std::size_t origin[3] = {part.x, part.y, 0}, region[3] = {part.width, part.height, 1};
  cl::check(cl::driver([&] {
              return clEnqueueWriteImage(
                  context.queue(), target.memory, CL_TRUE, origin, region, pixels.row, 0,
                  &pixels.bytes[part.y * pixels.row + part.x * pixels.size], 0, nullptr, nullptr);
            }),
            "clEnqueueWriteImage");
}

void write_buffer(cl::Context& context, const Image& image, const OpenClTarget& target,
                  const Rectangle& part, const PixelLayout& pixels, std::size_t row_bytes) {
  const auto bytes = query<std::size_t>(clGetMemObjectInfo, target.memory, CL_MEM_SIZE, "memory");
  const std::size_t needed = row_bytes * (image.height - std::size_t{1}) + pixels.row;
  if (target.offset > bytes || needed > bytes - target.offset) {
    fail("The buffer has " + std::to_string(bytes) + " bytes: the map needs " +
             std::to_string(needed) + " from byte " + std::to_string(target.offset) + " on.",
         "opencl-memory");
  }
  const std::size_t x = part.x * pixels.size;
  const std::size_t target_origin[3] = {target.offset + x, part.y, 0},
                    source_origin[3] = {x, part.y, 0};
  const std::size_t region[3] = {part.width * pixels.size, part.height, 1};
  cl::check(cl::driver([&] {
              return clEnqueueWriteBufferRect(
                  context.queue(), target.memory, CL_TRUE, target_origin, source_origin, region,
                  row_bytes, 0, pixels.row, 0, pixels.bytes.data(), 0, nullptr, nullptr);
            }),
            "clEnqueueWriteBufferRect");
}

}  // namespace

Device opencl_device(const OpenClHandles& handles) {
  query<cl_uint>(clGetContextInfo, handles.context, CL_CONTEXT_REFERENCE_COUNT, "context");
  const auto platform =
      query<cl_platform_id>(clGetDeviceInfo, handles.device, CL_DEVICE_PLATFORM, "device");
  check_queue(handles);
  if (query<cl_bool>(clGetDeviceInfo, handles.device, CL_DEVICE_COMPILER_AVAILABLE, "device") ==
      CL_FALSE) {
    throw Error(ErrorCode::device, "The device has no compiler, so it cannot run Kiln's kernels.");
  }
  const auto context = std::make_shared<cl::Context>(handles.context, handles.device, handles.queue,
                                                     describe_device(platform, handles.device));
  context->require_correct_results();
  return DeviceAccess::make(context);
}

OpenClHandles opencl_handles(const Device& device) {
  const cl::Context& context = context_of(device);
  return {context.get(), context.device(), context.queue()};
}

void write_pixels(const Device& device, const Image& image, PixelFormat format,
                  const OpenClTarget& target, const ConvertOptions& options) {
  cl::Context& context = context_of(device);
  const Rectangle part = target_rectangle(image, target, options);
  if (query<cl_context>(clGetMemObjectInfo, target.memory, CL_MEM_CONTEXT, "memory") !=
      context.get()) {
    fail("The memory object belongs to another context than the device.", "opencl-memory");
  }
  PixelLayout pixels{{}, pixel_bytes(format), image.width * pixel_bytes(format)};
  pixels.bytes.resize(pixels.row * image.height);
  ConvertOptions tight_options = options;
  tight_options.row_bytes = 0;
  convert(image, format, pixels.bytes, tight_options);
  const std::size_t row_bytes = options.row_bytes != 0 ? options.row_bytes : pixels.row;
  if (row_bytes < pixels.row)
    fail("The target's rows have fewer bytes than the map's rows need.", "pixel-size");
  const auto type =
      query<cl_mem_object_type>(clGetMemObjectInfo, target.memory, CL_MEM_TYPE, "memory");
  if (type == CL_MEM_OBJECT_IMAGE2D) {
    write_image(context, image, format, target, part, pixels);
  } else if (type == CL_MEM_OBJECT_BUFFER) {
    write_buffer(context, image, target, part, pixels, row_bytes);
  } else {
    fail("The memory object is neither a buffer nor a 2D image.", "opencl-memory");
  }
}

}  // namespace kiln
