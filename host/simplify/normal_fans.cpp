#include "simplify/normal_fans.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "mesh/normals.h"
#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Smallest cosine between a normal and the faces around it. It is positive because directions in tangent space are
/// within 90 degrees of the normal.
constexpr double kMinFacingCosine = 0.05;

/// For each UV, the index of the first UV with the same value.
std::vector<std::uint32_t> first_uvs(const Mesh& low) {
  std::vector<Vec3> flat;
  flat.reserve(low.uvs.size());
  for (const Vec2& uv : low.uvs) flat.push_back({uv.x, uv.y, 0});
  return weld_vertices(flat);
}

/// For each normal, the smallest cosine between it and the faces around it.
std::vector<double> smallest_face_cosine(const std::vector<Vec3>& positions,
                                         const std::vector<Triangle>& triangles,
                                         const std::vector<std::uint32_t>& normal_of_corner,
                                         const Normals& normals) {
  std::vector<double> result(static_cast<std::size_t>(normals.rows()), 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3d face = face_of(positions, triangles[t]);
    const double size = length(face);
    if (!(size > 0) || !std::isfinite(size)) continue;
    const Eigen::RowVector3d unit = Eigen::RowVector3d(face.x, face.y, face.z) / size;
    for (std::size_t k = 0; k < 3; ++k) {
      double& min_cosine = result[normal_of_corner[3 * t + k]];
      min_cosine = std::min(min_cosine, normals.row(normal_of_corner[3 * t + k]).dot(unit));
    }
  }
  return result;
}

}  // namespace

void normalize(Normals& normals) {
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    const double size = normals.row(i).norm();
    if (size > 0 && std::isfinite(size)) {
      normals.row(i) /= size;
    } else {
      normals.row(i) = Eigen::RowVector3d(0, 0, 1);
    }
  }
}

Normals angle_weighted(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                       const std::vector<std::uint32_t>& normal_of_corner, std::size_t count) {
  Normals result = Normals::Zero(static_cast<Eigen::Index>(count), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const CornerWeights weights = corner_weights(positions, triangles[t]);
    const Eigen::RowVector3d face(weights.normal.x, weights.normal.y, weights.normal.z);
    for (std::size_t k = 0; k < 3; ++k)
      result.row(normal_of_corner[3 * t + k]) += face * weights.angles[k];
  }
  normalize(result);
  return result;
}

void keep_facing_forward(const std::vector<Vec3>& positions, const std::vector<Triangle>& triangles,
                         const std::vector<std::uint32_t>& normal_of_corner, Normals& normals) {
  constexpr int kBlendSteps = 4;
  const Normals original_normals = normals;
  const Normals base = angle_weighted(positions, triangles, normal_of_corner,
                                      static_cast<std::size_t>(normals.rows()));
  const std::vector<double> base_cosines =
      smallest_face_cosine(positions, triangles, normal_of_corner, base);
  for (int step = 1; step <= kBlendSteps; ++step) {
    const std::vector<double> cosines =
        smallest_face_cosine(positions, triangles, normal_of_corner, normals);
    const double share = static_cast<double>(step) / kBlendSteps;
    bool any = false;
    for (Eigen::Index i = 0; i < normals.rows(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (cosines[k] >= std::min(kMinFacingCosine, base_cosines[k])) continue;
      normals.row(i) = (original_normals.row(i) * (1 - share) + base.row(i) * share).normalized();
      any = true;
    }
    if (!any) return;
  }
}

NormalFans::NormalFans(const Mesh& low, const TwoSided& sides, double least_turn,
                       const std::vector<bool>& hard)
    : corner_sets_(3 * low.triangles.size()), welded_(low.triangles) {
  const std::vector<std::uint32_t> first = weld_vertices(low.positions);
  for (Triangle& t : welded_) {
    for (std::uint32_t& vertex : t) vertex = first[vertex];
  }
  const std::size_t vertices = split_sheet_sides(sides, low.positions.size());
  if (low.uv_triangles.size() == low.triangles.size() && !low.uvs.empty()) {
    const std::vector<std::uint32_t> first_uv = first_uvs(low);
    uvs_.reserve(3 * low.triangles.size());
    for (const Triangle& t : low.uv_triangles) {
      for (const std::uint32_t uv : t) uvs_.push_back(first_uv[uv]);
    }
  }
  const bool creased = least_turn > -1 || !hard.empty();
  const VertexLists corners(
      vertices, 3 * low.triangles.size(), [&](std::size_t i) { return welded_[i / 3][i % 3]; },
      [&](std::size_t i) { return std::uint64_t{uv_of(i)}; });
  corners_by_vertex_.reserve(3 * low.triangles.size());
  for (std::size_t v = 0; v < corners.vertices(); ++v) {
    const auto around = corners.of(v);
    for (std::size_t i = 0; i < around.size(); ++i) {
      corners_by_vertex_.push_back(around[i].index);
      if (creased) continue;
      if (i > 0 && around[i].key == around[i - 1].key) {
        corner_sets_.join(around[i - 1].index, around[i].index);
      }
    }
  }
  if (creased) join_over_edges(low, vertices, least_turn, hard);
  if (!uvs_.empty() || creased) find_seams(vertices);
}

/// Splits vertices so that no normal is shared between the front and the back of a two-sided sheet, or between a
/// one-sided sheet and a body.
/// \returns the number of vertices afterwards
std::size_t NormalFans::split_sheet_sides(const TwoSided& sides, std::size_t vertices) {
  if (sides.empty()) return vertices;
  for (std::size_t t = 0; t < welded_.size(); ++t) {
    const std::size_t shift = vertices * (sides.backs[t] != 0 ? 2 : sides.has_only_pairs[t]);
    for (std::uint32_t& v : welded_[t]) v += static_cast<std::uint32_t>(shift);
  }
  return 3 * vertices;
}

/// True if the UVs on the two sides of an edge differ at one of its vertices.
bool NormalFans::is_seam(const std::array<std::array<std::uint32_t, 2>, 2>& ends) const {
  return uv_of(ends[0][0]) != uv_of(ends[0][1]) || uv_of(ends[1][0]) != uv_of(ends[1][1]);
}

void NormalFans::join_over_edges(const Mesh& low, std::size_t vertices, double least_turn,
                                 const std::vector<bool>& hard) {
  SideLists(welded_, vertices)
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        const std::uint32_t b = SideLists::higher(sides[0]);
        for (std::size_t i = 1; i < sides.size(); ++i) {
          const std::uint32_t one = sides[i - 1].index / 3, other = sides[i].index / 3;
          const Vec3d n = face_of(low.positions, low.triangles[one]);
          const Vec3d m = face_of(low.positions, low.triangles[other]);
          if (!hard.empty() && hard[sides[i].index]) continue;
          if (least_turn > -1 && dot(n, m) < least_turn * length(n) * length(m)) continue;
          for (const auto& [corner_of_one, corner_of_other] : ends_of(a, b, one, other)) {
            if (uv_of(corner_of_one) != uv_of(corner_of_other)) continue;
            corner_sets_.join(corner_of_one, corner_of_other);
          }
        }
      });
}

void NormalFans::soften(const Normals& normals, const std::vector<std::uint32_t>& normal_of_corner,
                        double of_seams, double of_creases) {
  std::size_t kept_count = 0;
  for (const Seam& seam : seam_edges_) {
    const auto are_close = [&](const std::array<std::uint32_t, 2>& corners) {
      return normals.row(normal_of_corner[corners[0]])
                 .dot(normals.row(normal_of_corner[corners[1]])) >
             (seam.is_crease ? of_creases : of_seams);
    };
    if (are_close(seam.ends[0]) && are_close(seam.ends[1])) {
      for (const auto& corners : seam.ends) corner_sets_.join(corners[0], corners[1]);
    } else {
      seam_edges_[kept_count++] = seam;
    }
  }
  seam_edges_.resize(kept_count);
}

std::vector<std::uint32_t> NormalFans::normal_of_corner() {
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::vector<std::uint32_t> normal_index(3 * welded_.size(), kNone), result(normal_index.size());
  count_ = 0;
  for (const std::uint32_t i : corners_by_vertex_) {
    std::uint32_t& slot = normal_index[corner_sets_.find(i)];
    if (slot == kNone) slot = static_cast<std::uint32_t>(count_++);
    result[i] = slot;
  }
  return result;
}

void NormalFans::find_seams(std::size_t vertices) {
  SideLists(welded_, vertices)
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        const std::uint32_t b = SideLists::higher(sides[0]);
        for (std::size_t i = 1; i < sides.size(); ++i) {
          const std::uint32_t one = sides[i - 1].index / 3, other = sides[i].index / 3;
          const auto ends = ends_of(a, b, one, other);
          const bool are_normals_split =
              corner_sets_.find(ends[0][0]) != corner_sets_.find(ends[0][1]) ||
              corner_sets_.find(ends[1][0]) != corner_sets_.find(ends[1][1]);
          if (are_normals_split && a != b) seam_edges_.push_back({ends, !is_seam(ends)});
        }
      });
}

}  // namespace kiln
