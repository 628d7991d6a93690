#include "mesh/normals.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "base/parallel.h"
#include "mesh/usable.h"
#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// If the length of a sum of vectors is below this share of the sum of their lengths, the sum is a rounding error
/// without direction, as for faces back to back.
constexpr double kMinSumRatio = 1e-3;
/// Where face normals cancel out, the mesh's own normals replace them if they agree with the face by at least this
/// cosine. On a card without thickness, each side may have its own normals.
constexpr double kMinAgreement = 0.25;

}  // namespace

CornerWeights corner_weights(std::span<const Vec3> positions, const Triangle& triangle) {
  CornerWeights result;
  for (std::uint32_t index : triangle) {
    if (!is_finite(positions[index])) return result;
  }
  const Vec3d p[3] = {to_double(positions[triangle[0]]), to_double(positions[triangle[1]]),
                      to_double(positions[triangle[2]])};
  const Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
  const double double_area = length(normal);
  if (!(double_area > 0) || !std::isfinite(double_area)) return result;
  result.normal = normal * (1 / double_area);
  for (std::size_t k = 0; k < 3; ++k) {
    const double cosine = dot(p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
    result.angles[k] = std::atan2(double_area, cosine);
  }
  return result;
}

Vec3 normalized_sum(const Vec3d& sum, double total) {
  const double size = length(sum);
  return size > kMinSumRatio * total ? to_float(sum * (1 / size)) : Vec3{};
}

namespace {

/// Calls add(triangle index, weights) in triangle order. The weights are computed in parallel.
template <typename Add>
void for_each_weights(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                      std::span<const std::uint32_t> polygons, const Add& add) {
  constexpr std::size_t kTrianglesPerChunk = 1 << 19;
  std::vector<CornerWeights> weights;
  for (std::size_t first = 0, last = 0; first < triangles.size(); first = last) {
    last = std::min(first + kTrianglesPerChunk, triangles.size());
    // Extends the chunk so that it ends with a whole polygon.
    while (!polygons.empty() && last < triangles.size() && polygons[last] == polygons[last - 1]) {
      ++last;
    }
    weights.resize(last - first);
    parallel_for(last - first, 1 << 14, [&](std::size_t begin, std::size_t end) {
      corner_weights(positions, triangles, polygons, first + begin, first + end, &weights[begin]);
    });
    for (std::size_t i = first; i < last; ++i) add(i, weights[i - first]);
  }
}

/// Normalizes sums of vectors. A sum whose terms cancel out becomes zero.
/// \param total_weights  for each sum, the sum of the lengths of its terms
std::vector<Vec3> normalized_sums(const std::vector<Vec3d>& sums,
                                  const std::vector<double>& total_weights) {
  std::vector<Vec3> result(sums.size());
  parallel_for(sums.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      result[i] = normalized_sum(sums[i], total_weights[i]);
    }
  });
  return result;
}

/// Sums of face normals at each vertex, weighted by angle and normalized; zero if they cancel out.
/// \param sums_of  function that returns the indices of the sums to which a triangle's corners are added
std::vector<Vec3> summed_normals(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles,
                                 std::span<const std::uint32_t> polygons,
                                 std::span<const Triangle> sums_of) {
  std::vector<Vec3d> sums(positions.size());
  std::vector<double> total_weights(positions.size());
  for_each_weights(positions, triangles, polygons,
                   [&](std::size_t i, const CornerWeights& weights) {
                     for (std::size_t k = 0; k < 3; ++k) {
                       sums[sums_of[i][k]] += weights.normal * weights.angles[k];
                       total_weights[sums_of[i][k]] += weights.angles[k];
                     }
                   });
  return normalized_sums(sums, total_weights);
}

}  // namespace

void use_faces_where_zero(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                          CornerNormals& corners) {
  for_each_polling(triangles.size(), [&](std::size_t i) {
    const auto is_zero = [&](std::uint32_t index) { return corners.normals[index] == Vec3{}; };
    if (std::none_of(corners.triangles[i].begin(), corners.triangles[i].end(), is_zero)) return;
    const Vec3d face = corner_weights(positions, triangles[i]).normal;
    const auto added = static_cast<std::uint32_t>(corners.normals.size());
    // Rays never hit a triangle without area, so any unit vector will do.
    corners.normals.push_back(length(face) > 0 ? to_float(face) : Vec3{0, 0, 1});
    for (std::uint32_t& index : corners.triangles[i]) {
      if (is_zero(index)) index = added;
    }
  });
}

bool is_usable_normal(const Vec3& n) {
  const double squared = dot(to_double(n), to_double(n));
  return std::isfinite(squared) && squared > 1e-12;
}

void warn_of_normals(const Mesh& mesh, std::vector<Warning>& warnings) {
  if (mesh.normal_triangles.empty() ||
      std::all_of(mesh.normals.begin(), mesh.normals.end(), is_usable_normal)) {
    return;
  }
  std::uint64_t count = 0;
  std::size_t example_triangle = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& corners = mesh.normal_triangles[i];
    const bool has_zero_normal = std::any_of(corners.begin(), corners.end(), [&](std::uint32_t n) {
      return !is_usable_normal(mesh.normals[n]);
    });
    if (!has_zero_normal || !has_area(mesh.positions, mesh.triangles[i])) continue;
    if (count++ == 0) example_triangle = i;
  }
  if (count == 0) return;
  warnings.push_back({"normals-computed",
                      std::to_string(count) + (count == 1 ? " triangle" : " triangles") + " of '" +
                          mesh.name +
                          "' have a normal that is zero or not a number, for example triangle " +
                          std::to_string(example_triangle) +
                          ": the normal of the faces around replaces it. Recompute the mesh's "
                          "normals in the modelling tool if they should differ from that.",
                      count});
}

std::vector<Vec3> vertex_normals(std::span<const Vec3> positions,
                                 std::span<const Triangle> triangles,
                                 std::span<const std::uint32_t> polygons) {
  std::vector<Vec3> result = summed_normals(positions, triangles, polygons, triangles);
  // If the normals cancel out, the first face's normal is used. A vertex without faces gets (0, 0, 1).
  for_each_polling(triangles.size(), [&](std::size_t i) {
    for (const std::uint32_t vertex : triangles[i]) {
      if (result[vertex] != Vec3{}) continue;
      result[vertex] = to_float(corner_weights(positions, triangles[i]).normal);
    }
  });
  for (Vec3& normal : result) {
    if (normal == Vec3{}) normal = {0, 0, 1};
  }
  return result;
}

CornerNormals corner_normals(const Mesh& mesh, std::span<const Vec3> frame_positions) {
  CornerNormals result;
  if (mesh.normal_triangles.empty()) {
    const std::vector<std::uint32_t> first = weld_vertices(frame_positions);
    result.triangles = mesh.triangles;
    for_each_polling(result.triangles.size(), [&](std::size_t i) {
      for (std::uint32_t& index : result.triangles[i]) index = first[index];
    });
    result.normals =
        summed_normals(frame_positions, mesh.triangles, mesh.polygons, result.triangles);
    use_faces_where_zero(frame_positions, mesh.triangles, result);
    return result;
  }
  result.normals = mesh.normals;
  result.triangles = mesh.normal_triangles;
  use_given_normals(mesh.triangles, result,
                    [&] { return vertex_normals(frame_positions, mesh.triangles, mesh.polygons); });
  return result;
}

void use_given_normals(std::span<const Triangle> triangles, CornerNormals& corners,
                       const std::function<std::vector<Vec3>()>& compute) {
  std::vector<Vec3> computed_normals;  // Only computed if a normal is invalid
  for_each_polling(corners.normals.size(), [&](std::size_t i) {
    Vec3& n = corners.normals[i];
    if (is_usable_normal(n)) n = to_float(to_double(n) * (1 / length(to_double(n))));
  });
  for_each_polling(corners.triangles.size(), [&](std::size_t i) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (is_usable_normal(corners.normals[corners.triangles[i][k]])) continue;
      if (computed_normals.empty()) computed_normals = compute();
      corners.triangles[i][k] = static_cast<std::uint32_t>(corners.normals.size());
      corners.normals.push_back(computed_normals[triangles[i][k]]);
    }
  });
}

std::vector<Vec3> continuous_directions(std::span<const Vec3> positions,
                                        std::span<const Triangle> triangles,
                                        const CornerNormals& corners) {
  const std::vector<std::uint32_t> first = weld_vertices(positions);
  std::vector<Vec3d> sums(positions.size());
  std::vector<Vec3d> face_sums(positions.size());
  std::vector<double> total_weights(positions.size());
  for_each_weights(positions, triangles, {}, [&](std::size_t i, const CornerWeights& weights) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = first[triangles[i][k]];
      sums[vertex] += to_double(corners.normals[corners.triangles[i][k]]) * weights.angles[k];
      face_sums[vertex] += weights.normal * weights.angles[k];
      total_weights[vertex] += weights.angles[k];
    }
  });
  // Where corner normals cancel out, face normals may still have a direction.
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const bool is_card = length(face_sums[i]) <= kMinSumRatio * total_weights[i];
    if (length(sums[i]) <= (is_card ? kMinAgreement : kMinSumRatio) * total_weights[i])
      sums[i] = face_sums[i];
  }
  std::vector<Vec3> result = normalized_sums(sums, total_weights);
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = result[first[i]];
  return result;
}

}  // namespace kiln
