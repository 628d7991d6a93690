// Checks of the memory budget before allocations.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace kiln {

/// Allocations up to this size skip the budget check.
inline constexpr std::uint64_t kMaxUncheckedBytes = std::uint64_t{16} << 20;

/// a * b, saturated at 2^64 - 1.
std::uint64_t saturated_product(std::uint64_t a, std::uint64_t b);

/// a + b, saturated at 2^64 - 1.
std::uint64_t saturated_sum(std::uint64_t a, std::uint64_t b);

/// "17 MiB", rounded up.
std::string format_mebibytes(std::uint64_t bytes);

/// Peak resident memory of the process in bytes; 0: unknown.
std::uint64_t peak_resident_bytes() noexcept;

/// Accounts for memory that is allocated but not yet written: the system does not count it as resident, so it is
/// subtracted from memory_left(). \param bytes negative when the memory is written or freed
void count_unwritten(std::int64_t bytes) noexcept;

/// During its lifetime, counts memory that later work will allocate as used, so that a lack of memory is detected
/// before the work starts.
class ReservedMemory {
 public:
  explicit ReservedMemory(std::uint64_t bytes) noexcept : bytes_(static_cast<std::int64_t>(bytes)) {
    count_unwritten(bytes_);
  }
  ~ReservedMemory() { count_unwritten(-bytes_); }
  ReservedMemory(const ReservedMemory&) = delete;
  ReservedMemory& operator=(const ReservedMemory&) = delete;

 private:
  std::int64_t bytes_;
};

/// True if this many bytes fit into the budget. Otherwise returns the allocator's free memory to the system and tries
/// again.
bool memory_fits(std::uint64_t bytes);

/// Makes may_allocate() check the calling thread's allocations from now on. For threads of Kiln, not of drivers.
void obey_memory_limit() noexcept;

/// For a program's operator new: false if the calling thread is checked and a block of this size exceeds the budget.
/// Queries the system once per MiB, which takes microseconds.
bool may_allocate(std::size_t bytes);

/// Reports a lack of memory; must throw. \param problem  such as "The maps would take 3 MiB of memory, but only 2 MiB
/// are left"
using MemoryFailure = std::function<void(const std::string& problem)>;

/// Reports a lack of memory in a stage; a MemoryFailure. \throws Error(internal)
[[noreturn]] void fail_for_stage(const std::string& problem);

/// Checks the budget before a large allocation; calls `fail` if it does not fit. Takes tens of microseconds;
/// skipped up to kMaxUncheckedBytes.
/// \param what  subject of the message, such as "The maps"
void require_memory(const std::string& what, std::uint64_t bytes,
                    const MemoryFailure& fail = fail_for_stage);

}  // namespace kiln
