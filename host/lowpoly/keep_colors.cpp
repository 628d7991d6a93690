#include "lowpoly/keep_colors.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "image/srgb.h"
#include "lowpoly/point_shares.h"
#include "mesh/frame.h"
#include "mesh/surface_distance.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

using Rgba = Eigen::Array4d;
using Colors = Eigen::Matrix<double, Eigen::Dynamic, 4>;

constexpr std::size_t kLeastPlaces = 100000;
constexpr std::size_t kPlacesOfVertex = 40;
constexpr std::size_t kGrainOfPlaces = 256;
// How much of a vertex's weight its nearest place has besides: colours would ring where places are few.
constexpr double kTowardsNearest = 0.01;

/// Where a vertex of the high poly lies on the low poly.
struct ColoredPlace {
  Triangle corners{};
  std::array<double, 3> share{};
  double area = 0;
  Rgba color = Rgba::Zero();
};

Rgba linear_of(const std::array<std::uint8_t, 4>& color) {
  const auto& linear = linear_of_bytes();
  return {linear[color[0]], linear[color[1]], linear[color[2]], color[3] / 255.0};
}

/// The area around each vertex, in frame units; 0 where a corner is not finite.
std::vector<double> areas_around(const Mesh& high, const std::vector<Vec3>& positions) {
  std::vector<double> areas(positions.size());
  for (const Triangle& t : high.triangles) {
    const Vec3d a(positions[t[0]]), b(positions[t[1]]), c(positions[t[2]]);
    const double area = length(cross(b - a, c - a)) / 6;
    if (!std::isfinite(area)) continue;
    for (const std::uint32_t vertex : t) areas[vertex] += area;
  }
  return areas;
}

std::vector<ColoredPlace> places_of(const Mesh& high, const Mesh& low) {
  const Frame frame = Frame::of(high);
  const std::vector<Vec3> dense = frame.to_frame(high), light = frame.to_frame(low);
  const std::vector<double> areas = areas_around(high, dense);
  const SurfaceDistance surface(light, low.triangles);
  const std::size_t most = std::max(kLeastPlaces, kPlacesOfVertex * low.positions.size());
  const std::size_t step = (dense.size() + most - 1) / most;
  std::vector<ColoredPlace> places((dense.size() + step - 1) / step);
  parallel_for(places.size(), kGrainOfPlaces, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ColoredPlace& place = places[i];
      const Vec3& point = dense[i * step];
      if (!(areas[i * step] > 0) || !is_finite(point)) continue;
      place.area = areas[i * step];
      place.color = linear_of(high.colors[i * step]);
      place.corners = low.triangles[surface.nearest(point)];
      const auto& [a, b, c] = place.corners;
      place.share = shares_of(Vec3d(point), Vec3d(light[a]), Vec3d(light[b]), Vec3d(light[c]));
    }
  });
  return places;
}

/// What is known of each vertex by itself.
struct VertexColors {
  std::vector<double> weight;  ///< Of its places; 0: it has none
  Colors nearest;              ///< The colour of the place that is nearest, by its share
};

VertexColors nearest_places(const std::vector<ColoredPlace>& places, std::size_t count) {
  VertexColors result{std::vector<double>(count),
                      Colors::Zero(static_cast<Eigen::Index>(count), 4)};
  std::vector<double> share(count);
  for (const ColoredPlace& place : places) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = place.corners[k];
      result.weight[v] += place.area * place.share[k];
      if (place.area == 0 || place.share[k] <= share[v]) continue;
      share[v] = place.share[k];
      result.nearest.row(v) = place.color.matrix().transpose();
    }
  }
  return result;
}

/// Vertices without a colour take the mean of their neighbours', step by step.
void spread(const Mesh& low, VertexColors& vertices) {
  auto& [weight, mean] = vertices;
  for (bool changed = true; changed;) {
    changed = false;
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
      weight[v] = 1e-30;  // It has a colour now.
      changed = true;
    }
  }
}

/// Least squares over all places.
Colors fit(const std::vector<ColoredPlace>& places, const VertexColors& vertices) {
  const Eigen::Index count = vertices.nearest.rows();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(9 * places.size() + vertices.weight.size());
  Colors right = Colors::Zero(count, 4);
  for (const ColoredPlace& place : places) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double w = place.area * place.share[i];
      if (w == 0) continue;
      right.row(place.corners[i]) += (w * place.color).matrix().transpose();
      for (std::size_t k = 0; k < 3; ++k) {
        entries.emplace_back(place.corners[i], place.corners[k], w * place.share[k]);
      }
    }
  }
  for (Eigen::Index v = 0; v < count; ++v) {
    const double w = kTowardsNearest * vertices.weight[static_cast<std::size_t>(v)];
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

std::uint8_t byte_of(double value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

}  // namespace

void keep_colors(const Mesh& high, Mesh& low) {
  if (high.colors.empty() || low.triangles.empty()) return;
  if (std::all_of(high.colors.begin(), high.colors.end(),
                  [&](const auto& color) { return color == high.colors.front(); })) {
    low.colors.assign(low.positions.size(), high.colors.front());
    return;
  }
  const std::vector<ColoredPlace> places = places_of(high, low);
  VertexColors vertices = nearest_places(places, low.positions.size());
  spread(low, vertices);
  const Colors colors = fit(places, vertices);
  low.colors.resize(low.positions.size());
  for (std::size_t v = 0; v < low.colors.size(); ++v) {
    const Rgba color = colors.row(static_cast<Eigen::Index>(v)).transpose().array();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto channel = static_cast<float>(color[static_cast<Eigen::Index>(k)]);
      low.colors[v][k] = byte_of(to_srgb(channel));
    }
    low.colors[v][3] = byte_of(color[3]);
  }
}

}  // namespace kiln
