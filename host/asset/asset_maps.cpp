// Baked maps as the pictures of a material hold them.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "kiln/asset.h"
#include "kiln/bake.h"

namespace kiln {
namespace {

/// Brings emission into [0, 1]. \returns what 1 stands for; 0: nothing shines
float scale_emission(Image& image) {
  float strength = 0;
  for (const float value : image.pixels) {
    if (std::isfinite(value)) strength = std::max(strength, value);
  }
  if (strength <= 1) return strength > 0 ? 1.0F : 0.0F;
  for (float& value : image.pixels) value /= strength;
  return strength;
}

/// A grey picture as the three channels that colours have.
void spread_grey(Image& image) {
  if (image.channels != 1) return;
  std::vector<float> pixels(3 * image.pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = image.pixels[i / 3];
  image.pixels = std::move(pixels);
  image.channels = 3;
}

/// Darkens ambient occlusion by HIGH's own picture of it: the lesser of both, since they see the same folds.
void darken(Image& ao, const Image& picture) {
  const std::size_t texels = std::size_t{ao.width} * ao.height;
  for (std::size_t i = 0; i < texels; ++i) {
    float& value = ao.pixels[i * ao.channels];
    value = std::min(value, picture.pixels[i * picture.channels]);
  }
}

}  // namespace

AssetMaps asset_maps(std::span<BakedMap> maps,
                     const std::function<void(BakedMap&, const std::string&)>& store,
                     std::string* left) {
  AssetMaps places;
  Image* ao = nullptr;
  for (BakedMap& map : maps) {
    const std::string name = std::string(map.kind.name);
    if (name == "emission") {
      places.emission_strength = scale_emission(map.image);
      if (places.emission_strength == 0) continue;  // of this set
    }
    if (store) store(map, name);
    if (name == "emission") spread_grey(map.image);
    if (name == "occlusion" && places.occlusion != nullptr) {
      darken(*ao, map.image);
      continue;
    }
    if (name == "ao") ao = &map.image;
    // Later maps take the place of earlier ones: HIGH's normal maps over its shape tell more than its shape.
    if (const Image** const slot = slot_of(places, name); slot != nullptr) {
      *slot = &map.image;
    } else if (left != nullptr) {
      *left += (left->empty() ? "" : ", ") + name;
    }
  }
  return places;
}

}  // namespace kiln
