#include "base/memory.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <string>

#include "base/control_group.h"
#include "base/option.h"
#include "base/system_memory.h"
#include "kiln/error.h"
#include "kiln/limits.h"

namespace kiln {
namespace {

constexpr std::uint64_t kUnlimited = kNoNumber;

std::atomic<std::uint64_t> explicit_limit{0};
std::atomic<std::int64_t> unwritten_bytes{0};

std::uint64_t default_limit() {
  const std::uint64_t free = free_memory();
  return free == kUnlimited ? kUnlimited : os::resident_memory() + free / 4 * 3;
}

}  // namespace

std::uint64_t peak_resident_bytes() noexcept { return os::peak_resident_memory(); }

std::uint64_t saturated_product(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > kUnlimited / b ? kUnlimited : a * b;
}

std::uint64_t saturated_sum(std::uint64_t a, std::uint64_t b) {
  return b > kUnlimited - a ? kUnlimited : a + b;
}

std::string format_mebibytes(std::uint64_t bytes) {
  return std::to_string((bytes >> 20) + ((bytes & 0xFFFFF) != 0 ? 1 : 0)) + " MiB";
}

std::uint64_t free_memory() {
  return std::min(
      {os::free_memory_of_machine(), free_in_control_groups(), os::free_address_space()});
}

std::uint64_t memory_limit() {
  const std::uint64_t set = explicit_limit;
  if (set != 0) return set;
  // The variable has no dynamic initializer, since allocations of an initializer would query the
  // limit recursively.
  static std::atomic<std::uint64_t> cached_limit{0};
  std::uint64_t known_limit = cached_limit;
  if (known_limit != 0) return known_limit;
  const std::uint64_t limit = default_limit();
  return cached_limit.compare_exchange_strong(known_limit, limit) ? limit : known_limit;
}

void set_memory_limit(std::uint64_t bytes) noexcept { explicit_limit = bytes; }

std::uint64_t memory_left() {
  const auto future_bytes = static_cast<std::uint64_t>(std::max<std::int64_t>(0, unwritten_bytes));
  return remaining_bytes(
      std::min(remaining_bytes(memory_limit(), os::resident_memory()), free_memory()),
      future_bytes);
}

void count_unwritten(std::int64_t bytes) noexcept { unwritten_bytes += bytes; }

bool memory_fits(std::uint64_t bytes) {
  if (bytes <= memory_left()) return true;
  os::return_free_blocks();
  return bytes <= memory_left();
}

namespace {
thread_local bool obeys_limit = false;
thread_local std::size_t unchecked_bytes = 0;
}  // namespace

void obey_memory_limit() noexcept { obeys_limit = true; }

bool may_allocate(std::size_t bytes) {
  constexpr std::size_t kBytesBetweenChecks = std::size_t{1} << 20;
  if (!obeys_limit ||
      (unchecked_bytes += std::min(bytes, kBytesBetweenChecks)) < kBytesBetweenChecks)
    return true;
  unchecked_bytes = 0;
  const auto fits = [bytes] {
    const auto future_bytes =
        static_cast<std::uint64_t>(std::max<std::int64_t>(0, unwritten_bytes));
    return os::resident_memory() + future_bytes + bytes <= memory_limit();
  };
  if (fits()) return true;
  os::return_free_blocks();
  return fits();
}

void fail_for_stage(const std::string& problem) {
  throw Error(ErrorCode::internal, problem +
                                       ". Use smaller inputs or a smaller size, or raise the " +
                                       option("memory_limit") + ".");
}

void require_memory(const std::string& what, std::uint64_t bytes, const MemoryFailure& fail) {
  if (bytes <= kMaxUncheckedBytes) return;
  if (memory_fits(bytes)) return;
  const std::uint64_t available = memory_left();
  fail(what + " would take " + format_mebibytes(bytes) + " of memory, but only " +
       format_mebibytes(available) + " are left of the memory limit");
}

}  // namespace kiln
