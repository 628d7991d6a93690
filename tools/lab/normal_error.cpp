#include "lab/normal_error.h"

#include <algorithm>

namespace kiln::cli {
namespace {

// A side of the map that says where a pixel lies; between its texels places are exact.
constexpr std::uint32_t kPlaces = 256;

/// Each place's own u and v, and 1.
Image places() {
  Image map{kPlaces, kPlaces, 3, {}};
  for (std::uint32_t y = 0; y < kPlaces; ++y) {
    for (std::uint32_t x = 0; x < kPlaces; ++x) {
      map.pixels.insert(map.pixels.end(), {(static_cast<float>(x) + 0.5F) / kPlaces,
                                           (static_cast<float>(y) + 0.5F) / kPlaces, 1.0F});
    }
  }
  return map;
}

}  // namespace

Image normal_error_texture(const Device& device, const Scene& high, const Scene& shown,
                           const Mesh& frame, const Mesh& low, const std::vector<ViewAngles>& views,
                           std::uint32_t width, std::uint32_t height, std::uint32_t pixels) {
  const Image map = places();
  const Scene placed(device, low, {&map});
  std::vector<double> sums(std::size_t{width} * height);
  std::vector<std::uint32_t> counts(sums.size());
  const auto cell = [](float share, std::uint32_t side) {
    return std::min(static_cast<std::uint32_t>(std::max(0.0F, share) * static_cast<float>(side)),
                    side - 1);
  };
  for (const ViewAngles& angles : views) {
    RenderOptions view;
    view.frame = &frame;
    view.size = pixels;
    view.samples = 1;
    view.azimuth_degrees = angles.azimuth_degrees;
    view.elevation_degrees = angles.elevation_degrees;
    view.trim = false;
    view.show_normals = true;
    const Image error = normal_angles(high.draw(view), shown.draw(view));
    view.show_normals = false;
    view.show_colors = true;
    const Image place = placed.draw(view);
    for (std::size_t i = 0; i < error.pixels.size(); ++i) {
      const float* uv = &place.pixels[3 * i];
      if (error.pixels[i] < 0 || uv[2] < 0.999F) continue;
      const std::size_t texel = std::size_t{cell(uv[1], height)} * width + cell(uv[0], width);
      sums[texel] += error.pixels[i];
      ++counts[texel];
    }
  }
  Image result{width, height, 1, {}};
  for (std::size_t i = 0; i < sums.size(); ++i) {
    result.pixels.push_back(counts[i] == 0 ? -1.0F : static_cast<float>(sums[i] / counts[i]));
  }
  return result;
}

}  // namespace kiln::cli
