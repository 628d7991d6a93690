#include "job/map_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "image/stored_values.h"
#include "job/job_options.h"
#include "kiln/image.h"

namespace kiln {
namespace {

// Half precision can turn an encoded 0 into a small negative value. Only lower values show that an image stores
// components in [-1, 1].
constexpr float kMinEncodedZero = -1e-3F;

bool is_match(const std::filesystem::path& path) {
  if (path.extension() != ".exr") return false;
  try {
    load_image(path);
    return false;
  } catch (const Error&) {
    // An EXR without colour channels is read as a saved match. If it is not a match either, the reader throws an error
    // that says so.
    return true;
  }
}

/// Conversions of values between maps and files.
}  // namespace

Image load_normal_map(const std::filesystem::path& path) {
  Image image = load_image(path);
  if (image.channels < 3) return image;
  const std::size_t texels = std::size_t{image.width} * image.height;
  const auto texel = [&](std::size_t i) { return &image.pixels[i * image.channels]; };
  bool has_negative = false;
  bool has_two_components = texels != 0;
  for (std::size_t i = 0; i < texels; ++i) {
    const float* p = texel(i);
    has_negative =
        has_negative || p[0] < kMinEncodedZero || p[1] < kMinEncodedZero || p[2] < kMinEncodedZero;
    has_two_components = has_two_components && p[2] == 0;
  }
  if (!has_negative && !has_two_components) return image;
  for (std::size_t i = 0; i < texels; ++i) {
    float* p = texel(i);
    for (int c = 0; c < 3 && has_negative; ++c) p[c] = p[c] * 0.5F + 0.5F;
    if (has_two_components) {
      const float x = 2 * p[0] - 1;
      const float y = 2 * p[1] - 1;
      p[2] = std::sqrt(std::max(0.0F, 1 - x * x - y * y)) * 0.5F + 0.5F;
    }
  }
  return image;
}

Image load_curvature(const std::filesystem::path& path) {
  const Image map = load_image(path);
  const bool exr = path.extension() == ".exr";
  Image curvature{map.width, map.height, 1, {}};
  float max_magnitude = exr ? 0.0F : 1.0F;
  for (std::size_t i = 0; i < map.pixels.size(); i += map.channels) {
    const float* p = &map.pixels[i];
    if (map.channels >= 3 && (p[0] != p[1] || p[0] != p[2])) {
      throw OptionError("'" + path.string() +
                            "' has colours, but a curvature map is grey: give the map of " +
                            option("maps") + " curvature.",
                        ErrorCode::input);
    }
    const float value = !std::isfinite(*p) ? 0 : exr ? *p : 2 * *p - 1;
    curvature.pixels.push_back(value);
    max_magnitude = std::max(max_magnitude, std::abs(value));
  }
  std::vector<float> magnitudes;
  for (const float value : curvature.pixels) {
    if (std::abs(value) > 1.01F / 255 * max_magnitude) magnitudes.push_back(std::abs(value));
  }
  float percentile = 1;
  if (!magnitudes.empty()) {
    const auto percentile_95 =
        magnitudes.begin() + static_cast<std::ptrdiff_t>((magnitudes.size() * 95 + 99) / 100 - 1);
    std::nth_element(magnitudes.begin(), percentile_95, magnitudes.end());
    percentile = *percentile_95;
  }
  for (float& value : curvature.pixels)
    value = std::clamp(value / percentile, -1.0F, 1.0F) / 2 + 0.5F;
  return curvature;
}

Image load_mask(const std::filesystem::path& path) {
  if (!is_match(path)) return load_image(path);
  const Match match = load_match(path);
  const std::uint32_t n = match.samples;
  Image mask{match.width / n, match.height / n, 1, {}};
  mask.pixels.resize(std::size_t{mask.width} * mask.height);
  for (std::size_t i = 0; i < match.triangle.size(); ++i) {
    const std::size_t x = i % match.width / n;
    const std::size_t y = i / match.width / n;
    if (match.triangle[i] < match.source_triangles) mask.pixels[y * mask.width + x] = 1;
  }
  return mask;
}

namespace {

/// The shortest decimal text that reads back as this value.
std::string shortest_decimal(float value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace

std::vector<ImageText> value_texts(const SaveImageOptions& options,
                                   const std::vector<ValueRange>& ranges, const std::string& unit) {
  std::vector<ImageText> texts;
  std::string text;
  for (const auto [low, high] : ranges) {
    text += (text.empty() ? "" : " ") + shortest_decimal(low) + " " + shortest_decimal(high);
  }
  if (!text.empty()) texts.push_back({"Range", text});
  if (!unit.empty()) texts.push_back({is_exr(options) ? "unit" : "Unit", unit});
  return texts;
}

std::vector<std::filesystem::path> save_image(const BakedMap& map,
                                              const std::filesystem::path& path,
                                              const SaveImageOptions& given) {
  SaveImageOptions options = given;
  if (options.use == TextureUse::values && map.info.type == MapType::color) {
    options.use = TextureUse::color;
  }
  if (options.use == TextureUse::values && map.info.type == MapType::unit_vector &&
      map.image.channels >= 3) {
    options.use = TextureUse::normal;
  }
  options.origin = map.origin;
  for (ImageText& text :
       value_texts(options, stored_ranges(map, options.format), std::string(map.unit))) {
    options.texts.push_back(std::move(text));
  }
  BakedMap copy;
  const bool converts = !map.stored && !holds_floats(options);
  if (converts) {
    copy = map;
    to_stored(copy, options.format);
  }
  const BakedMap& stored = converts ? copy : map;
  if (!map.mips.empty() && stores_mips_in_one_file(options)) {
    save_mipmapped(stored.image, stored.mips, path, options);
    return {path};
  }
  std::vector<std::filesystem::path> files;
  for (std::size_t level = 0; level <= map.mips.size(); ++level) {
    files.push_back(mip_level_file(path, level));
    save_image(level == 0 ? stored.image : stored.mips[level - 1], files.back(), options);
  }
  return files;
}

}  // namespace kiln
