#pragma once

#include <cstdint>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Bytes that this process can still allocate: the minimum of the memory that the machine (swap
/// included), its control group and its address space (ulimit -v) leave. 2^64 - 1 if the system does
/// not report it. This and the next three functions may be called from any thread at any time.
std::uint64_t free_memory();

/// Largest number of bytes that this process should use in total. Unless it was set, it is the
/// process's size at the first call, plus 3/4 of the memory that was free then.
///
/// Readers and stages check large allocations against it before they allocate: a file that needs more
/// is refused with Error(input), a stage that needs more with Error(internal). Allocations below 16
/// MiB, and device buffers below 1 MiB, skip the check, so the total can exceed the limit slightly.
std::uint64_t memory_limit();

/// Number of bytes that may still be allocated: the minimum of free_memory() and of what
/// memory_limit() leaves.
std::uint64_t memory_left();

/// Sets memory_limit() for the whole process. \param bytes  0: restores the default
void set_memory_limit(std::uint64_t bytes) noexcept;

/// Limits the threads of Kiln's own work on the host, for farms that run several bakes on a machine. Results
/// do not depend on it. An OpenCL device on the CPU has threads of its own: PoCL reads their number from
/// POCL_MAX_PTHREAD_COUNT at its first use.
/// \param threads  1 to 1024; 0: KILN_THREADS of the environment, else the number of the machine's cores
/// \throws Error(usage), `thread-limit`
/// Thread safety: any time, from any thread; work that is already running keeps its number of threads.
void set_thread_limit(int threads);

/// Largest number of threads that Kiln's own work uses: 1 or more.
int thread_limit();

}  // namespace kiln
