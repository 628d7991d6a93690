#include "detail/device_shading.h"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace kiln {
namespace {

// Maximum number of separate writes, one for each run of consecutive triangles. If there are more
// runs, the whole range is written at once, since each write costs a command.
constexpr std::size_t kMaxRuns = 64;

/// For each run of consecutive triangles, the indices of its first and last triangle in with_uvs;
/// empty if there are more than kMaxRuns.
std::vector<std::pair<std::size_t, std::size_t>> find_runs(const std::vector<std::uint32_t>& list) {
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (i > 0 && list[i] == list[i - 1] + 1) {
      runs.back().second = i;
    } else if (runs.size() == kMaxRuns) {
      return {};
    } else {
      runs.emplace_back(i, i);
    }
  }
  return runs;
}

}  // namespace

cl::Array<kiln_low_shading> device_shading(cl::Context& context, const LowSurface& surface) {
  const auto runs = find_runs(surface.with_uvs);
  if (runs.empty()) return {context, std::span<const kiln_low_shading>(low_shading(surface, true))};
  cl::Array<kiln_low_shading> result(context, surface.triangles.size());
  const std::vector<kiln_low_shading> shading = shading_with_uvs(surface);
  for (const auto& [first, last] : runs) {
    result.write(context, std::span(shading).subspan(first, last + 1 - first),
                 surface.with_uvs[first]);
  }
  return result;
}

}  // namespace kiln
