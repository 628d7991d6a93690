// Vectors without initialization, for large arrays that are filled later.
#pragma once

#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace kiln {

/// Allocator that leaves elements uninitialized unless a value is given, so that resizing a vector
/// does not write to its memory.
template <typename T>
struct RawAllocator : std::allocator<T> {
  static_assert(std::is_trivially_copyable_v<T>);
  template <typename U>
  struct rebind {
    using other = RawAllocator<U>;
  };
  template <typename U>
  void construct(U* place) noexcept {
    ::new (static_cast<void*>(place)) U;
  }
  template <typename U, typename... Args>
  void construct(U* place, Args&&... args) {
    ::new (static_cast<void*>(place)) U(std::forward<Args>(args)...);
  }
};

template <typename T>
using RawVector = std::vector<T, RawAllocator<T>>;

}  // namespace kiln
