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
/// stage that would with Error(internal), before the memory is taken. Blocks below 16 MiB are not asked
/// for, so the limit can be passed by a little.
std::uint64_t memory_limit();

/// Bytes that may still be taken: within memory_limit(), and free at all.
std::uint64_t memory_left();

/// Sets memory_limit() for the whole process. \param bytes  0: back to what it is unset
void set_memory_limit(std::uint64_t bytes) noexcept;

}  // namespace kiln
