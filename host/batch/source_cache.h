// High polys on the device that several bakes share.
#pragma once

#include <cstddef>
#include <future>
#include <list>
#include <mutex>
#include <string>

#include "kiln/source.h"

namespace kiln {

/// Sources by the contents of their meshes: bakes of one high poly build one hierarchy. Keeps the last few alone. Any thread.
class SourceCache {
 public:
  explicit SourceCache(std::size_t kept) : kept_(kept) {}

  /// The source of an equal mesh, or a new one. A thread waits while another one makes it.
  Source get(const Device& device, const Mesh& mesh, RayTraversal traversal);
  /// Number of sources that were made.
  std::size_t made() const;

 private:
  struct Entry {
    std::string key;
    std::shared_future<Source> source;
  };
  const std::size_t kept_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // the one that was used last first
  std::size_t made_ = 0;
};

}  // namespace kiln
