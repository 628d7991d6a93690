#include "simplify/transfer_colors.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "base/srgb.h"
#include "kiln/image.h"
#include "mesh/barycentric_projection.h"
#include "mesh/frame.h"
#include "mesh/surface_distance.h"
#include "mesh/two_sided.h"
#include "mesh/vector.h"
#include "simplify/normal_fans.h"

namespace kiln {
namespace {

using Rgba = Eigen::Array4d;
using Colors = Eigen::Matrix<double, Eigen::Dynamic, 4>;

constexpr std::size_t kMinColorSamples = 100000;
constexpr std::size_t kColorSamplesPerVertex = 40;
constexpr std::size_t kColorSamplesPerTask = 256;
// Additional share of a vertex's weight for its nearest sample. It damps ringing where samples are few.
constexpr double kNearestSampleWeight = 0.01;
// A vertex counts as lying on only one side of a sheet if the length of the sum of its area-weighted normals is more
// than this share of the area of its faces.
constexpr double kMinOneSidedShare = 0.1;

/// A vertex of the high poly, and its nearest point on the low poly.
struct ColorSample {
  Triangle corners{};
  std::array<double, 3> share{};
  double area = 0;
  Rgba color = Rgba::Zero();
};

Rgba linear_of(const std::array<std::uint8_t, 4>& color) {
  const auto& linear = linear_values_of_bytes();
  return {linear[color[0]], linear[color[1]], linear[color[2]], color[3] / 255.0};
}

/// For each vertex, the area and the normals of the faces around it.
struct VertexSurroundings {
  std::vector<double> area;  ///< A third of the triangles' area; 0 if a corner is not finite
  /// Sum of the faces' cross products; about 0 for a vertex that both sides of a sheet share
  std::vector<Vec3d> facing;

  /// Side of a triangle on which a vertex lies: the side of the triangle's normal (1), the opposite side (-1), or both
  /// (0).
  int side(std::size_t vertex, const Vec3d& normal) const {
    const double agreement = dot(facing[vertex], normal);
    if (std::abs(agreement) < kMinOneSidedShare * 6 * area[vertex] * length(normal)) return 0;
    return agreement > 0 ? 1 : -1;
  }
};

VertexSurroundings surroundings_of_vertices(const Mesh& high, const std::vector<Vec3>& positions) {
  VertexSurroundings around{std::vector<double>(positions.size()),
                            std::vector<Vec3d>(positions.size())};
  for (const Triangle& t : high.triangles) {
    const Vec3d facing = face_of(positions, t);
    const double area = length(facing) / 6;
    if (!std::isfinite(area)) continue;
    for (const std::uint32_t vertex : t) {
      around.area[vertex] += area;
      around.facing[vertex] += facing;
    }
  }
  return around;
}

std::vector<ColorSample> draw_samples(const Mesh& high, const Mesh& low) {
  const Frame frame = Frame::of(high);
  const std::vector<Vec3> high_points = frame.to_frame(high), low_points = frame.to_frame(low);
  const VertexSurroundings around = surroundings_of_vertices(high, high_points);
  const SurfaceDistance surface(low_points, low.triangles);
  const TwoSided sides = TwoSided::of(low);
  const std::size_t max_samples =
      std::max(kMinColorSamples, kColorSamplesPerVertex * low.positions.size());
  const std::size_t step = (high_points.size() + max_samples - 1) / max_samples;
  const std::size_t count = (high_points.size() + step - 1) / step;
  // A vertex on both sides of a sheet gets a second sample on the sheet's back.
  std::vector<ColorSample> samples(sides.empty() ? count : 2 * count);
  parallel_for(count, kColorSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3& point = high_points[i * step];
      if (!(around.area[i * step] > 0) || !is_finite(point)) continue;
      const auto set_sample = [&](ColorSample& sample, std::uint32_t triangle, double area) {
        sample.area = area;
        sample.color = linear_of(high.colors[i * step]);
        sample.corners = low.triangles[triangle];
        const auto& [a, b, c] = sample.corners;
        sample.share = barycentric_projection(to_double(point), to_double(low_points[a]),
                                              to_double(low_points[b]), to_double(low_points[c]));
      };
      const std::uint32_t nearest = surface.nearest(point);
      const std::uint32_t twin = sides.empty() ? TwoSided::kNone : sides.twins[nearest];
      const int side = twin == TwoSided::kNone
                           ? 1
                           : around.side(i * step, face_of(low_points, low.triangles[nearest]));
      const double area = around.area[i * step];
      set_sample(samples[i], side < 0 ? twin : nearest, side == 0 ? area / 2 : area);
      if (side == 0) set_sample(samples[count + i], twin, area / 2);
    }
  });
  return samples;
}

/// Sums of colours at each vertex of the low poly.
struct VertexColors {
  /// For each vertex, the total weight of its samples; 0 without samples
  std::vector<double> weight;
  /// For each vertex, the colour of its nearest sample, and the barycentric coordinate that this sample has at the
  /// vertex
  Colors nearest;
};

VertexColors nearest_samples(const std::vector<ColorSample>& samples, std::size_t count) {
  VertexColors result{std::vector<double>(count),
                      Colors::Zero(static_cast<Eigen::Index>(count), 4)};
  std::vector<double> share(count);
  for (const ColorSample& sample : samples) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = sample.corners[k];
      result.weight[v] += sample.area * sample.share[k];
      if (sample.area == 0 || sample.share[k] <= share[v]) continue;
      share[v] = sample.share[k];
      result.nearest.row(v) = sample.color.matrix().transpose();
    }
  }
  return result;
}

/// Fills each vertex without a colour with the mean of its neighbours, in rings around the coloured vertices.
void fill_uncolored(const Mesh& low, VertexColors& vertices) {
  auto& [weight, mean] = vertices;
  for (bool any_filled = true; any_filled;) {
    any_filled = false;
    std::vector<double> count(weight.size());
    Colors sum = Colors::Zero(mean.rows(), 4);
    for (const Triangle& t : low.triangles) {
      for (const std::uint32_t to : t) {
        if (weight[to] > 0) continue;
        for (const std::uint32_t from : t) {
          if (!(weight[from] > 0)) continue;
          sum.row(to) += mean.row(from);
          ++count[to];
        }
      }
    }
    for (std::size_t v = 0; v < weight.size(); ++v) {
      if (count[v] == 0) continue;
      const auto row = static_cast<Eigen::Index>(v);
      mean.row(row) = sum.row(row) / count[v];
      weight[v] = 1e-30;  // A tiny weight marks the vertex as coloured
      any_filled = true;
    }
  }
}

/// Fits the colours of vertices to all samples by least squares.
Colors fit(const std::vector<ColorSample>& samples, const VertexColors& vertices) {
  const Eigen::Index count = vertices.nearest.rows();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * samples.size() + vertices.weight.size());
  Colors right = Colors::Zero(count, 4);
  for (const ColorSample& sample : samples) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double w = sample.area * sample.share[i];
      if (w == 0) continue;
      right.row(sample.corners[i]) += (w * sample.color).matrix().transpose();
      for (std::size_t k = 0; k < 3; ++k) {
        entries.emplace_back(sample.corners[i], sample.corners[k], w * sample.share[k]);
      }
    }
  }
  for (Eigen::Index v = 0; v < count; ++v) {
    const double w = kNearestSampleWeight * vertices.weight[static_cast<std::size_t>(v)];
    entries.emplace_back(v, v, w);
    right.row(v) += w * vertices.nearest.row(v);
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower | Eigen::Upper> solver;
  solver.setTolerance(1e-5);
  solver.setMaxIterations(200);
  solver.compute(matrix);
  return solver.solveWithGuess(right, vertices.nearest);
}

std::uint8_t to_byte(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

}  // namespace

void transfer_colors(const Mesh& high, Mesh& low) {
  if (high.colors.empty() || low.triangles.empty()) return;
  if (std::all_of(high.colors.begin(), high.colors.end(),
                  [&](const auto& color) { return color == high.colors.front(); })) {
    low.colors.assign(low.positions.size(), high.colors.front());
    return;
  }
  const std::vector<ColorSample> samples = draw_samples(high, low);
  VertexColors vertices = nearest_samples(samples, low.positions.size());
  fill_uncolored(low, vertices);
  const Colors colors = fit(samples, vertices);
  low.colors.resize(low.positions.size());
  for (std::size_t v = 0; v < low.colors.size(); ++v) {
    const Rgba color = colors.row(static_cast<Eigen::Index>(v)).transpose().array();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto channel = static_cast<float>(color[static_cast<Eigen::Index>(k)]);
      low.colors[v][k] = to_byte(to_srgb(channel));
    }
    low.colors[v][3] = to_byte(color[3]);
  }
}

}  // namespace kiln
