// Updates of a session's high poly by the caller.
#include "bake/session_impl.h"

namespace kiln {

/// Applies new positions and recomputes normals that depend on them. \param triangles out: triangles with
/// moved corners
void BakeSession::Impl::move_vertices(IndexSet& triangles, HighPolyNormals::Change& change) {
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
  change = normals.move(high, source.positions, triangles.items());
}

/// Uploads changed normals. \param triangles in/out: triangles whose normals changed
void BakeSession::Impl::upload_normals(IndexSet& triangles, const HighPolyNormals::Change& change) {
  cl::Context& context = pipeline.context();
  const CornerNormals& corners = normals.corners();
  if (change.rebuilt) {
    source.attributes = SourceAttributes(context, corners);
    for (std::uint32_t t = 0; t < high.triangles.size(); ++t) triangles.add(t);
    return;
  }
  if (change.entries.empty()) return;
  const std::uint32_t first = change.entries.front();
  const std::size_t count = change.entries.back() - first + std::size_t{1};
  source.attributes.normals.write(context,
                                  std::span<const float>(&corners.normals[first].x, count * 3),
                                  std::size_t{3} * first);
  for (const std::uint32_t entry : change.entries) {
    for (const std::uint32_t corner : normals.corners_of(entry)) triangles.add(corner / 3);
  }
}

HighPolyNormals::Change BakeSession::Impl::update_source() {
  HighPolyNormals::Change change;
  IndexSet triangles(high.triangles.size());
  move_vertices(triangles, change);
  if (!set.items().empty() && !change.rebuilt) {
    set.sort();
    change = normals.set(high, source.positions, set.items());
  }
  set.clear();
  upload_normals(triangles, change);
  update.triangles = triangles.items().size();
  return change;
}

}  // namespace kiln
