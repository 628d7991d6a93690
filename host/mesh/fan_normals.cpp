#include "mesh/fan_normals.h"

#include <algorithm>
#include <cstdint>
#include <span>

#include "base/disjoint_sets.h"
#include "base/parallel.h"
#include "mesh/high_poly_normals.h"
#include "mesh/normals.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

/// A plane alone determines the normal at one of its vertices if all other faces there have less than this share of the
/// plane's area.
constexpr float kMaxBesidePlaneShare = 1.0F / 4;
/// At a corner with at least kMinTipFaces faces, the normal is not shared if its cosine to a face is below
/// kMaxTipCosine: the corner is a sharp tip. With fewer faces, the limit is kMaxSharpTipCosine.
constexpr std::size_t kMinTipFaces = 8;
// Cosines of 30 and of 45 degrees
constexpr double kMaxTipCosine = 0.8660, kMaxSharpTipCosine = 0.7071;

Vec3d unit_of_sum(const Vec3d& v) {
  const double size = length(v);
  return size > 0 ? v * (1 / size) : Vec3d();
}

/// Computes normals that corners connected over smooth edges share.
class FanNormals {
 public:
  FanNormals(const Mesh& mesh, const FaceEdges& faces, const Creases& creases)
      : mesh_(mesh), faces_(faces), creases_(creases), weights_(mesh.triangles.size()) {
    parallel_for(weights_.size(), 1 << 13, [&](std::size_t begin, std::size_t end) {
      corner_weights(mesh.positions, mesh.triangles, mesh.polygons, begin, end, &weights_[begin]);
    });
  }

  /// Sets the normals of a mesh.
  /// \param triangles  true for each triangle that gets normals
  void set_normals(const std::vector<bool>& triangles, Mesh& mesh) const;

 private:
  Adjacency fans(const std::vector<bool>& triangles) const;
  float plane_area_at(std::uint32_t corner) const {
    const std::uint32_t region =
        creases_.regions.empty() ? corner / 3 : creases_.regions[corner / 3];
    return std::max(faces_.areas[corner / 3],
                    creases_.regions.empty() ? 0 : creases_.region_areas[region]);
  }
  const Vec3d& face(std::uint32_t corner) const { return weights_[corner / 3].normal; }
  Vec3d normal_sum_of(std::span<const std::uint32_t> fan) const;
  bool is_tip(std::span<const std::uint32_t> fan, const Vec3d& normal) const;

  const Mesh& mesh_;
  const FaceEdges& faces_;
  const Creases& creases_;
  std::vector<CornerWeights> weights_;
};

/// Groups corners into fans, in the order of their lowest corners. In parts without hard edges, all corners at a
/// position form one fan.
Adjacency FanNormals::fans(const std::vector<bool>& triangles) const {
  DisjointSets sets(3 * mesh_.triangles.size());
  std::vector<std::uint32_t> first_corner(mesh_.positions.size(), 0xFFFFFFFFU);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (!triangles[t] || creases_.hard_part[t]) continue;
    for (std::uint32_t k = 0; k < 3; ++k) {
      std::uint32_t& at = first_corner[faces_.welded[mesh_.triangles[t][k]]];
      if (at == 0xFFFFFFFFU) at = 3 * t + k;
      sets.join(at, 3 * t + k);
    }
  }
  const auto next = [](std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; };
  for (std::size_t e = 0; e < faces_.edges.size(); ++e) {
    const auto [a, b] = faces_.edges[e].sides;
    if (creases_.hard[e] || !creases_.hard_part[a / 3] || !triangles[a / 3] || !triangles[b / 3])
      continue;
    sets.join(a, next(b));
    sets.join(next(a), b);
  }
  std::vector<std::uint32_t> fan_numbers(3 * mesh_.triangles.size(), 0xFFFFFFFFU);
  std::uint32_t count = 0;
  for (std::uint32_t corner = 0; corner < fan_numbers.size(); ++corner) {
    if (!triangles[corner / 3]) continue;
    const std::uint32_t root = sets.find(corner);
    fan_numbers[corner] = root == corner ? count++ : fan_numbers[root];
  }
  return Adjacency::make(count, fan_numbers.size(),
                         [&](std::size_t i) -> std::size_t { return fan_numbers[i]; });
}

/// Sum of the normals around a fan in triangle order. Faces that are small relative to an adjacent plane are left out.
Vec3d FanNormals::normal_sum_of(std::span<const std::uint32_t> fan) const {
  float largest_area = 0;
  for (const std::uint32_t corner : fan)
    largest_area = std::max(largest_area, plane_area_at(corner));
  const bool plane = std::any_of(fan.begin(), fan.end(), [&](std::uint32_t corner) {
    return !creases_.regions.empty() &&
           creases_.region_areas[creases_.regions[corner / 3]] == largest_area;
  });
  Vec3d sum{};
  for (const std::uint32_t corner : fan) {
    if (plane && plane_area_at(corner) < kMaxBesidePlaneShare * largest_area) continue;
    sum += face(corner) * weights_[corner / 3].angles[corner % 3];
  }
  return sum;
}

bool FanNormals::is_tip(std::span<const std::uint32_t> fan, const Vec3d& normal) const {
  const double min_cosine = fan.size() < kMinTipFaces ? kMaxSharpTipCosine : kMaxTipCosine;
  return std::any_of(fan.begin(), fan.end(), [&](std::uint32_t corner) {
    return weights_[corner / 3].angles[corner % 3] > 0 && dot(face(corner), normal) < min_cosine;
  });
}

void FanNormals::set_normals(const std::vector<bool>& triangles, Mesh& mesh) const {
  const Adjacency all = fans(triangles);
  for (std::size_t fan = 0; fan + 1 < all.first.size(); ++fan) {
    const std::span<const std::uint32_t> corners = all.of(fan);
    const Vec3d normal = unit_of_sum(normal_sum_of(corners));
    const bool has_sharp_tip = creases_.hard_part[corners[0] / 3] && is_tip(corners, normal);
    const auto shared_index = static_cast<std::uint32_t>(mesh.normals.size());
    if (!has_sharp_tip) mesh.normals.push_back(to_float(normal));
    for (const std::uint32_t corner : corners) {
      std::uint32_t& index = mesh.normal_triangles[corner / 3][corner % 3];
      index = shared_index;
      if (!has_sharp_tip) continue;
      index = static_cast<std::uint32_t>(mesh.normals.size());
      mesh.normals.push_back(to_float(face(corner)));
    }
  }
  // A corner gets the normal of its face if the sum of normals cancels out, or if its triangle is degenerate.
  const auto face_normal_index = static_cast<std::uint32_t>(mesh.normals.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (!triangles[t]) continue;
    for (std::uint32_t& index : mesh.normal_triangles[t]) {
      if (index < face_normal_index && is_usable_normal(mesh.normals[index])) continue;
      index = static_cast<std::uint32_t>(mesh.normals.size());
      const Vec3 own_normal = to_float(weights_[t].normal);
      mesh.normals.push_back(is_usable_normal(own_normal) ? own_normal : Vec3{0, 0, 1});
    }
  }
}

}  // namespace

void give_fan_normals(const FaceEdges& faces, const Creases& creases,
                      const std::vector<bool>& triangles, Mesh& mesh) {
  FanNormals(mesh, faces, creases).set_normals(triangles, mesh);
}

}  // namespace kiln
