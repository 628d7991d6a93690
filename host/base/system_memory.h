// Queries the system's memory. Implemented in posix/ and windows/.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kiln::os {

/// Resident memory of the process in bytes; 0 if unknown. Does not allocate.
std::uint64_t resident_memory() noexcept;
/// Peak resident memory of the process in bytes; 0 if unknown.
std::uint64_t peak_resident_memory() noexcept;
/// Free memory and swap in bytes; kNoNumber (base/control_group.h) if unknown.
std::uint64_t free_memory_of_machine();
/// Bytes of address space that the process may still allocate; kNoNumber if there is no limit.
std::uint64_t free_address_space();
/// Returns the allocator's free memory to the system.
void return_free_blocks() noexcept;
/// Makes the allocator keep freed memory from now on, since a quarter of the page faults of a bake were for pages that
/// the process had freed before. Only programs should call this, not libraries.
void keep_free_blocks() noexcept;

/// Allocates whole pages of memory, which occupy no physical memory until they are written; null on failure.
void* allocate_pages(std::size_t bytes) noexcept;
/// Frees the memory of one call of allocate_pages(). \param bytes as in that call
void return_pages(void* first, std::size_t bytes) noexcept;
/// Frees the physical memory of those pages of allocate_pages() that lie within a range. Their contents are discarded;
/// the addresses stay valid.
void discard_pages(void* first, std::size_t bytes) noexcept;
/// Makes the system provide physical memory for the pages within a range that is allocated but not yet written, so that
/// several threads can share the clearing of these pages. Contents do not change. If the system does not support this,
/// pages are provided at the first writes.
void populate_pages(void* first, std::size_t bytes) noexcept;

}  // namespace kiln::os
