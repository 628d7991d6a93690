#include "accel/device_bvh.h"

#include <chrono>
#include <string_view>
#include <utility>

#include "kiln/error.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Platform whose work-items run as plain functions on the CPU; the stream kernels are written for it.
constexpr std::string_view kPoclPlatform = "Portable Computing Language";

}  // namespace

Traversal choose_traversal(const cl::Context& context, Traversal requested) {
  const DeviceInfo& info = context.info();
  const Traversal kind = requested != Traversal::automatic ? requested
                         : info.is_gpu                     ? Traversal::gpu
                                                           : Traversal::cpu;
  return kind == Traversal::cpu && info.platform != kPoclPlatform ? Traversal::cpu_single : kind;
}

Tree::Tree(cl::Context& context, std::span<const Vec3> positions,
           std::span<const Triangle> triangles, bool keep) {
  const auto start = Clock::now();
  Bvh bvh = build_bvh(positions, triangles, !keep);
  stats.build_seconds = seconds_since(start);
  stats.triangles = bvh.triangles;
  stats.skipped = bvh.skipped;
  stats.duplicates = bvh.duplicates;
  stats.nodes = bvh.node_count;
  stats.leaves_per_line = bvh.leaves_per_line;
  stats.bytes = bvh.nodes().size_bytes() + bvh.blocks().size_bytes();
  has_prisms_ = bvh.prisms != 0;
  const auto upload = Clock::now();
  nodes = cl::Array<kiln_bvh_node>(context, bvh.nodes());
  blocks = cl::Array<kiln_bvh_block>(context, bvh.blocks());
  stats.upload_seconds = seconds_since(upload);
  if (keep) refit_copy_ = std::make_unique<Bvh>(std::move(bvh));
}

std::string Tree::defines(const std::string& extra_defines) const {
  if (has_prisms_) return extra_defines;
  return extra_defines.empty() ? "-DKILN_BVH_PLAIN=1" : "-DKILN_BVH_PLAIN=1 " + extra_defines;
}

void Tree::refit(cl::Context& context, std::span<const Vec3> positions,
                 std::span<const Triangle> triangles) {
  if (refit_copy_ == nullptr)
    throw Error(ErrorCode::internal, "Internal error: refit of a BVH without refit data.");
  refit_bvh(*refit_copy_, positions, triangles);
  nodes.write(context, refit_copy_->nodes());
  blocks.write(context, refit_copy_->blocks());
}

}  // namespace kiln
