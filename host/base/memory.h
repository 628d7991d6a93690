// Memory is asked for before it is taken.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "kiln/limits.h"

namespace kiln {

/// Blocks up to this are not asked for.
inline constexpr std::uint64_t kLittleMemory = std::uint64_t{16} << 20;

/// a * b, at most 2^64 - 1.
std::uint64_t capped_product(std::uint64_t a, std::uint64_t b);

/// "17 MiB", rounded up.
std::string mebibytes(std::uint64_t bytes);

/// Most memory the process ever had resident, bytes; 0 where the system does not say.
std::uint64_t peak_resident_bytes() noexcept;

/// Counts memory that was taken but not yet written to, which the system does not count as held: memory_left() is so
/// much less. \param bytes  below 0 once it is written to, or given back
void count_untouched(std::int64_t bytes) noexcept;

/// Counts memory that work still to come will take, as long as it lives: what is asked for first fails then, not late.
class ReservedMemory {
 public:
  explicit ReservedMemory(std::uint64_t bytes) noexcept : bytes_(static_cast<std::int64_t>(bytes)) {
    count_untouched(bytes_);
  }
  ~ReservedMemory() { count_untouched(-bytes_); }
  ReservedMemory(const ReservedMemory&) = delete;
  ReservedMemory& operator=(const ReservedMemory&) = delete;

 private:
  std::int64_t bytes_;
};

/// True if so many bytes fit into what is left; else what the allocator keeps of freed memory is given back first.
bool memory_fits(std::uint64_t bytes);

/// From here on the calling thread's blocks are asked for by may_take(): it is none of a driver's.
void obey_memory_limit() noexcept;

/// For a program's operator new: false where the calling thread obeys the limit and a block of so many bytes would pass
/// it. Looks once in a MiB, some microseconds.
bool may_take(std::size_t bytes);

/// Says that memory is short; must throw. \param problem  such as "The maps would take 3 MiB of memory, but
/// only 2 MiB are left"
using MemoryFailure = std::function<void(const std::string& problem)>;

/// For stages. \throws Error(internal)
[[noreturn]] void fail_for_stage(const std::string& problem);

/// Asks for a block that a reader or a stage is about to take: calls `fail` where it does not fit. Takes
/// some tens of microseconds; blocks up to kLittleMemory are not looked up.
/// \param what  such as "The maps", for the message
void require_memory(const std::string& what, std::uint64_t bytes,
                    const MemoryFailure& fail = fail_for_stage);

}  // namespace kiln
