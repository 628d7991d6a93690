#include "match/visibility_clusters.h"

#include <algorithm>
#include <cmath>

namespace kiln {
namespace {

constexpr int kClusterIterations = 16;
/// Axis along which clusters are ordered. It differs from the axes and diagonals, since pairs of clusters are often
/// symmetric about one of these, and their order would then be ambiguous.
const Vec3d kOrderingAxis{0.48, 0.29, 0.83};

Vec3d normalized_or(const Vec3d& v, const Vec3d& other) {
  const double size = length(v);
  return size > 1e-12 ? v * (1 / size) : other;
}

}  // namespace

std::vector<Vec3d> cluster_directions(std::span<const SeenDirection> directions,
                                      std::uint32_t count) {
  std::vector<Vec3d> cluster_centres;
  if (directions.empty() || count == 0) return cluster_centres;
  Vec3d sum{};
  for (const SeenDirection& d : directions) sum += d.toward * d.weight;
  if (count == 1) return {normalized_or(sum, directions[0].toward)};

  // For each direction, its cosine to the nearest of the centres chosen so far, or to the mean direction before
  // the first centre is chosen.
  std::vector<double> nearest_cosines(directions.size());
  const Vec3d mean = normalized_or(sum, {0, 0, 0});
  std::transform(directions.begin(), directions.end(), nearest_cosines.begin(),
                 [&](const SeenDirection& d) { return dot(d.toward, mean); });
  while (cluster_centres.size() < std::min<std::size_t>(count, directions.size())) {
    const auto farthest =
        std::min_element(nearest_cosines.begin(), nearest_cosines.end()) - nearest_cosines.begin();
    const Vec3d centre = directions[static_cast<std::size_t>(farthest)].toward;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const double cosine = dot(directions[i].toward, centre);
      nearest_cosines[i] = cluster_centres.empty() ? cosine : std::max(nearest_cosines[i], cosine);
    }
    cluster_centres.push_back(centre);
  }
  for (int round = 0; round < kClusterIterations; ++round) {
    std::vector<Vec3d> sums(cluster_centres.size());
    for (const SeenDirection& d : directions) {
      std::size_t nearest = 0;
      double best = -2;
      for (std::size_t k = 0; k < cluster_centres.size(); ++k) {
        const double cosine = dot(d.toward, cluster_centres[k]);
        if (cosine <= best) continue;
        best = cosine;
        nearest = k;
      }
      sums[nearest] += d.toward * d.weight;
    }
    for (std::size_t k = 0; k < cluster_centres.size(); ++k)
      cluster_centres[k] = normalized_or(sums[k], cluster_centres[k]);
  }
  std::stable_sort(
      cluster_centres.begin(), cluster_centres.end(),
      [](const Vec3d& a, const Vec3d& b) { return dot(a, kOrderingAxis) > dot(b, kOrderingAxis); });
  return cluster_centres;
}

}  // namespace kiln
