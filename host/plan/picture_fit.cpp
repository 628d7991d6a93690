#include "plan/picture_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "base/parallel.h"
#include "base/srgb.h"
#include "kiln/image.h"
#include "kiln/map.h"

namespace kiln {
namespace {

/// Constants of the choice of encodings. Sizes are halved down to kMinPictureSide. At each size, kQualities are
/// tried, unless the bytes of the next smaller size show that a picture cannot fit.
struct PictureFitSettings {
  /// Smallest side in texels: in smaller maps, padding covers everything.
  static constexpr std::uint32_t kMinPictureSide = 16;
  /// Qualities of lossy pictures; consecutive ones differ by about 25% of the bytes. Below 35, a picture of a smaller
  /// size has a lower error.
  static constexpr std::array<std::uint32_t, 7> kQualities = {35, 50, 65, 78, 88, 94, 98};
  /// Number of estimated qualities between consecutive ones of kQualities.
  static constexpr std::uint32_t kIntermediateQualities = 2;
  /// Minimum factor by which bytes grow if the side doubles (measured: 2.2 to 4).
  static constexpr double kMinByteGrowth = 2.2;
  /// Number of byte classes of the knapsack: each covers 0.05% of the budget.
  static constexpr std::uint64_t kByteClasses = 2048;
};
using Fit = PictureFitSettings;

bool is_covered(std::span<const std::uint8_t> coverage, std::size_t texel) {
  if (coverage.empty()) return true;
  const auto state = TexelState{coverage[texel]};
  return state == TexelState::baked || state == TexelState::missed;
}

/// Converts texels to values whose mean is meaningful (colours in linear light, normals as vectors), and back.
void to_linear_values(TextureUse use, std::uint32_t channels, const float* texel, double* sum) {
  for (std::uint32_t c = 0; c < channels; ++c) {
    const double value = texel[c];
    sum[c] = use == TextureUse::normal && c < 3  ? 2 * value - 1
             : use == TextureUse::color && c < 3 ? from_srgb(value)
                                                 : value;
  }
}
void from_linear_values(TextureUse use, std::uint32_t channels, std::array<double, 4> mean,
                        float* texel) {
  if (use == TextureUse::normal) {
    const double length = std::hypot(mean[0], mean[1], mean[2]);
    if (!(length > 0)) mean = {0, 0, 1, mean[3]};
    for (std::size_t c = 0; c < 3 && length > 0; ++c) mean[c] /= length;
  }
  for (std::uint32_t c = 0; c < channels; ++c) {
    texel[c] = use == TextureUse::normal && c < 3  ? static_cast<float>(mean[c] / 2 + 0.5)
               : use == TextureUse::color && c < 3 ? to_srgb(static_cast<float>(mean[c]))
                                                   : static_cast<float>(mean[c]);
  }
}

/// An image and its successive halvings. Each texel is the mean of the covered texels below it; if there is no
/// covered texel, the value of the next coarser level.
std::vector<Image> covered_levels(const Image& full, std::span<const std::uint8_t> coverage,
                                  TextureUse use) {
  const std::uint32_t channels = full.channels;
  std::vector<Image> levels = {full};
  std::vector<std::vector<double>> weights(1);
  const std::size_t texels = std::size_t{full.width} * full.height;
  if (coverage.size() != texels) coverage = {};
  weights[0].resize(texels);
  for (std::size_t i = 0; i < texels; ++i) weights[0][i] = is_covered(coverage, i) ? 1 : 0;
  std::size_t measured_levels = 1;
  // Levels go down to one texel, whose value fills areas far from all charts. Levels whose size is not exactly half
  // of the previous one are used for filling only.
  while (levels.back().width > 1 || levels.back().height > 1) {
    const Image& from = levels.back();
    const std::vector<double>& from_weights = weights.back();
    Image half;
    half.width = (from.width + 1) / 2;
    half.height = (from.height + 1) / 2;
    const bool is_half = from.width % 2 == 0 && from.height % 2 == 0;
    if (measured_levels == levels.size() && is_half &&
        std::min(half.width, half.height) >= Fit::kMinPictureSide) {
      ++measured_levels;
    }
    half.channels = channels;
    half.pixels.resize(std::size_t{half.width} * half.height * channels);
    std::vector<double> weight(std::size_t{half.width} * half.height);
    parallel_for(half.height, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        for (std::size_t x = 0; x < half.width; ++x) {
          std::array<double, 4> sum{};
          double total = 0;
          for (std::size_t k = 0; k < 4; ++k) {
            const std::size_t at_x = 2 * x + k % 2, at_y = 2 * y + k / 2;
            if (at_x >= from.width || at_y >= from.height) continue;
            const double w = from_weights[at_y * from.width + at_x];
            if (w == 0) continue;
            std::array<double, 4> value{};
            to_linear_values(use, channels, from.at(at_x, at_y), value.data());
            for (std::size_t c = 0; c < 4; ++c) sum[c] += w * value[c];
            total += w;
          }
          weight[y * half.width + x] = total / 4;
          if (total == 0) continue;
          for (double& value : sum) value /= total;
          from_linear_values(use, channels, sum, half.at(x, y));
        }
      }
    });
    levels.push_back(std::move(half));
    weights.push_back(std::move(weight));
  }
  for (std::size_t level = levels.size() - 1; level-- > 1;) {
    const Image& coarse_level = levels[level + 1];
    Image& fine_level = levels[level];
    for (std::size_t y = 0; y < fine_level.height; ++y) {
      for (std::size_t x = 0; x < fine_level.width; ++x) {
        if (weights[level][y * fine_level.width + x] != 0) continue;
        std::copy_n(coarse_level.at(x / 2, y / 2), channels, fine_level.at(x, y));
      }
    }
  }
  levels.resize(measured_levels);
  return levels;
}

/// Samples an image bilinearly at relative coordinates of 0 to 1, clamped to the edges.
void read_bilinear(const Image& image, double x, double y, double* values) {
  const double column = std::clamp(x * image.width - 0.5, 0.0, image.width - 1.0);
  const double row = std::clamp(y * image.height - 0.5, 0.0, image.height - 1.0);
  const auto x0 = static_cast<std::size_t>(column), y0 = static_cast<std::size_t>(row);
  const std::size_t x1 = std::min<std::size_t>(x0 + 1, image.width - 1);
  const std::size_t y1 = std::min<std::size_t>(y0 + 1, image.height - 1);
  const double u = column - static_cast<double>(x0), v = row - static_cast<double>(y0);
  const float *const a = image.at(x0, y0), *const b = image.at(x1, y0), *const c = image.at(x0, y1),
                     *const d = image.at(x1, y1);
  for (std::uint32_t k = 0; k < image.channels; ++k) {
    values[k] = (1 - v) * ((1 - u) * a[k] + u * b[k]) + v * ((1 - u) * c[k] + u * d[k]);
  }
}

/// Mean difference between a map and a decoded picture of any size, over the map's covered texels.
PictureError error_over_texels(const Image& map, const Image& picture,
                               std::span<const std::uint8_t> coverage, TextureUse use) {
  struct Sum {
    double steps = 0, degrees = 0;
    std::uint64_t texels = 0;
  };
  if (coverage.size() != std::size_t{map.width} * map.height) coverage = {};
  std::vector<Sum> rows(map.height);
  parallel_for(map.height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < map.width; ++x) {
        if (!is_covered(coverage, y * map.width + x)) continue;
        // Alpha remains 1 for opaque pictures, which store no alpha.
        std::array<double, 4> picture_value{1, 1, 1, 1};
        const bool is_same_size = picture.width == map.width && picture.height == map.height;
        if (is_same_size) {
          for (std::uint32_t c = 0; c < picture.channels; ++c)
            picture_value[c] = picture.at(x, y)[c];
        } else {
          read_bilinear(picture, (static_cast<double>(x) + 0.5) / map.width,
                        (static_cast<double>(y) + 0.5) / map.height, picture_value.data());
        }
        if (picture.channels < 3) picture_value[1] = picture_value[2] = picture_value[0];
        const float* const map_value = map.at(x, y);
        double squares = 0;
        if (use == TextureUse::normal) {
          std::array<double, 3> a{}, b{};
          double dot = 0, square_a = 0, square_b = 0;
          for (std::size_t c = 0; c < 3; ++c) {
            a[c] = 2.0 * map_value[c] - 1;
            b[c] = 2 * picture_value[c] - 1;
            dot += a[c] * b[c];
            square_a += a[c] * a[c];
            square_b += b[c] * b[c];
          }
          const double cosine =
              std::clamp(dot / std::sqrt(std::max(square_a * square_b, 1e-30)), -1.0, 1.0);
          rows[y].degrees += std::acos(cosine) * 180 / 3.14159265358979323846;
          squares = (1 - cosine) / 2;  // Square of half the distance between two unit vectors
        } else {
          for (std::uint32_t c = 0; c < map.channels; ++c) {
            const double difference = map_value[c] - picture_value[c];
            squares += std::isfinite(difference) ? difference * difference : 1;
          }
        }
        rows[y].steps += 255 * std::sqrt(squares);
        ++rows[y].texels;
      }
    }
  });
  Sum total;
  for (const Sum& row : rows) {
    total.steps += row.steps;
    total.degrees += row.degrees;
    total.texels += row.texels;
  }
  const double count = static_cast<double>(std::max<std::uint64_t>(total.texels, 1));
  return {total.steps / count, total.degrees / count};
}

/// Encodings to try for a picture, lossless ones first.
std::vector<PictureEncoding> encodings_of(const PictureFitOptions& options, TextureUse use,
                                          bool has_alpha) {
  const EncodeMapsOptions& encode = options.encode;
  const bool is_normal = use == TextureUse::normal;
  PictureEncoding lossless{.dither = encode.dither, .use = use, .smallest = encode.smallest};
  PictureFormat lossy_format = options.any_format ? PictureFormat::jpeg : encode.format;
  if (lossy_format == PictureFormat::webp) lossless.format = lossy_format;
  const bool can_be_lossy =
      lossy_format != PictureFormat::png && !(has_alpha && lossy_format == PictureFormat::jpeg);
  const std::uint32_t fixed_quality = is_normal ? 0 : encode.quality;
  std::vector<PictureEncoding> list;
  const bool only_jpeg = !options.any_format && lossy_format == PictureFormat::jpeg;
  if (!can_be_lossy || (fixed_quality == 0 && (is_normal || !only_jpeg))) list.push_back(lossless);
  if (!can_be_lossy) return list;
  std::vector<std::uint32_t> qualities(Fit::kQualities.begin(), Fit::kQualities.end());
  if (options.all_qualities) {
    qualities.clear();
    for (std::uint32_t quality = Fit::kQualities.front(); quality <= Fit::kQualities.back();
         quality += 3) {
      qualities.push_back(quality);
    }
  }
  if (fixed_quality != 0) qualities = {fixed_quality};
  for (const std::uint32_t quality : qualities) {
    PictureEncoding& next = list.emplace_back(lossless);
    next.format = lossy_format;
    next.quality = quality;
  }
  return list;
}

/// Encodes a picture; nullopt if the format is not built in.
std::optional<std::vector<std::byte>> try_encode(const Image& image,
                                                 const PictureEncoding& encoding, bool any_format) {
  if (!any_format) return encode_picture(image, encoding);
  try {
    return encode_picture(image, encoding);
  } catch (const Error&) {
    if (encoding.format == PictureFormat::png) throw;
    return std::nullopt;  // builds without libjpeg can only write PNG
  }
}

/// Sorts choices by bytes, and removes those that a smaller picture with at most the same error dominates.
void keep_pareto_optimal(PictureEncodings& picture_encodings) {
  std::stable_sort(picture_encodings.choices.begin(), picture_encodings.choices.end(),
                   [](const PictureChoice& a, const PictureChoice& b) {
                     return std::pair(a.bytes, a.error.steps) < std::pair(b.bytes, b.error.steps);
                   });
  double min_steps = HUGE_VAL;
  std::erase_if(picture_encodings.choices, [&](const PictureChoice& choice) {
    if (choice.error.steps >= min_steps) return true;
    min_steps = choice.error.steps;
    return false;
  });
}

PictureEncodings measure_encodings(PictureSlot picture, const Image& full, TextureUse use,
                                   std::span<const std::uint8_t> coverage,
                                   const PictureFitOptions& options) {
  const std::vector<Image> levels = covered_levels(full, coverage, use);
  const auto error_of = [&](const Image& decoded) {
    if (use == TextureUse::normal && options.normal_error) return options.normal_error(decoded);
    return error_over_texels(full, decoded, coverage, use);
  };
  const bool has_alpha = full.channels == 4;
  const std::vector<PictureEncoding> encodings = encodings_of(options, use, has_alpha);
  PictureEncodings picture_encodings;
  picture_encodings.picture = picture;
  picture_encodings.levels.resize(levels.size());
  std::vector<double> bytes_before(encodings.size(), 0);
  const auto max_bytes = static_cast<double>(options.max_picture_bytes);
  for (std::size_t level = levels.size(); level-- > 0;) {
    Image rounded = levels[level];
    for (float& value : rounded.pixels) {
      value = std::floor(std::clamp(value, 0.0F, 1.0F) * 255 + 0.5F) / 255;
    }
    picture_encodings.levels[level] = error_of(rounded);
    for (std::size_t i = 0; i < encodings.size(); ++i) {
      if (Fit::kMinByteGrowth * bytes_before[i] > max_bytes) continue;
      PictureChoice choice;
      choice.level = level;
      choice.width = levels[level].width;
      choice.height = levels[level].height;
      choice.encoding = encodings[i];
      auto data = try_encode(levels[level], encodings[i], options.any_format);
      if (!data) continue;
      choice.bytes = (data->size() + 3) / 4 * 4;
      bytes_before[i] = static_cast<double>(choice.bytes);
      choice.data = std::move(*data);
      choice.error = error_of(load_image(choice.data));
      if (use == TextureUse::normal && options.encode.max_normal_error > 0 &&
          choice.encoding.is_lossy() &&
          error_over_texels(levels[level], load_image(choice.data), {}, use).degrees >
              options.encode.max_normal_error) {
        continue;
      }
      picture_encodings.choices.push_back(std::move(choice));
    }
  }
  keep_pareto_optimal(picture_encodings);
  return picture_encodings;
}

}  // namespace

std::vector<PictureEncodings> encode_pictures(const AssetMaps& maps,
                                              const PictureFitOptions& options) {
  std::vector<PictureEncodings> encodings_by_picture;
  const auto add = [&](PictureSlot picture, const Image& image, TextureUse use) {
    if (image.pixels.empty()) return;
    encodings_by_picture.push_back(measure_encodings(picture, image, use, maps.coverage, options));
  };
  if (maps.normal != nullptr) add(PictureSlot::normal, *maps.normal, TextureUse::normal);
  add(PictureSlot::color, color_picture(maps), TextureUse::color);
  add(PictureSlot::surface, surface_picture(maps), TextureUse::values);
  if (maps.emission != nullptr) add(PictureSlot::emission, *maps.emission, TextureUse::color);
  return encodings_by_picture;
}

void add_intermediate_qualities(PictureEncodings& picture_encodings) {
  std::map<std::size_t, const PictureChoice*> lower_quality;  // by level
  std::vector<PictureChoice> all = picture_encodings.choices;
  for (const PictureChoice& high : picture_encodings.choices) {
    if (!high.encoding.is_lossy()) continue;
    const PictureChoice* const low = std::exchange(lower_quality[high.level], &high);
    if (low == nullptr) continue;
    for (std::uint32_t i = 1; i <= Fit::kIntermediateQualities; ++i) {
      const double share = i / (Fit::kIntermediateQualities + 1.0);
      const auto interpolate = [share](double from, double to) {
        return from > 0 && to > 0 ? from * std::pow(to / from, share) : from + (to - from) * share;
      };
      PictureChoice& next = all.emplace_back();
      next.level = high.level;
      next.width = high.width;
      next.height = high.height;
      next.encoding = high.encoding;
      next.encoding.quality = static_cast<std::uint32_t>(std::lround(
          low->encoding.quality + (1.0 * high.encoding.quality - low->encoding.quality) * share));
      next.bytes = static_cast<std::uint64_t>(
          interpolate(static_cast<double>(low->bytes), static_cast<double>(high.bytes)));
      next.error = {interpolate(low->error.steps, high.error.steps),
                    interpolate(low->error.degrees, high.error.degrees)};
    }
  }
  picture_encodings.choices = std::move(all);
  keep_pareto_optimal(picture_encodings);
}

std::uint64_t least_bytes(std::span<const PictureEncodings> encodings_by_picture) {
  std::uint64_t sum = 0;
  for (const PictureEncodings& picture_encodings : encodings_by_picture)
    sum += picture_encodings.choices.front().bytes;
  return sum;
}

std::optional<PictureFit> least_error(std::span<const PictureEncodings> encodings_by_picture,
                                      std::uint64_t bytes) {
  // Knapsack by dynamic programming: of all combinations of choices whose bytes lie in one class, only the one with
  // the smallest error is kept. The classes are finer than the steps between qualities, so the loss is negligible.
  const std::uint64_t step = bytes / Fit::kByteClasses + 1;
  std::map<std::uint64_t, PictureFit> sums;
  sums[0] = {};
  for (const PictureEncodings& picture_encodings : encodings_by_picture) {
    std::map<std::uint64_t, PictureFit> next;
    for (const auto& [byte_class, sum] : sums) {
      for (std::size_t i = 0; i < picture_encodings.choices.size(); ++i) {
        const PictureChoice& choice = picture_encodings.choices[i];
        const std::uint64_t total_bytes = sum.bytes + choice.bytes;
        if (total_bytes > bytes) break;
        const double error = sum.error + picture_encodings.weight * choice.error.steps;
        const auto [entry, is_new] = next.try_emplace(total_bytes / step);
        if (!is_new && entry->second.error <= error) continue;
        entry->second.choices = sum.choices;
        entry->second.choices.push_back(i);
        entry->second.bytes = total_bytes;
        entry->second.error = error;
      }
    }
    sums.clear();
    double min_error = HUGE_VAL;
    for (auto& [byte_class, sum] : next) {
      if (sum.error >= min_error) continue;
      min_error = sum.error;
      sums.emplace(byte_class, std::move(sum));
    }
    if (sums.empty()) return std::nullopt;
  }
  return std::prev(sums.end())->second;
}

}  // namespace kiln
