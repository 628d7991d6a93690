#include "mesh/high_poly_normals.h"

#include <algorithm>
#include <cstring>

#include "base/parallel.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

constexpr std::size_t kNormalsPerTask = 1 << 12;

bool same_bits(const Vec3& a, const Vec3& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

HighPolyNormals::HighPolyNormals(const Mesh& mesh, std::span<const Vec3> positions)
    : is_computed_(mesh.normal_triangles.empty()) {
  rebuild(mesh, positions);
}

bool HighPolyNormals::has_extra_normals(const Mesh& mesh) const {
  return corners_.normals.size() != (is_computed_ ? mesh.positions.size() : mesh.normals.size());
}

void HighPolyNormals::index() {
  corners_of_entry_ =
      Adjacency::make(corners_.normals.size(), corners_.triangles.size() * 3,
                      [&](std::size_t i) { return corners_.triangles[i / 3][i % 3]; });
}

HighPolyNormals::Change HighPolyNormals::rebuild(const Mesh& mesh,
                                                 std::span<const Vec3> positions) {
  corners_ = corner_normals(mesh, positions);
  index();
  if (is_computed_) {
    welded_ = weld_vertices(positions);
    weights_.resize(mesh.triangles.size());
    parallel_for(weights_.size(), kNormalsPerTask, [&](std::size_t begin, std::size_t end) {
      corner_weights(positions, mesh.triangles, mesh.polygons, begin, end, &weights_[begin]);
    });
  }
  return {true, {}};
}

std::vector<std::uint32_t> HighPolyNormals::first_triangles_of_polygons(
    const Mesh& mesh, std::span<const std::uint32_t> triangles) {
  std::vector<std::uint32_t> first_triangles(triangles.begin(), triangles.end());
  if (mesh.polygons.empty()) return first_triangles;
  for (std::uint32_t& t : first_triangles) {
    while (t > 0 && mesh.polygons[t - 1] == mesh.polygons[t]) --t;
  }
  std::sort(first_triangles.begin(), first_triangles.end());
  first_triangles.erase(std::unique(first_triangles.begin(), first_triangles.end()),
                        first_triangles.end());
  return first_triangles;
}

HighPolyNormals::Change HighPolyNormals::move(const Mesh& mesh, std::span<const Vec3> positions,
                                              std::span<const std::uint32_t> triangles) {
  if (!is_computed_ && !has_extra_normals(mesh)) return {};
  if (has_extra_normals(mesh) || weld_vertices(positions) != welded_)
    return rebuild(mesh, positions);
  const std::vector<std::uint32_t> first_triangles = first_triangles_of_polygons(mesh, triangles);
  parallel_for(first_triangles.size(), kNormalsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t t = first_triangles[i];
      corner_weights(positions, mesh.triangles, mesh.polygons, t, t + 1, &weights_[t]);
    }
  });
  std::vector<std::uint32_t> touched_entries;
  std::vector<bool> is_listed(corners_.normals.size());
  for (const std::uint32_t first : first_triangles) {
    std::uint32_t t = first;
    do {
      for (const std::uint32_t entry : corners_.triangles[t]) {
        if (is_listed[entry]) continue;
        is_listed[entry] = true;
        touched_entries.push_back(entry);
      }
      ++t;
    } while (t < mesh.polygons.size() && mesh.polygons[t] == mesh.polygons[first]);
  }
  std::sort(touched_entries.begin(), touched_entries.end());
  // Sums are formed in triangle order, so they equal those for the whole mesh.
  std::vector<Vec3> sums(touched_entries.size());
  parallel_for(touched_entries.size(), kNormalsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Vec3d sum{};
      double total_angle = 0;
      for (const std::uint32_t corner : corners_of_entry_.of(touched_entries[i])) {
        const CornerWeights& weights = weights_[corner / 3];
        sum += weights.normal * weights.angles[corner % 3];
        total_angle += weights.angles[corner % 3];
      }
      sums[i] = normalized_sum(sum, total_angle);
    }
  });
  Change change;
  for (std::size_t i = 0; i < touched_entries.size(); ++i) {
    if (sums[i] == Vec3{}) return rebuild(mesh, positions);
    Vec3& normal = corners_.normals[touched_entries[i]];
    if (same_bits(normal, sums[i])) continue;
    normal = sums[i];
    change.entries.push_back(touched_entries[i]);
  }
  return change;
}

HighPolyNormals::Change HighPolyNormals::set(const Mesh& mesh, std::span<const Vec3> positions,
                                             std::span<const std::uint32_t> entries) {
  if (has_extra_normals(mesh)) return rebuild(mesh, positions);
  Change change;
  for (const std::uint32_t entry : entries) {
    const Vec3d n = to_double(mesh.normals[entry]);
    const Vec3 unit = to_float(n * (1 / length(n)));
    if (same_bits(corners_.normals[entry], unit)) continue;
    corners_.normals[entry] = unit;
    change.entries.push_back(entry);
  }
  return change;
}

}  // namespace kiln
