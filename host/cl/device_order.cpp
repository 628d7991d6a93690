#include "cl/device_order.h"

#include <algorithm>
#include <cstddef>

namespace kiln {

bool is_preferred(const DeviceRank& a, const DeviceRank& b) {
  if (a.is_gpu != b.is_gpu) return a.is_gpu;
  if (a.is_gpu && a.is_integrated != b.is_integrated) return b.is_integrated;
  if (a.memory_bytes != b.memory_bytes) return a.memory_bytes > b.memory_bytes;
  return a.compute_units > b.compute_units;
}

std::string explain_preference(const std::vector<DeviceRank>& ranks) {
  const DeviceRank& first = ranks.front();
  const auto count = [&](const auto& has) {
    return static_cast<std::size_t>(std::count_if(ranks.begin(), ranks.end(), has));
  };
  if (!first.is_gpu) return "since there is no GPU";
  if (count([](const DeviceRank& r) { return r.is_gpu; }) == 1) return "the only GPU";
  const std::string kind = first.is_integrated ? "integrated GPU" : "discrete GPU";
  const auto is_rival = [&](const DeviceRank& r) {
    return r.is_gpu && r.is_integrated == first.is_integrated;
  };
  if (count(is_rival) == 1) return "the only " + kind;
  const auto has_same_memory = [&](const DeviceRank& r) {
    return is_rival(r) && r.memory_bytes == first.memory_bytes;
  };
  if (count(has_same_memory) == 1) return "the " + kind + " with the most memory";
  const auto has_same_memory_and_units = [&](const DeviceRank& r) {
    return has_same_memory(r) && r.compute_units == first.compute_units;
  };
  return count(has_same_memory_and_units) == 1 ? "the " + kind + " with the most compute units"
                                               : "the first of several equal GPUs";
}

}  // namespace kiln
