#include "accel/device_bvh.h"

#include <chrono>
#include <optional>
#include <span>
#include <utility>

#include "accel/bvh_device.h"
#include "accel/bvh_nodes.h"
#include "base/system_memory.h"
#include "cl/tuning.h"
#include "kiln/error.h"

namespace kiln {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// For meshes of at least this many triangles, the allocator's free memory is returned to the system before the build.
// For smaller meshes it is kept, since getting new pages takes time.
constexpr std::size_t kMinTrianglesToTrim = std::size_t{1} << 21;

// Smaller trees are joined on the host and then uploaded, which needs half as many device commands; bakes by parts
// build thousands of small trees.
constexpr std::size_t kMinTrianglesToJoinOnDevice = 4096;

}  // namespace

Traversal choose_traversal(const cl::Context& context, Traversal requested) {
  const DeviceInfo& info = context.info();
  const Traversal kind = requested != Traversal::automatic ? requested
                         : info.is_gpu                     ? Traversal::gpu
                                                           : Traversal::cpu;
  return kind == Traversal::cpu && !is_pocl(info) ? Traversal::cpu_single : kind;
}

Tree::Tree(cl::Context& context, std::span<const Vec3> positions,
           std::span<const Triangle> triangles, bool keep) {
  const auto start = Clock::now();
  // Otherwise the allocator would keep memory that was freed after loading and repairs while the tree is built.
  if (triangles.size() >= kMinTrianglesToTrim) os::return_free_blocks();
  if (!keep && triangles.size() >= context.tuning().min_device_build_triangles) {
    if (std::optional<bvh::DeviceParts> parts =
            bvh::build_on_device(context, positions, triangles)) {
      nodes = std::move(parts->nodes);
      blocks = std::move(parts->blocks);
      stats.triangles = parts->triangles;
      stats.skipped = parts->skipped;
      stats.duplicates = parts->duplicates;
      stats.leaves_per_line = parts->leaves_per_line;
      stats.built_on_device = true;
      stats.upload_seconds = parts->upload_seconds;
      stats.build_seconds = seconds_since(start) - stats.upload_seconds;
      stats.nodes = nodes.size();
      stats.bytes = nodes.buffer().bytes() + blocks.buffer().bytes();
      return;
    }
  }
  bvh::TreeParts parts = bvh::build_parts(positions, triangles, !keep);
  stats.build_seconds = seconds_since(start);
  stats.triangles = parts.triangles;
  stats.skipped = parts.skipped;
  stats.duplicates = parts.duplicates;
  stats.leaves_per_line = parts.leaves_per_line;
  if (keep || parts.has_crowded_nodes || parts.triangles < kMinTrianglesToJoinOnDevice) {
    Bvh bvh = bvh::join_parts(std::move(parts));
    has_prisms_ = bvh.prisms != 0;
    nodes = cl::Array<kiln_bvh_node>(context, bvh.nodes());
    blocks = cl::Array<kiln_bvh_block>(context, bvh.blocks());
    if (keep) refit_copy_ = std::make_unique<Bvh>(std::move(bvh));
  } else {
    // If the device shares the host's memory, the tree is joined in place, in the device's arrays.
    nodes = cl::Array<kiln_bvh_node>(context, parts.node_count());
    blocks = cl::Array<kiln_bvh_block>(context, parts.block_count());
    nodes.write_by(context, nodes.size(), [&](std::span<kiln_bvh_node> to) {
      blocks.write_by(context, blocks.size(),
                      [&](std::span<kiln_bvh_block> leaves) { parts.join(to, leaves); });
    });
  }
  stats.nodes = nodes.size();
  stats.bytes = nodes.buffer().bytes() + blocks.buffer().bytes();
  stats.upload_seconds = seconds_since(start) - stats.build_seconds;
}

Tree::Tree(cl::Context& context, const Stats& given, bool has_prisms, std::size_t node_count,
           std::size_t block_count,
           const std::function<void(std::span<kiln_bvh_node>, std::span<kiln_bvh_block>)>& fill)
    : stats(given),
      nodes(context, node_count),
      blocks(context, block_count),
      has_prisms_(has_prisms) {
  const auto start = Clock::now();
  nodes.write_by(context, nodes.size(), [&](std::span<kiln_bvh_node> to) {
    blocks.write_by(context, blocks.size(),
                    [&](std::span<kiln_bvh_block> leaves) { fill(to, leaves); });
  });
  stats.nodes = nodes.size();
  stats.bytes = nodes.buffer().bytes() + blocks.buffer().bytes();
  stats.upload_seconds = seconds_since(start);
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
