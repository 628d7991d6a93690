// Validates a match from any source.
#include <atomic>
#include <cmath>
#include <string>

#include "base/formatted.h"
#include "base/parallel.h"
#include "kiln/validate.h"
#include "shared/match.h"

namespace kiln {
namespace {

// Maximum side of a map in samples: 16384 texels times 16.
constexpr std::uint32_t kMaxSideInSamples = 16384 * 16;
constexpr std::uint32_t kMaxSamples = 16;
// Tolerance for barycentric weights outside of [0, 1].
constexpr float kWeightTolerance = 1e-3F;

static_assert(static_cast<int>(SampleStatus::outermost) + 1 == KILN_STATUS_COUNT);

bool is_weight(float value) {
  return value >= -kWeightTolerance && value <= 1.0F + kWeightTolerance;
}

/// Returns the identifier of the error in a sample, or null if it is valid. For samples without a point, only the
/// status is checked.
const char* sample_fault(const Match& match, std::size_t i) {
  const std::uint8_t status = match.status[i];
  if (status >= KILN_STATUS_COUNT) return "match-status";
  if (status == KILN_STATUS_NONE || status == KILN_STATUS_MISS) return nullptr;
  if (match.triangle[i] >= match.source_triangles) return "match-triangle";
  const bool weights =
      is_weight(match.u[i]) && is_weight(match.v[i]) && is_weight(match.u[i] + match.v[i]);
  if (!weights) return "match-weight";
  return std::isfinite(match.distance[i]) ? nullptr : "match-distance";
}

void check_sizes(const Match& match) {
  const std::size_t count = std::size_t{match.width} * match.height;
  if (count != 0 && match.width <= kMaxSideInSamples && match.height <= kMaxSideInSamples &&
      match.samples >= 1 && match.samples <= kMaxSamples && match.width % match.samples == 0 &&
      match.height % match.samples == 0 && match.triangle.size() == count &&
      match.u.size() == count && match.v.size() == count && match.distance.size() == count &&
      match.status.size() == count) {
    return;
  }
  throw Error(ErrorCode::input,
              "A match of " + std::to_string(match.width) + " x " + std::to_string(match.height) +
                  " with " + std::to_string(match.samples) +
                  " samples is inconsistent: its arrays (" + std::to_string(match.triangle.size()) +
                  " triangle, " + std::to_string(match.u.size()) + " u, " +
                  std::to_string(match.v.size()) + " v, " + std::to_string(match.distance.size()) +
                  " distance, " + std::to_string(match.status.size()) +
                  " status) must have width x height elements, and both sides must be multiples of "
                  "samples (1 to 16).",
              "match-size");
}

}  // namespace

void validate(const Match& match) {
  check_sizes(match);
  const std::size_t count = match.status.size();
  std::atomic<std::size_t> first_faulty{count};
  parallel_for(count, std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (sample_fault(match, i) == nullptr) continue;
      std::size_t seen = first_faulty;
      while (i < seen && !first_faulty.compare_exchange_weak(seen, i)) {
      }
      return;
    }
  });
  if (first_faulty == count) return;
  const std::size_t i = first_faulty;
  throw Error(ErrorCode::input,
              "A match's sample " + std::to_string(i % match.width) + ", " +
                  std::to_string(i / match.width) + " has triangle " +
                  std::to_string(match.triangle[i]) + " of " +
                  std::to_string(match.source_triangles) + ", weights " + decimal(match.u[i]) +
                  " and " + decimal(match.v[i]) + ", distance " + decimal(match.distance[i]) +
                  " and status " + std::to_string(match.status[i]) + ", which is invalid.",
              sample_fault(match, i));
}

}  // namespace kiln
