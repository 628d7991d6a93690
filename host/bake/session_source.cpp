// Updates of a session's high poly by the caller.
#include "bake/session_impl.h"

namespace kiln {

/// Applies new positions and recomputes normals that depend on them. \param triangles out: triangles with
/// moved corners
void BakeSession::Impl::move_vertices(IndexSet& triangles, HighPolyNormals::Change& normal_change) {
  if (moved.items().empty()) return;
  moved.sort();
  for (const std::uint32_t vertex : moved.items()) {
    for (const std::uint32_t corner : corners_of_vertex.of(vertex)) triangles.add(corner / 3);
  }
  triangles.sort();
  const std::uint32_t first = moved.items().front();
  std::vector<Vec3> positions(moved.items().back() - first + std::size_t{1});
  for (std::size_t i = 0; i < positions.size(); ++i) {
    positions[i] = source.frame.to_frame(high, first + i);
  }
  source.move(first, positions, triangles.items());
  pipeline.move(first, positions);
  normal_change = normals.move(high, source.positions, triangles.items());
}

/// Uploads changed normals. \param triangles in/out: triangles whose normals changed
void BakeSession::Impl::upload_normals(IndexSet& triangles,
                                       const HighPolyNormals::Change& normal_change) {
  cl::Context& context = pipeline.context();
  const CornerNormals& corners = normals.corners();
  if (normal_change.rebuilt) {
    source.attributes = SourceAttributes(context, corners);
    for (std::uint32_t t = 0; t < high.triangles.size(); ++t) triangles.add(t);
    return;
  }
  if (normal_change.entries.empty()) return;
  const std::uint32_t first = normal_change.entries.front();
  const std::size_t count = normal_change.entries.back() - first + std::size_t{1};
  source.attributes.normals.write(context,
                                  std::span<const float>(&corners.normals[first].x, count * 3),
                                  std::size_t{3} * first);
  for (const std::uint32_t entry : normal_change.entries) {
    for (const std::uint32_t corner : normals.corners_of(entry)) triangles.add(corner / 3);
  }
}

HighPolyNormals::Change BakeSession::Impl::update_source() {
  HighPolyNormals::Change normal_change;
  IndexSet triangles(high.triangles.size());
  move_vertices(triangles, normal_change);
  if (!set.items().empty() && !normal_change.rebuilt) {
    set.sort();
    normal_change = normals.set(high, source.positions, set.items());
  }
  set.clear();
  upload_normals(triangles, normal_change);
  update.triangles = triangles.items().size();
  return normal_change;
}

}  // namespace kiln
