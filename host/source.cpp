#include "source.h"

namespace kiln {

Source::Source(const Device& device, const Mesh& high, RayTraversal traversal) {
  if (high.triangles.empty()) {
    throw Error(ErrorCode::input,
                "'" + high.name + "' has no triangles: there is nothing to bake from.");
  }
  cl::Context& context = device.context();
  auto impl = std::make_shared<Impl>(Impl{device, Frame::of(high), nullptr, {}, {}, {}});
  const std::uint64_t bytes_before = context.device_bytes();
  const std::vector<Vec3> positions = impl->frame.to_frame(high);

  Traversal kind = Traversal::automatic;
  if (traversal == RayTraversal::cpu) kind = Traversal::cpu;
  if (traversal == RayTraversal::gpu) kind = Traversal::gpu;
  impl->rays = std::make_unique<RayCaster>(context, positions, high.triangles, kind);
  impl->attributes = SourceAttributes(context, corner_normals(high, positions));

  const RayCaster::Stats& tree = impl->rays->stats();
  impl->stats.triangles = high.triangles.size();
  impl->stats.skipped_triangles = tree.skipped;
  impl->stats.device_bytes = context.device_bytes() - bytes_before;
  impl->stats.build_seconds = tree.build_seconds;
  impl->stats.diagonal = impl->frame.diagonal;
  if (tree.skipped == high.triangles.size()) {
    throw Error(ErrorCode::input,
                "All " + std::to_string(tree.skipped) + " triangles of '" + high.name +
                    "' have no area or are not finite: nothing can be baked from it.");
  }
  if (tree.skipped != 0) {
    impl->warnings.push_back({"source-skipped",
                              std::to_string(tree.skipped) + " of " +
                                  std::to_string(high.triangles.size()) + " triangles of '" +
                                  high.name +
                                  "' have no area or are not finite; rays pass through them.",
                              tree.skipped});
  }
  impl_ = std::move(impl);
}

const Source::Stats& Source::stats() const { return impl_->stats; }
const std::vector<Warning>& Source::warnings() const { return impl_->warnings; }

}  // namespace kiln
