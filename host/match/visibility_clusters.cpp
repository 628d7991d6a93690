#include "match/visibility_clusters.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

constexpr int kClusterIterations = 16;
/// Axis along which clusters are ordered. It differs from axes and diagonals of meshes, since two clusters
/// are often symmetric about one.
const Vec3d kOrder{0.48, 0.29, 0.83};

Vec3d normalized_or(const Vec3d& v, const Vec3d& other) {
  const double size = length(v);
  return size > 1e-12 ? v * (1 / size) : other;
}

}  // namespace

std::vector<Vec3d> part_directions(std::span<const SeenDirection> directions, std::uint32_t count) {
  std::vector<Vec3d> centres;
  if (directions.empty() || count == 0) return centres;
  Vec3d sum{};
  for (const SeenDirection& d : directions) sum += d.toward * d.weight;
  if (count == 1) return {normalized_or(sum, directions[0].toward)};

  // Cosine between each direction and its nearest chosen centre; initially, the mean.
  std::vector<double> nearness(directions.size());
  const Vec3d mean = normalized_or(sum, {0, 0, 0});
  std::transform(directions.begin(), directions.end(), nearness.begin(),
                 [&](const SeenDirection& d) { return dot(d.toward, mean); });
  while (centres.size() < std::min<std::size_t>(count, directions.size())) {
    const auto farthest = std::min_element(nearness.begin(), nearness.end()) - nearness.begin();
    const Vec3d centre = directions[static_cast<std::size_t>(farthest)].toward;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double cosine = dot(directions[i].toward, centre);
      nearness[i] = centres.empty() ? cosine : std::max(nearness[i], cosine);
    }
    centres.push_back(centre);
  }
  for (int round = 0; round < kClusterIterations; ++round) {
    std::vector<Vec3d> sums(centres.size());
    for (const SeenDirection& d : directions) {
      std::size_t nearest = 0;
      double best = -2;
      for (std::size_t k = 0; k < centres.size(); ++k) {
        const double cosine = dot(d.toward, centres[k]);
        if (cosine <= best) continue;
        best = cosine;
        nearest = k;
      }
      sums[nearest] += d.toward * d.weight;
    }
    for (std::size_t k = 0; k < centres.size(); ++k)
      centres[k] = normalized_or(sums[k], centres[k]);
  }
  std::stable_sort(centres.begin(), centres.end(),
                   [](const Vec3d& a, const Vec3d& b) { return dot(a, kOrder) > dot(b, kOrder); });
  return centres;
}

}  // namespace kiln
