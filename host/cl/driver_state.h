// State of OpenCL drivers that a program asks when it ends: the command, and nobody else.
#pragma once

#include <vector>

#include "kiln/device.h"
#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// True if an OpenCL driver has thrown a C++ exception in this process: memory ran out within it, say. It
/// may hold its locks for good then, so Kiln calls no driver again, not even to release anything; whatever
/// needs a device throws Error(device). A process should end by _exit(), since drivers have handlers that
/// run at exit. \see in_driver()
bool driver_failed() noexcept;

/// True if this thread is within a call of an OpenCL driver: for a handler of signals that drivers die by.
/// Async-signal-safe.
bool in_driver() noexcept;

/// Name of the map of the user's whose function is being compiled or runs, of several the first one's, printable; null:
/// none is. Async-signal-safe.
const char* running_own_map() noexcept;

/// Warnings of the folder of compiled kernels (`kernel-folder`), which a Source has, too.
std::vector<Warning> kernel_folder_warnings();

/// True of PoCL's driver `basic`: kernels run on the thread that waits for them, and several threads may wait for each
/// other without end. Device::open() takes another where there is one and none is named.
bool may_wait_for_itself(const DeviceInfo& info);

}  // namespace kiln
