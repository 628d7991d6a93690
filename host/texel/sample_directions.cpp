#include "texel/sample_directions.h"

#include <vector>

namespace kiln {
namespace {

void add(const Vec3& v, std::vector<float>& packed_values) {
  packed_values.insert(packed_values.end(), {v.x, v.y, v.z});
}

/// Packs the hard edges near each triangle into the kernel's layout.
std::vector<float> pack_near_edges(const HardEdges& hard, const HardEdges::EdgesOfTriangles& near,
                                   std::span<const float> widths) {
  std::vector<float> edges;
  edges.reserve(7 * near.edge.size());
  for (const std::uint32_t e : near.edge) {
    add(hard.edges[e].from, edges);
    add(hard.edges[e].along, edges);
    edges.push_back(widths[e]);
  }
  return edges;
}

}  // namespace

SampleDirections::SampleDirections(cl::Context& context, const LowSurface& surface,
                                   const std::vector<float>& edges,
                                   const std::vector<std::uint32_t>& first, bool painted)
    : blends_directions_(true), painted_(painted) {
  std::vector<float> normals, weights;
  normals.reserve(9 * surface.triangles.size());
  for (const auto& corners : surface.triangles) {
    for (const LowSurface::Corner& corner : corners) {
      add(corner.normal, normals);
      if (painted) weights.push_back(corner.straight);
    }
  }
  // Even unused kernel arguments must not be empty arrays.
  const std::vector<float> none(7);
  normals_ = cl::Array<float>(context, std::span<const float>(normals));
  weights_ = cl::Array<float>(context, std::span<const float>(painted ? weights : none));
  edges_ = cl::Array<float>(context, std::span<const float>(edges.empty() ? none : edges));
  first_edge_of_triangle_ =
      cl::Array<std::uint32_t>(context, std::span<const std::uint32_t>(first));
}

SampleDirections::SampleDirections(cl::Context& context, const LowSurface& surface)
    : SampleDirections(context, surface, {},
                       std::vector<std::uint32_t>(surface.triangles.size() + 1, 0), true) {}

SampleDirections::SampleDirections(cl::Context& context, const LowSurface& surface,
                                   const HardEdges& hard, std::span<const float> widths) {
  if (widths.empty()) {
    *this = SampleDirections(context, surface, {},
                             std::vector<std::uint32_t>(surface.triangles.size() + 1, 0), false);
    return;
  }
  const HardEdges::EdgesOfTriangles near = hard.find_near(surface, widths);
  *this =
      SampleDirections(context, surface, pack_near_edges(hard, near, widths), near.first, false);
}

void SampleDirections::set_directions(cl::Context& context, TexelBand& band) const {
  if (!blends_directions() || band.sample_count == 0) return;
  context.launch(context.kernel("turn", "kiln_texel_blend_directions"), band.sample_count, kLocal,
                 band.sample_count, band.capacity, painted_ ? 1U : 0U, normals_, weights_,
                 first_edge_of_triangle_, edges_, band.triangle, band.barycentric, band.points);
}

}  // namespace kiln
