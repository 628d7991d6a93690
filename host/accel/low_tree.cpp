#include "accel/low_tree.h"

namespace kiln {

std::shared_ptr<const LowTree> LowTree::of_surface(cl::Context& context,
                                                   const LowSurface& surface) {
  return surface.made->get<LowTree>([&] {
    LowTree low;
    for (const std::size_t t : surface.usable_triangles()) {
      const auto first = static_cast<std::uint32_t>(low.positions.size());
      const auto& [a, b, c] = surface.triangles[t];
      low.positions.insert(low.positions.end(), {a.position, b.position, c.position});
      low.triangles.push_back({first, first + 1, first + 2});
      low.of.push_back(static_cast<std::uint32_t>(t));
      const Vec3d normal = cross(to_double(b.position) - to_double(a.position),
                                 to_double(c.position) - to_double(a.position));
      low.normals.push_back(normal * (1 / length(normal)));
    }
    low.tree = std::make_shared<Tree>(context, low.positions, low.triangles);
    return low;
  });
}

}  // namespace kiln
