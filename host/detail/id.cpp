// Which connected part of the high poly a point belongs to, as a colour.
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "detail/point_map.h"
#include "mesh/kernels_shared.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Colours far apart, the same for the same number: steps of the golden ratio around the hues, in three
/// brightnesses; none is black, which is the background.
std::array<float, 3> colour_of(std::uint32_t part) {
  constexpr double kGoldenShare = 0.6180339887498949;
  const double hue = 6 * std::fmod(part * kGoldenShare, 1.0);
  const double bright = 1 - 0.25 * (part % 3);
  std::array<float, 3> colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    // Distance of the hue from the channel's own, around the circle of six.
    const double away = std::abs(std::fmod(hue + 6 - 2.0 * static_cast<double>(c) + 3, 6.0) - 3);
    colour[c] = static_cast<float>(bright * (0.15 + 0.85 * std::clamp(2 - away, 0.0, 1.0)));
  }
  return colour;
}

/// Parts are numbered by their lowest triangle; triangles hang together where they share a place.
class PartColours : public PointFunction {
 public:
  explicit PartColours(const Source::Impl& source) : part_(source.triangles.size()) {
    const std::vector<std::uint32_t> place = weld_vertices(source.positions);
    std::vector<std::uint32_t> parent(source.positions.size());
    std::iota(parent.begin(), parent.end(), 0U);
    const auto root = [&](std::uint32_t vertex) {
      vertex = place[vertex];
      while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
      return vertex;
    };
    for (const Triangle& t : source.triangles) {
      parent[root(t[1])] = root(t[0]);
      parent[root(t[2])] = root(t[0]);
    }
    std::vector<std::uint32_t> number(parent.size(), KILN_NO_TRIANGLE);
    std::uint32_t parts = 0;
    for (std::size_t t = 0; t < part_.size(); ++t) {
      std::uint32_t& own = number[root(source.triangles[t][0])];
      if (own == KILN_NO_TRIANGLE) own = parts++;
      part_[t] = own;
    }
  }

  void operator()(const DensePoint& point, float* value) const override {
    if (!point.found) return;  // black
    const std::array<float, 3> colour = colour_of(part_[point.triangle]);
    std::copy(colour.begin(), colour.end(), value);
  }

 private:
  std::vector<std::uint32_t> part_;  // of each triangle
};

}  // namespace

MapRow id_map() {
  MapRow row;
  row.info = {
      MapKind{"id"}, 3, MapType::id, "connected part of the high poly, a colour each", 0, 1};
  row.make = [](const MapRequest& request) {
    return make_point_map(
        request, id_map().info,
        std::unique_ptr<PointFunction>(std::make_unique<PartColours>(request.source)));
  };
  return row;
}

}  // namespace kiln
