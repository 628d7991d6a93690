// State of OpenCL drivers, which the command checks when it exits.
#pragma once

#include <vector>

#include "kiln/device.h"
#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// True if an OpenCL driver has thrown a C++ exception in this process, for example for lack of memory. It may hold its
/// locks forever, so Kiln calls no driver again, not even to release objects; functions that need a device throw
/// Error(device). The process should end by _exit(), since drivers register exit handlers. \see in_driver()
bool driver_failed() noexcept;

/// True if this thread is within a call of an OpenCL driver; for handlers of signals that faulty drivers
/// raise. Async-signal-safe.
bool in_driver() noexcept;

/// Name of the user's map that is being compiled or run (the first of several), in printable
/// characters; null if there is none. Async-signal-safe.
const char* running_own_map() noexcept;

/// Warnings about the folder of compiled kernels (`kernel-folder`), and about tables of tuning in it that were ignored
/// so far (`tuning`). Each Source repeats them.
std::vector<Warning> kernel_folder_warnings();

/// True for PoCL's driver `basic`: it runs kernels on the waiting thread, and several waiting threads can deadlock.
/// Device::open() avoids it unless it is requested by name.
bool may_deadlock(const DeviceInfo& info);

}  // namespace kiln
