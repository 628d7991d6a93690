// Large arrays whose memory is allocated from the system in whole pages, and returned to it as soon as it is freed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>
#include <utility>

#include "base/memory.h"
#include "base/system_memory.h"

namespace kiln {

/// Arrays of at least this many bytes are allocated as pages of the system. Otherwise, programs that keep freed memory
/// (os::keep_free_blocks()) would keep the largest temporary arrays of a build in addition to its result.
inline constexpr std::size_t kMinPagedBytes = std::size_t{4} << 20;

/// Alignment of smaller arrays: the largest of a type in OpenCL, so that devices can use the memory in place.
inline constexpr std::align_val_t kArrayAlignment{128};

/// Allocator of containers that may become large. Reserved memory that is not written occupies no physical pages.
template <typename T>
struct PageAllocator {
  using value_type = T;

  PageAllocator() = default;
  template <typename U>
  PageAllocator(const PageAllocator<U>& /*other*/) noexcept {}

  T* allocate(std::size_t count) {
    if (count > SIZE_MAX / sizeof(T)) throw std::bad_array_new_length();
    const std::size_t bytes = count * sizeof(T);
    if (!may_allocate(bytes)) throw std::bad_alloc();
    if (bytes < kMinPagedBytes) return static_cast<T*>(::operator new(bytes, kArrayAlignment));
    void* const pages = os::allocate_pages(bytes);
    if (pages == nullptr) throw std::bad_alloc();
    return static_cast<T*>(pages);
  }
  void deallocate(T* data, std::size_t count) noexcept {
    const std::size_t bytes = count * sizeof(T);
    if (bytes < kMinPagedBytes) return ::operator delete(data, kArrayAlignment);
    os::return_pages(data, bytes);
  }
  friend bool operator==(const PageAllocator& /*a*/, const PageAllocator& /*b*/) { return true; }
};

/// An array of fixed size whose elements are not initialized.
template <typename T>
class PageArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  PageArray() = default;
  explicit PageArray(std::size_t size)
      : data_(size == 0 ? nullptr : PageAllocator<T>().allocate(size)), size_(size) {}
  PageArray(PageArray&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  PageArray& operator=(PageArray&& other) noexcept {
    PageArray moved_array(std::move(other));
    std::swap(data_, moved_array.data_);
    std::swap(size_, moved_array.size_);
    return *this;
  }
  PageArray(const PageArray&) = delete;
  PageArray& operator=(const PageArray&) = delete;
  ~PageArray() {
    if (data_ != nullptr) PageAllocator<T>().deallocate(data_, size_);
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return size_; }
  T& operator[](std::size_t i) { return data_[i]; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  operator std::span<const T>() const { return {data_, size_}; }

  /// Returns the memory of elements that are not read any more to the system: the pages that hold no other elements.
  /// Arrays without pages of their own keep their memory. Other threads may use other elements meanwhile.
  void discard(std::size_t first, std::size_t last) noexcept {
    if (size_ * sizeof(T) < kMinPagedBytes || first >= last) return;
    os::discard_pages(data_ + first, (last - first) * sizeof(T));
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace kiln
