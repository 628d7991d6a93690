#include "mesh/mesh_stream.h"

#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include "base/memory.h"
#include "base/option.h"
#include "base/progress_guard.h"
#include "kiln/error.h"
#include "mesh/box.h"
#include "mesh/frame.h"
#include "mesh/steps.h"
#include "mesh/usable.h"

namespace kiln {

std::vector<Vec3> read_all_positions(const MeshStream& mesh) {
  const std::size_t vertices = mesh.vertex_count();
  require_memory("The positions of '" + mesh.path() + "'", vertices * sizeof(Vec3));
  ProgressGuard::poll_within_stage("reading the high poly's vertices");
  std::vector<Vec3> positions(vertices);
  parallel_for(vertices, kStreamedElementsPerRead, [&](std::size_t begin, std::size_t end) {
    mesh.read_positions(begin, std::span(positions).subspan(begin, end - begin));
  });
  return positions;
}

Mesh sample_of(const MeshStream& mesh, std::size_t triangles) {
  Mesh sample;
  sample.name = mesh.name();
  const std::size_t stride = mesh.triangle_count() / triangles + 1;
  for (std::size_t t = 0; t < mesh.triangle_count(); t += stride) {
    Triangle triangle{};
    mesh.read_triangles(t, std::span(&triangle, 1));
    for (std::uint32_t& corner : triangle) {
      Vec3 position;
      mesh.read_positions(corner, std::span(&position, 1));
      sample.positions.push_back(position);
      corner = static_cast<std::uint32_t>(sample.positions.size() - 1);
    }
    sample.triangles.push_back(triangle);
  }
  return sample;
}

Bounds bounds_of(const MeshStream& mesh, std::span<const Vec3> positions) {
  Box<Vec3> bounds;
  std::mutex mutex;
  for_each_piece(mesh, 0, mesh.triangle_count(),
                 [&](std::size_t, std::span<const Triangle> triangles) {
                   Box<Vec3> box;
                   for (const Triangle& triangle : triangles) {
                     if (!has_area(positions, triangle)) continue;
                     for (const std::uint32_t corner : triangle) box.add(positions[corner]);
                   }
                   const std::lock_guard lock(mutex);
                   bounds.join(box);
                 });
  // Adding 0 turns -0 into +0.
  const auto axes = [](const Vec3& p) {
    return std::array<double, 3>{p.x + 0.0, p.y + 0.0, p.z + 0.0};
  };
  return {axes(bounds.low), axes(bounds.high)};
}

/// Rejects a mesh that lies too far from the origin, or has extreme outliers. Readers of whole files move such a mesh
/// to the origin, or leave outliers out of its size.
void check_coordinates(const MeshStream& mesh, const Mesh& sample, const Bounds& bounds) {
  if (!(bounds.low[0] <= bounds.high[0])) {
    throw Error(ErrorCode::input, "'" + mesh.path() +
                                      "' has no triangle with finite, distinct corners: nothing "
                                      "can be baked from it. Check the file's coordinates.");
  }
  std::array<double, 3> center{};
  double squared_size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double side = bounds.high[k] - bounds.low[k];
    center[k] = bounds.low[k] + side / 2;
    squared_size += side * side;
  }
  if (local_origin(center, std::sqrt(squared_size)) != std::array<double, 3>{}) {
    throw Error(ErrorCode::input, "'" + mesh.path() +
                                      "' is larger than memory, and lies far from the world's "
                                      "origin: move it there, or raise the " +
                                      option("memory_limit") + ".");
  }
  if (may_have_outliers(sample, bounds)) {
    throw Error(ErrorCode::input, "'" + mesh.path() +
                                      "' is larger than memory, and extends over 100,000 times as "
                                      "far as most of its vertices: remove the farthest ones, or "
                                      "raise the " +
                                      option("memory_limit") + ".");
  }
}

}  // namespace kiln
