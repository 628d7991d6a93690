#include <algorithm>
#include <vector>

#include "noise.h"
#include "scenes.h"

namespace kiln::sample {

Image terrain(std::uint32_t size) {
  Image heights{size, size, 1, std::vector<float>(std::size_t{size} * size)};
  const double step = 4.0 / (size - 1);
  double least = 1e300, most = -1e300;
  std::vector<double> raw(heights.pixels.size());
  for (std::uint32_t row = 0; row < size; ++row) {
    for (std::uint32_t column = 0; column < size; ++column) {
      const Point p{column * step, row * step, 0.37};
      // Coordinates are distorted, so that ridges wind. Valleys are smooth, peaks are rough.
      const Point bent{p.x + 0.35 * fractal_noise(0.9 * p, 3, 11),
                       p.y + 0.35 * fractal_noise(0.9 * p, 3, 23), p.z};
      const double lie = smooth_step(-0.7, 0.9, fractal_noise(0.55 * bent, 4, 5));
      const double value =
          lie * (0.35 + ridged_noise(bent, 9, 41)) + 0.02 * (1 - lie) * fractal_noise(7 * p, 5, 67);
      raw[std::size_t{row} * size + column] = value;
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  for (std::size_t i = 0; i < raw.size(); ++i) {
    heights.pixels[i] = static_cast<float>((raw[i] - least) / (most - least));
  }
  return heights;
}

}  // namespace kiln::sample
