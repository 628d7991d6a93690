// Memory is asked for before it is taken.
#pragma once

#include <cstdint>
#include <string>

#include "kiln/memory.h"

namespace kiln {

/// Blocks up to this are not asked for.
inline constexpr std::uint64_t kLittleMemory = std::uint64_t{16} << 20;

/// Bytes that may still be taken: within the limit, and free at all.
std::uint64_t memory_left();

/// a * b, at most 2^64 - 1.
std::uint64_t capped_product(std::uint64_t a, std::uint64_t b);

/// "17 MiB", rounded up.
std::string mebibytes(std::uint64_t bytes);

/// Asks for a block that a stage is about to take.
/// \param what  such as "The maps", for the message
/// \throws Error(internal) where it does not fit
void require_memory(const char* what, std::uint64_t bytes);

}  // namespace kiln
