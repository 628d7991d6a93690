// Kiln on another program's OpenCL objects, and pixels in its buffers.
#include "kiln/opencl.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>

#include "support/environment.h"
#include "support/shapes.h"

namespace kiln {
namespace {

std::string id_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    return error.id();
  }
  return {};
}

/// Another program's: a context, two queues of it, buffers.
class Foreign {
 public:
  Foreign() {
    device_ = opencl_handles(*test::device()).device;
    context_ = clCreateContext(nullptr, 1, &device_, nullptr, nullptr, nullptr);
    queue_ = clCreateCommandQueue(context_, device_, 0, nullptr);
    disorderly_ =
        clCreateCommandQueue(context_, device_, CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE, nullptr);
  }
  Foreign(const Foreign&) = delete;
  Foreign& operator=(const Foreign&) = delete;
  ~Foreign() {
    for (cl_mem memory : memory_) clReleaseMemObject(memory);
    if (disorderly_ != nullptr) clReleaseCommandQueue(disorderly_);
    clReleaseCommandQueue(queue_);
    clReleaseContext(context_);
  }

  OpenClHandles handles() const { return {context_, device_, queue_}; }
  cl_command_queue disorderly() const { return disorderly_; }

  /// Bytes of 0xCD.
  cl_mem buffer(std::size_t bytes) {
    const std::vector<unsigned char> canary(bytes, 0xCD);
    memory_.push_back(clCreateBuffer(context_, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, bytes,
                                     const_cast<unsigned char*>(canary.data()), nullptr));
    return memory_.back();
  }
  /// Null where the device has none of the kind.
  cl_mem image(std::size_t width, std::size_t height, cl_channel_type type) {
    const cl_image_format format{CL_RGBA, type};
    cl_image_desc what{};
    what.image_type = CL_MEM_OBJECT_IMAGE2D;
    what.image_width = width;
    what.image_height = height;
    cl_mem made = clCreateImage(context_, CL_MEM_READ_WRITE, &format, &what, nullptr, nullptr);
    if (made != nullptr) memory_.push_back(made);
    return made;
  }

  std::vector<std::byte> read(cl_mem memory, std::size_t bytes) const {
    std::vector<std::byte> result(bytes);
    clEnqueueReadBuffer(queue_, memory, CL_TRUE, 0, bytes, result.data(), 0, nullptr, nullptr);
    return result;
  }
  cl_uint references() const {
    cl_uint count = 0;
    clGetContextInfo(context_, CL_CONTEXT_REFERENCE_COUNT, sizeof count, &count, nullptr);
    return count;
  }

 private:
  cl_device_id device_ = nullptr;
  cl_context context_ = nullptr;
  cl_command_queue queue_ = nullptr, disorderly_ = nullptr;
  std::vector<cl_mem> memory_;
};

TEST(OpenCl, AForeignContextBakesTheSameBytes) {
  KILN_REQUIRE_DEVICE();
  Foreign foreign;
  const Mesh high = test::BumpySphere::dense(2000);
  const Mesh low = test::BumpySphere::light(12, 8);
  const BakeOptions options{.width = 48, .height = 40};
  const Image expected = bake(Source(*test::device(), high), low, options).maps[0].image;
  const cl_uint before = foreign.references();
  {
    const Device device = opencl_device(foreign.handles());
    EXPECT_EQ(device.info().name, test::device()->info().name);
    EXPECT_EQ(opencl_handles(device).queue, foreign.handles().queue);
    const Image image = bake(Source(device, high), low, options).maps[0].image;
    EXPECT_EQ(image.pixels, expected.pixels);
  }
  EXPECT_EQ(foreign.references(), before);  // nothing is kept
}

TEST(OpenCl, PixelsLieInTheForeignBuffer) {
  KILN_REQUIRE_DEVICE();
  Foreign foreign;
  const Device device = opencl_device(foreign.handles());
  Image image{5, 4, 3, {}};
  for (int i = 0; i < 60; ++i) image.pixels.push_back(static_cast<float>(i) / 60);
  std::vector<std::byte> pixels(5 * 4 * 8);
  convert(image, PixelFormat::rgba16, pixels);
  constexpr std::size_t kOffset = 24, kRow = 48, kBytes = kOffset + 3 * kRow + 40 + 16;
  const cl_mem buffer = foreign.buffer(kBytes);
  write_pixels(device, image, PixelFormat::rgba16, {.memory = buffer, .offset = kOffset},
               {.row_bytes = kRow});
  std::vector<std::byte> expected(kBytes, std::byte{0xCD});
  for (std::size_t y = 0; y < 4; ++y) {
    std::memcpy(&expected[kOffset + y * kRow], &pixels[y * 40], 40);
  }
  EXPECT_EQ(foreign.read(buffer, kBytes), expected);
}

TEST(OpenCl, APartIsWrittenAtItsPlace) {
  KILN_REQUIRE_DEVICE();
  Foreign foreign;
  const Device device = opencl_device(foreign.handles());
  const Image image{6, 6, 1, std::vector<float>(36, 1)};
  const cl_mem buffer = foreign.buffer(6 * 6 * 4);
  write_pixels(device, image, PixelFormat::rgba8, {.memory = buffer, .part = {1, 2, 3, 2}});
  const std::vector<std::byte> bytes = foreign.read(buffer, 6 * 6 * 4);
  for (std::size_t i = 0; i < 36; ++i) {
    const std::size_t x = i % 6, y = i / 6;
    const bool inside = x >= 1 && x < 4 && y >= 2 && y < 4;
    EXPECT_EQ(bytes[4 * i], inside ? std::byte{255} : std::byte{0xCD}) << x << ", " << y;
  }
}

TEST(OpenCl, PixelsLieInAForeignImage) {
  KILN_REQUIRE_DEVICE();
  Foreign foreign;
  const cl_mem object = foreign.image(4, 3, CL_UNORM_INT8);
  if (object == nullptr) GTEST_SKIP() << "the device has no images";
  const Device device = opencl_device(foreign.handles());
  const Image image{4, 3, 1, {0, .2F, .4F, .6F, .8F, 1, 0, .2F, .4F, .6F, .8F, 1}};
  write_pixels(device, image, PixelFormat::rgba8, {.memory = object});
  std::vector<std::byte> expected(48), bytes(48);
  convert(image, PixelFormat::rgba8, expected);
  const std::size_t origin[3] = {0, 0, 0}, region[3] = {4, 3, 1};
  ASSERT_EQ(clEnqueueReadImage(foreign.handles().queue, object, CL_TRUE, origin, region, 0, 0,
                               bytes.data(), 0, nullptr, nullptr),
            CL_SUCCESS);
  EXPECT_EQ(bytes, expected);
  EXPECT_EQ(id_of([&] { write_pixels(device, image, PixelFormat::rgba16, {.memory = object}); }),
            "opencl-memory");
}

/// A copy on the device, kept up to date by dirty rectangles alone, is the whole map.
TEST(OpenCl, DirtyRectanglesKeepABufferUpToDate) {
  KILN_REQUIRE_DEVICE();
  Foreign foreign;
  const Device device = opencl_device(foreign.handles());
  Mesh mesh = test::plane(16, 16);
  mesh.normals.clear();
  mesh.normal_triangles.clear();
  BakeOptions options{.width = 64, .height = 64};
  options.match.method = MatchMethod::uv;
  BakeSession session(device, mesh, test::plane(1, 1), options);
  const cl_mem buffer = foreign.buffer(64 * 64 * 8);
  std::vector<std::byte> expected(64 * 64 * 8);
  for (std::uint32_t step = 0; step < 6; ++step) {
    const Image& image = session.bake().map(MapKind::normal).image;
    const Rectangle dirty = session.last_update().dirty;
    ASSERT_NE(dirty.width, 0U);
    write_pixels(device, image, PixelFormat::rgba16_float, {.memory = buffer, .part = dirty});
    convert(image, PixelFormat::rgba16_float, expected);
    EXPECT_EQ(foreign.read(buffer, expected.size()), expected) << step;
    Vec3 p = session.high().positions[40 * step + 20];
    p.z += 0.02F;
    session.set_positions(40 * step + 20, {&p, 1});
  }
}

TEST(OpenCl, WhatDoesNotFitIsNamed) {
  KILN_REQUIRE_DEVICE();
  Foreign foreign, other;
  const OpenClHandles good = foreign.handles();
  const auto opened = [&](const std::function<void(OpenClHandles&)>& change) {
    OpenClHandles handles = good;
    change(handles);
    return id_of([&] { opencl_device(handles); });
  };
  EXPECT_EQ(opened([](OpenClHandles&) {}), "");
  EXPECT_EQ(opened([](OpenClHandles& h) { h.context = nullptr; }), "opencl-handle");
  EXPECT_EQ(opened([](OpenClHandles& h) { h.device = nullptr; }), "opencl-handle");
  EXPECT_EQ(opened([](OpenClHandles& h) { h.queue = nullptr; }), "opencl-handle");
  EXPECT_EQ(opened([&](OpenClHandles& h) { h.queue = other.handles().queue; }), "opencl-queue");
  if (foreign.disorderly() != nullptr) {
    EXPECT_EQ(opened([&](OpenClHandles& h) { h.queue = foreign.disorderly(); }), "opencl-queue");
  }
  const Device device = opencl_device(good);
  const Image image{8, 8, 3, std::vector<float>(192)};
  const auto written = [&](const OpenClTarget& target, const ConvertOptions& options = {}) {
    return id_of([&] { write_pixels(device, image, PixelFormat::rgba8, target, options); });
  };
  const cl_mem buffer = foreign.buffer(256);
  EXPECT_EQ(written({.memory = buffer}), "");
  EXPECT_EQ(written({}), "opencl-handle");
  EXPECT_EQ(written({.memory = other.buffer(256)}), "opencl-memory");
  EXPECT_EQ(written({.memory = foreign.buffer(255)}), "opencl-memory");
  EXPECT_EQ(written({.memory = buffer, .offset = 4}), "opencl-memory");
  EXPECT_EQ(written({.memory = buffer, .offset = ~std::size_t{0}}), "opencl-memory");
  EXPECT_EQ(written({.memory = buffer}, {.row_bytes = 31}), "pixel-size");
  EXPECT_EQ(written({.memory = buffer, .part = {7, 0, 2, 1}}), "opencl-part");
  EXPECT_EQ(written({.memory = buffer, .part = {0, 8, 1, 1}}), "opencl-part");
  EXPECT_EQ(written({.memory = buffer, .part = {1, 1, 1, 1}}, {.bottom_up = true}), "opencl-part");
}

}  // namespace
}  // namespace kiln
