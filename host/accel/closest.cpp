#include "accel/closest.h"

#include <algorithm>

#include "base/formatted.h"
#include "cl/tuning.h"
#include "kiln/error.h"
#include "shared/closest.h"

namespace kiln {
namespace {

// Bounds the duration of a launch: a few milliseconds on a GPU, tenths of a second on a CPU.
constexpr std::uint32_t kSamplesPerLaunch = 1U << 20;
static_assert(kSamplesPerLaunch % KILN_CLOSEST_RUN == 0 &&
              KILN_CLOSEST_RUN % KILN_CLOSEST_GROUP == 0);
// Work-group size. A work-item searches a whole run of samples, so work-groups are small, to keep all threads busy on
// small maps.
constexpr std::size_t kRunLocalSize = 16;
constexpr std::size_t kScalarLocalSize = 64;
// Up to this many samples are searched one by one on PoCL: groups would save milliseconds, and their kernel takes 0.2 s
// longer to compile.
constexpr std::uint32_t kMaxSingleSamples = 1U << 14;

}  // namespace

ClosestFinder::ClosestFinder(cl::Context& context, std::shared_ptr<const Tree> tree,
                             Traversal traversal)
    : context_(&context),
      tree_(std::move(tree)),
      traversal_(choose_traversal(context, traversal)),
      is_automatic_(traversal == Traversal::automatic) {}

void ClosestFinder::find(const cl::Array<float>& points, std::uint32_t count,
                         std::uint32_t capacity, const ClosestQuery& query,
                         DeviceCorrespondence& result) const {
  if (!(query.max_distance >= 0 && query.max_distance <= KILN_CLOSEST_FARTHEST)) {
    throw Error(ErrorCode::usage, "The distance to search for the nearest point is " +
                                      decimal(query.max_distance) +
                                      ": it must be 0 to 1048576 frame units.");
  }
  if (count > std::min(capacity, result.capacity)) {
    throw Error(ErrorCode::internal, "The number of samples exceeds the size of their arrays.");
  }
  result.count = count;
  // CPU drivers other than PoCL may take minutes to compile the wide kernel, as Mesa's rusticl did.
  const bool is_scalar = traversal_ != Traversal::cpu;
  const bool searches_singly = is_automatic_ && count <= kMaxSingleSamples;
  const cl::Kernel kernel =
      context_->kernel("closest", is_scalar ? "kiln_closest_scalar" : "kiln_closest_search_run",
                       tree_->defines(is_scalar         ? "-DKILN_CLOSEST_SCALAR=1"
                                      : searches_singly ? "-DKILN_CLOSEST_SINGLE=1"
                                                        : ""));
  const std::size_t local_size = context_->group_size(kernel, context_->tuning().closest_group,
                                                      is_scalar ? kScalarLocalSize : kRunLocalSize);
  kiln_closest_params params{};
  params.max_distance = query.max_distance;
  params.flags = query.two_sided ? KILN_CLOSEST_TWO_SIDED : 0;
  params.capacity = capacity;
  params.result_capacity = result.capacity;
  const std::uint32_t samples_per_item = is_scalar ? 1 : KILN_CLOSEST_RUN;
  for (std::uint32_t first = 0; first < count; first = params.end) {
    params.first = first;
    params.end = first + std::min(count - first, kSamplesPerLaunch);
    const std::size_t items = (params.end - first + samples_per_item - 1) / samples_per_item;
    context_->launch(kernel, items, local_size, params, tree_->nodes, tree_->blocks, points,
                     result.triangle, result.barycentric, result.distance, result.status);
  }
}

}  // namespace kiln
