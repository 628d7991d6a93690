/// \file
/// Kiln on a program's own OpenCL context, and maps into its own buffers. The one header that names OpenCL's
/// types; kiln.h leaves it out. Link OpenCL (`OpenCL::OpenCL`) where you use it.
#pragma once

#ifndef CL_TARGET_OPENCL_VERSION
/// The version that Kiln needs; define a later one before, if you need that.
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <cstddef>
#include <cstdint>

#include "kiln/device.h"
#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/session.h"

namespace KILN_PUBLIC kiln {

/// OpenCL objects of a Device. Kiln holds references of its own: each lives until the Device and all that was
/// made of it are gone.
struct OpenClHandles {
  cl_context context = nullptr;      ///< May hold other devices, too
  cl_device_id device = nullptr;     ///< One of the context's; a sub-device is one
  cl_command_queue queue = nullptr;  ///< In order, of this context and device
};

/// Kiln on the caller's context, device and queue.
///
/// All of Kiln's work goes through this queue, in order with the caller's own commands there:
/// work enqueued before a bake is done before it. A bake returns when its results are on the
/// host. Kiln never resets or reconfigures anything, and reads no environment variable.
/// \throws Error(usage): `opencl-handle` for a null handle or one that is no OpenCL object;
///         `opencl-queue` for a queue of another context or device, or one out of order;
///         Error(device) for a device without a compiler
/// Thread safety: as any Device; the queue may be used by the caller's other threads meanwhile.
Device opencl_device(const OpenClHandles& handles);

/// The handles of any Device, for sharing buffers with what Kiln opened itself. Valid as long as any copy of it
/// or what was made of it; retain them to keep them longer. Any thread may call it.
OpenClHandles opencl_handles(const Device& device);

/// Layout of pixels in a buffer. An image object (CL_MEM_OBJECT_IMAGE2D) has rows of its own.
struct OpenClTarget {
  cl_mem memory = nullptr;  ///< A buffer, or a 2D image of the format's channels and type
  std::size_t offset = 0;   ///< Bytes before the first pixel; buffers only
  /// Rectangle to write, in the map's texels, such as Update::dirty; without area: all.
  Rectangle part = {};
};

/// Converts a map as convert() does, and writes it to the caller's memory object: all of it, or a part at its
/// place. Enqueued on the device's queue, and done when this returns; the memory object is not kept. Thread
/// safety: may be called from several threads, for different memory or parts.
/// \param options  ConvertOptions::row_bytes is that of the buffer
/// \throws Error(usage): what convert() throws; `opencl-memory` for an object of another context, too small,
///         or an image of another size or format; `opencl-part` for a part beyond the image, or bottom_up
///         with one; Error(device)
void write_pixels(const Device& device, const Image& image, PixelFormat format,
                  const OpenClTarget& target, const ConvertOptions& options = {});

}  // namespace kiln
