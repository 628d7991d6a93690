// Converts baked maps to the pictures of a material.
#include "asset/asset_maps.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "kiln/image_format.h"

namespace kiln {
namespace {

/// Scales emission to [0, 1].
/// \returns the emission that the value 1 stands for; 0 if there is no emission
float scale_emission(Image& image) {
  float strength = 0;
  for (const float value : image.pixels) {
    if (std::isfinite(value)) strength = std::max(strength, value);
  }
  if (strength <= 1) return strength > 0 ? 1.0F : 0.0F;
  for (float& value : image.pixels) value /= strength;
  return strength;
}

/// Repeats the channel of a grey picture, so that it has three.
void expand_grey(Image& image) {
  if (image.channels != 1) return;
  std::vector<float> pixels(3 * image.pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = image.pixels[i / 3];
  image.pixels = std::move(pixels);
  image.channels = 3;
}

/// Combines baked ambient occlusion with the occlusion picture of the high poly. The smaller value
/// is used, since both darken the same folds.
void combine_occlusion(Image& ao, const Image& picture) {
  const std::size_t texels = std::size_t{ao.width} * ao.height;
  for (std::size_t i = 0; i < texels; ++i) {
    float& value = ao.pixels[i * ao.channels];
    value = std::min(value, picture.pixels[i * picture.channels]);
  }
}

}  // namespace

AssetMaps asset_maps(std::span<BakedMap> maps,
                     const std::function<void(BakedMap&, const std::string&)>& before,
                     std::string* left) {
  AssetMaps places;
  Image* ao = nullptr;
  for (BakedMap& map : maps) {
    const std::string name = std::string(map.kind.name);
    if (name == "emission") {
      places.emission_strength = scale_emission(map.image);
      // A texture set without any emission gets no emission map
      if (places.emission_strength == 0) continue;
    }
    if (before) before(map, name);
    to_stored(map, ImageFormat::png8);
    if (name == "emission") expand_grey(map.image);
    if (name == "occlusion" && places.occlusion != nullptr) {
      combine_occlusion(*ao, map.image);
      continue;
    }
    if (name == "ao") ao = &map.image;
    // If several maps fit a slot, the last one is used: the normal maps of the high poly contain
    // more detail than the normals of its geometry.
    if (const Image** const slot = slot_of(places, name); slot != nullptr) {
      *slot = &map.image;
    } else if (left != nullptr) {
      *left += (left->empty() ? "" : ", ") + name;
    }
  }
  return places;
}

AssetMaps asset_maps(std::span<BakedMap> maps, std::string* left) {
  return asset_maps(maps, {}, left);
}

}  // namespace kiln
