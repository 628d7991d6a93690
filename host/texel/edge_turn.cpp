#include "texel/edge_turn.h"

#include <algorithm>

#include "mesh/hard_edges.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;

void add(const Vec3& v, std::vector<float>& values) {
  values.insert(values.end(), {v.x, v.y, v.z});
}

}  // namespace

EdgeTurn::EdgeTurn(cl::Context& context, const LowSurface& surface, RayDirection direction,
                   double width) {
  if (direction == RayDirection::averaged || surface.has_cage_mesh) return;
  const HardEdges hard = HardEdges::of(surface);
  if (hard.edges.empty()) return;
  width_ = static_cast<float>(width);
  const std::size_t count = surface.triangles.size();
  std::vector<float> normals;
  normals.reserve(9 * count);
  for (const auto& corners : surface.triangles) {
    for (const LowSurface::Corner& corner : corners) add(corner.normal, normals);
  }
  std::vector<float> edges;
  std::vector<std::uint32_t> first(count + 1, 0);
  if (direction == RayDirection::automatic) {
    const HardEdges::Near near = hard.near(surface, width_);
    for (const std::uint32_t e : near.edge) {
      add(hard.edges[e].from, edges);
      add(hard.edges[e].along, edges);
    }
    first = near.first;
  }
  if (edges.empty()) edges.resize(6);  // arrays have elements
  normals_ = cl::Array<float>(context, std::span<const float>(normals));
  edges_ = cl::Array<float>(context, std::span<const float>(edges));
  first_edges_ = cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(first));
}

void EdgeTurn::apply(cl::Context& context, TexelBand& band) const {
  if (!turns() || band.sample_count == 0) return;
  context.launch(context.kernel("turn", "kiln_texel_turn"), band.sample_count, kLocal,
                 band.sample_count, band.capacity, width_, normals_, first_edges_, edges_,
                 band.triangle, band.barycentric, band.points);
}

}  // namespace kiln
