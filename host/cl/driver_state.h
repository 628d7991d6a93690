// State of OpenCL drivers that a program asks when it ends: the command, and nobody else.
#pragma once

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

/// True while a kernel with a function of the user's runs. Async-signal-safe.
bool runs_own_map() noexcept;

/// True of PoCL's driver `basic`: kernels run on the thread that waits for them, and several threads may wait for each
/// other without end. Device::open() takes another where there is one and none is named.
bool may_wait_for_itself(const DeviceInfo& info);

}  // namespace kiln
