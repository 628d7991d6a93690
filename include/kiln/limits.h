#pragma once

#include <cstdint>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Bytes that this process can still take: of the machine's memory, swap included, of its control group
/// and of its address space (ulimit -v). 2^64 - 1 where the system does not say.
/// This and the next three: any thread, at any time.
std::uint64_t free_memory();

/// The most bytes that this process should hold, all told. Until it is set, what it held at the first
/// question and three quarters of what was free then.
///
/// Readers and stages ask before they take much: a file that needs more is refused with Error(input), a
/// stage that would with Error(internal), before the memory is taken. Blocks below 16 MiB, and a
/// device's below 1 MiB, are not asked for: what small blocks come to can pass the limit by a little.
std::uint64_t memory_limit();

/// Bytes that may still be taken: within memory_limit(), and free at all.
std::uint64_t memory_left();

/// Sets memory_limit() for the whole process. \param bytes  0: back to what it is unset
void set_memory_limit(std::uint64_t bytes) noexcept;

/// Limits the threads of Kiln's own work on the host, for farms that run several bakes on a machine. Results
/// do not depend on it. An OpenCL device on the CPU has threads of its own: PoCL's number is in
/// POCL_MAX_PTHREAD_COUNT when it is first used.
/// \param threads  1 to 1024; 0: as many as the machine has, or KILN_THREADS in the environment
/// \throws Error(usage), `thread-limit`
/// Thread safety: any time, from any thread; work that has begun keeps its threads.
void set_thread_limit(int threads);

/// Largest number of threads that Kiln's own work takes: 1 or more.
int thread_limit();

}  // namespace kiln
