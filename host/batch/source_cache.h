// Caches high polys on the device, so that several bakes can use them.
#pragma once

#include <cstddef>
#include <future>
#include <list>
#include <mutex>
#include <string>

#include "kiln/source.h"

namespace kiln {

/// Sources keyed by the contents of their meshes, so that bakes of one high poly share one BVH. At most `capacity`
/// sources stay in memory, the most recently used ones. Thread-safe.
class SourceCache {
 public:
  explicit SourceCache(std::size_t capacity) : capacity_(capacity) {}

  /// Returns the cached source of an equal mesh, or builds a new source. Threads that request the same mesh wait
  /// until its source is built.
  Source get(const Device& device, const Mesh& mesh, RayTraversal traversal);
  /// Returns the number of sources that were built, for tests.
  std::size_t built_count() const;

 private:
  struct Entry {
    std::string key;
    std::shared_future<Source> source;
  };
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // Entries, the most recently used one first
  std::size_t built_count_ = 0;
};

}  // namespace kiln
