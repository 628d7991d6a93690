// Colours of weathered stone.
#include <algorithm>
#include <array>
#include <cmath>

#include "noise.h"
#include "scenes.h"

namespace kiln::sample {
namespace {

using Color = std::array<double, 3>;

Color mixed(const Color& a, const Color& b, double share) {
  Color color{};
  for (std::size_t c = 0; c < 3; ++c) color[c] = a[c] + (b[c] - a[c]) * share;
  return color;
}

/// sRGB, 0 to 1.
Color stone_at(const Point& p) {
  constexpr Color kPale = {0.80, 0.74, 0.64}, kWarm = {0.66, 0.52, 0.39},
                  kDark = {0.42, 0.38, 0.36};
  constexpr Color kLichen = {0.62, 0.60, 0.30}, kGrey = {0.66, 0.69, 0.64};
  const Point stretched{p.x * 1.5, p.y * 5, p.z * 1.5};  // strata
  Color color = mixed(kPale, kWarm, 0.5 + 0.6 * fractal_noise(stretched, 4, 11));
  color = mixed(color, kDark, smooth_step(0.1, 0.6, fractal_noise(6 * p, 4, 23)) * 0.7);
  const double patch = fractal_noise(3 * p, 5, 37);
  color = mixed(color, kLichen, smooth_step(0.16, 0.26, patch) * 0.85);
  color = mixed(color, kGrey, smooth_step(0.2, 0.28, fractal_noise(4 * p, 5, 51)) * 0.8);
  const double grain = 1 + 0.08 * gradient_noise(90 * p, 67);
  for (double& channel : color) channel = std::clamp(channel * grain, 0.0, 1.0);
  return color;
}

}  // namespace

void paint_stone(Mesh& mesh) {
  mesh.colors.clear();
  for (const Vec3& p : mesh.positions) {
    const Color color = stone_at({p.x, p.y, p.z});
    std::array<std::uint8_t, 4> bytes{0, 0, 0, 255};
    for (std::size_t c = 0; c < 3; ++c) {
      bytes[c] = static_cast<std::uint8_t>(std::lround(255 * color[c]));
    }
    mesh.colors.push_back(bytes);
  }
}

}  // namespace kiln::sample
