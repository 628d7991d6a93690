// Replaces the C++ library's allocation functions in the programs. This is not in the library, whose users choose their
// own allocator.
#include <cstddef>
#include <cstdlib>
#include <new>

#include "base/memory.h"
#include "cl/driver_state.h"

// Allocations of the programs' own threads beyond --memory-limit are refused, as if the system had no memory left.
// NOLINTBEGIN(cppcoreguidelines-no-malloc): allocation functions must use malloc
void* operator new(std::size_t bytes) {
  if (kiln::in_driver() || kiln::may_allocate(bytes)) {
    if (void* const block = std::malloc(bytes == 0 ? 1 : bytes)) return block;
  }
  throw std::bad_alloc();
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
// NOLINTEND(cppcoreguidelines-no-malloc)
