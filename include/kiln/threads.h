#pragma once

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Limits the threads of Kiln's own work on the host, for farms that run several bakes on a machine. Results
/// do not depend on it. An OpenCL device on the CPU has threads of its own: PoCL's number is in
/// POCL_MAX_PTHREAD_COUNT when it is first used.
/// \param threads  1 to 1024; 0: as many as the machine has, or KILN_THREADS in the environment
/// \throws Error(usage), `thread-limit`
/// Thread safety: any time, from any thread; work that has begun keeps its threads.
void set_thread_limit(int threads);

/// How many threads Kiln's own work takes at most: 1 or more.
int thread_limit();

}  // namespace kiln
