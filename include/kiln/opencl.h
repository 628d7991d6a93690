/// \file
/// Kiln on a program's own OpenCL context, with maps written to its own buffers. This is the only header
/// with OpenCL types, and kiln.h does not include it. Programs that use it link OpenCL (`OpenCL::OpenCL`).
#pragma once

#ifndef CL_TARGET_OPENCL_VERSION
/// The version that Kiln needs; define a later one before this include if you need it.
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

/// OpenCL objects of a Device. Kiln retains them: each lives until the Device and all objects made with it
/// are destroyed.
struct OpenClHandles {
  cl_context context = nullptr;      ///< Context; may contain other devices, too
  cl_device_id device = nullptr;     ///< Device of the context; may be a sub-device
  cl_command_queue queue = nullptr;  ///< In-order command queue of this context and device
};

/// Opens a Device on the caller's OpenCL context, device and queue.
///
/// All of Kiln's work goes through this queue, in order with the caller's own commands: commands
/// enqueued before a bake finish before it. A bake returns when its results are on the host. Kiln
/// never resets or reconfigures anything, and reads no environment variable.
/// \throws Error(usage): `opencl-handle` for a null or invalid handle; `opencl-queue` for a queue
///         of another context or device, or one out of order; Error(device) for a device without a
///         compiler
/// Thread safety: as any Device; the queue may be used by the caller's other threads meanwhile.
Device opencl_device(const OpenClHandles& handles);

/// The handles of a Device, for sharing buffers with a device that Kiln opened. They are valid while a copy of
/// the Device, or an object made with it, exists; retain them to use them longer. Any thread may call it.
OpenClHandles opencl_handles(const Device& device);

/// The memory object and rectangle that write_pixels() writes. An image object (CL_MEM_OBJECT_IMAGE2D) has its own row
/// pitch.
struct OpenClTarget {
  /// A buffer, or a 2D image with the channels and the type of the format
  cl_mem memory = nullptr;
  std::size_t offset = 0;  ///< Offset of the first pixel, bytes; only for buffers
  /// Rectangle of the map to write, texels, such as Update::dirty. If its area is 0: the whole map.
  Rectangle part = {};
};

/// Converts a map as convert() does, and writes it, or a part of it, to the caller's memory object at the
/// same position. The write goes through the device's queue and is complete on return; the memory object is
/// not kept. Thread safety: may be called from several threads, for different memory or parts.
/// \param options  ConvertOptions::row_bytes is that of the buffer
/// \throws Error(usage): as convert(); `opencl-memory` for an object of another context, too small, or an
///         image of another size or format; `opencl-part` for a part beyond the image, or bottom_up with one;
///         Error(device)
void write_pixels(const Device& device, const Image& image, PixelFormat format,
                  const OpenClTarget& target, const ConvertOptions& options = {});

}  // namespace kiln
