// Replacements of the C++ library's allocation, for the programs. Not in a library: its callers' blocks are none of its
// business.
#include <cstddef>
#include <cstdlib>
#include <new>

#include "base/memory.h"
#include "cl/driver_state.h"

// Blocks of the programs' own threads beyond --memory-limit are refused, as if the system had none.
// NOLINTBEGIN(cppcoreguidelines-no-malloc): what they are made of
void* operator new(std::size_t bytes) {
  if (kiln::in_driver() || kiln::may_take(bytes)) {
    if (void* const block = std::malloc(bytes == 0 ? 1 : bytes)) return block;
  }
  throw std::bad_alloc();
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
// NOLINTEND(cppcoreguidelines-no-malloc)
