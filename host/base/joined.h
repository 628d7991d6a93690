// Lists that threads made piece by piece, as one.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/parallel.h"

namespace kiln {

/// One list of all parts, in order, copied on all threads. Each part's own is given back to the system.
/// \param list  which member of a part
template <typename T, typename Part>
std::vector<T> joined(std::vector<Part>& parts, std::vector<T> Part::*list) {
  std::vector<std::size_t> first(parts.size() + 1, 0);
  for (std::size_t i = 0; i < parts.size(); ++i) first[i + 1] = first[i] + (parts[i].*list).size();
  std::vector<T> result(first.back());
  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::vector<T>& part = parts[i].*list;
      std::copy(part.begin(), part.end(), result.begin() + static_cast<std::ptrdiff_t>(first[i]));
      std::vector<T>().swap(part);
    }
  });
  return result;
}

}  // namespace kiln
