#pragma once

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Watches the calls of OpenCL drivers until the process ends, from a thread of its own: for programs that
/// must not hang. Where memory runs out within PoCL, say, it may wait for a lock that nobody lets go.
///
/// A call is stuck where every thread of the process has slept in a futex for over a second.
/// None was woken for a moment: they wait for each other. A long kernel, a compiler or a
/// slow disk is nothing of that. `stuck` is called once, within 2 s, on the watching thread;
/// what it can do is end the process by _exit(). Costs nothing that can be measured.
///
/// \returns false where there is no watch: threads are short, or the system is not Linux, or it hides
///          /proc/self/task/N/syscall
/// Thread safety: any thread; the first call counts.
bool watch_driver(void (*stuck)()) noexcept;

}  // namespace kiln
