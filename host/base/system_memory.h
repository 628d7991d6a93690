// What the system says of memory. Implemented in posix/ and windows/.
#pragma once

#include <cstddef>
#include <cstdint>

namespace kiln::os {

/// Bytes that the process holds in memory; 0: unknown. Allocates nothing.
std::uint64_t resident_memory() noexcept;
/// The most that it has held so far; 0: unknown.
std::uint64_t peak_resident_memory() noexcept;
/// Bytes of memory and swap that nobody uses; kNoNumber (base/control_group.h): unknown.
std::uint64_t free_in_machine();
/// Bytes of addresses that the process may still take; kNoNumber: no limit.
std::uint64_t free_addresses();
/// Gives the allocator's free memory back to the system.
void return_free_blocks() noexcept;
/// From now on, the allocator keeps memory that is freed: a quarter of the page faults of a bake were of pages that it had
/// had before. For programs, not for libraries.
void keep_free_blocks() noexcept;

/// Memory in whole pages, which take no memory until they are written; null: the system has none.
void* take_pages(std::size_t bytes) noexcept;
/// Returns all that one call of take_pages() gave. \param bytes  as in that call
void return_pages(void* first, std::size_t bytes) noexcept;
/// Returns the memory of those pages of take_pages() that lie within a range. Their contents are lost; the addresses
/// stay valid.
void discard_pages(void* first, std::size_t bytes) noexcept;

}  // namespace kiln::os
