// Your own OpenCL context, queue and buffer: Kiln bakes into it, your kernel reads it, and after a change only
// the changed part is written. Names of Kiln and of OpenCL's C++ header do not collide.
#define CL_HPP_TARGET_OPENCL_VERSION 120
#define CL_HPP_MINIMUM_OPENCL_VERSION 120
#include <kiln/kiln.h>
#include <kiln/opencl.h>
#include <kiln/session.h>

#include <CL/opencl.hpp>

#include "mesh_of.h"

using namespace kiln;

int main() {
  const cl::Device chosen = cl::Device::getDefault();
  const cl::Context context(chosen);
  cl::CommandQueue queue(context, chosen);
  const cl::Buffer texture(context, CL_MEM_READ_WRITE, std::size_t{512} * 512 * 4);
  const Device device = opencl_device({context(), chosen(), queue()});

  BakeSession session(device, mesh_of(sheet(170, 0.005F)), mesh_of(sheet(1, 0)),
                      {.width = 512,
                       .height = 512,
                       .match = {.method = MatchMethod::uv},
                       .encoding = {.gutter = 0}});
  write_pixels(device, session.bake().map(MapKind::normal).image, PixelFormat::rgba8,
               {.memory = texture()});
  const Vec3 up{0, 0, 1};
  session.set_normals(0, {&up, 1});  // normal of the vertex in the lower left corner
  const Image& changed = session.bake().map(MapKind::normal).image;
  const Rectangle dirty = session.last_update().dirty;
  write_pixels(device, changed, PixelFormat::rgba8, {.memory = texture(), .part = dirty});

  const cl::Program program(context,
                            "kernel void leaning(global const uchar4* texture, global int* count) {"
                            "  if (texture[get_global_id(0)].x != 128) atomic_inc(count);"
                            "}",
                            true);
  int count = 0;
  const cl::Buffer counter(context, CL_MEM_READ_WRITE | CL_MEM_COPY_HOST_PTR, sizeof count, &count);
  cl::KernelFunctor<cl::Buffer, cl::Buffer> leaning(program, "leaning");
  leaning(cl::EnqueueArgs(queue, cl::NDRange(std::size_t{512} * 512)), texture, counter);
  queue.enqueueReadBuffer(counter, CL_TRUE, 0, sizeof count, &count);
  std::printf("%d texels lean, %u x %u written twice\n", count, dirty.width, dirty.height);
}
