// Checks the map that main.cpp baked: a gable, whose left half leans to -X and whose right half to +X.
#include <kiln/image.h>

#include <cmath>
#include <cstdio>

namespace {

bool near(const kiln::Image& map, std::size_t x, double slope) {
  // The gable's normals are smooth: a face's own at the eaves, straight up at the ridge.
  const float* texel = map.at(x, map.height / 2);
  const double expected[3] = {slope / 2 + 0.5, 0.5, 1};
  for (int channel = 0; channel < 3; ++channel) {
    if (!(std::abs(texel[channel] - expected[channel]) < 0.004)) {
      std::fprintf(stderr, "texel %zu, channel %d: %f instead of %f\n", x, channel,
                   static_cast<double>(texel[channel]), expected[channel]);
      return false;
    }
  }
  return true;
}

}  // namespace

int main() {
  const kiln::Image map = kiln::load_image("normal.png");
  if (map.width != 1024 || map.height != 1024 || map.channels < 3) {
    std::fprintf(stderr, "the map is %u x %u x %u\n", map.width, map.height, map.channels);
    return 1;
  }
  return near(map, 20, -0.04) && near(map, 512, 0) && near(map, 1003, 0.04) ? 0 : 1;
}
