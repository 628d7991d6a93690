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
std::uint64_t free_in_machine();
/// Bytes of address space that the process may still allocate; kNoNumber if there is no limit.
std::uint64_t free_addresses();
/// Returns the allocator's free memory to the system.
void return_free_blocks() noexcept;
/// Makes the allocator keep freed memory from now on: a quarter of the page faults of a bake were for pages that the
/// process had freed before. For programs, not for libraries.
void keep_free_blocks() noexcept;

/// Memory in whole pages, which take no memory until they are written; null: the system has none.
void* take_pages(std::size_t bytes) noexcept;
/// Returns all that one call of take_pages() gave. \param bytes  as in that call
void return_pages(void* first, std::size_t bytes) noexcept;
/// Returns the memory of those pages of take_pages() that lie within a range. Their contents are lost; the addresses
/// stay valid.
void discard_pages(void* first, std::size_t bytes) noexcept;
/// Gives memory to the pages within a range that is allocated but not yet written, so that threads can share the
/// system's clearing of these pages. Contents stay. Where the system cannot do that, the first writes do it.
void populate_pages(void* first, std::size_t bytes) noexcept;

}  // namespace kiln::os
