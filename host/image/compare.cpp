#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/normal_angle.h"
#include "base/parallel.h"
#include "kiln/image.h"

namespace kiln {
namespace {

// Sums are accumulated within blocks of this many texels, then over the blocks in order, so that
// the result does not depend on the number of threads.
constexpr std::size_t kTexelsPerBlock = 4096;

double channel_error(float a, float b) {
  if (std::isfinite(a) && std::isfinite(b)) {
    return std::abs(static_cast<double>(a) - static_cast<double>(b));
  }
  return a == b || (std::isnan(a) && std::isnan(b)) ? 0.0 : 1.0;
}

struct BlockSums {
  std::uint64_t compared_values = 0;
  double angle_sum = 0, error_sum = 0;
  double max_angle = -1, max_error = -1;
  std::size_t worst_angle_texel = 0, worst_error_texel = 0;
};

BlockSums compare_block(const Image& a, const Image& b, const Image* mask, std::size_t first,
                        std::size_t last, std::vector<double>& angles) {
  BlockSums block_sums;
  const std::size_t channels = a.channels;
  for (std::size_t i = first; i < last; ++i) {
    if (mask != nullptr && mask->pixels[i * mask->channels] == 0.0F) continue;
    const float* texel_a = &a.pixels[i * channels];
    const float* texel_b = &b.pixels[i * channels];
    if (!angles.empty()) {
      const double angle = normal_angle_degrees(texel_a, texel_b);
      angles[first + block_sums.compared_values] = angle;
      block_sums.angle_sum += angle;
      if (angle > block_sums.max_angle)
        block_sums.max_angle = angle, block_sums.worst_angle_texel = i;
    }
    ++block_sums.compared_values;
    for (std::size_t c = 0; c < channels; ++c) {
      const double error = channel_error(texel_a[c], texel_b[c]);
      block_sums.error_sum += error;
      if (error > block_sums.max_error)
        block_sums.max_error = error, block_sums.worst_error_texel = i;
    }
  }
  return block_sums;
}

std::string size_text(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " with " +
         std::to_string(image.channels) + " channel" + (image.channels == 1 ? "" : "s");
}

void check_pixels(const Image& image, const char* what) {
  if (image.channels == 0 ||
      image.pixels.size() != std::size_t{image.width} * image.height * image.channels) {
    throw Error(ErrorCode::input, std::string("The ") + what + " image has the size " +
                                      size_text(image) + ", but holds " +
                                      std::to_string(image.pixels.size()) + " values.");
  }
}

void check_images(const Image& a, const Image& b, const Image* mask) {
  check_pixels(a, "first");
  check_pixels(b, "second");
  if (a.width == b.width && a.height == b.height && a.channels != b.channels) {
    throw Error(ErrorCode::input, "The images cannot be compared: one has " +
                                      std::to_string(a.channels) + " channels, the other " +
                                      std::to_string(b.channels) +
                                      ". Compare two maps of one kind.");
  }
  if (a.width != b.width || a.height != b.height) {
    throw Error(ErrorCode::input, "The images cannot be compared: one is " + size_text(a) +
                                      ", the other " + size_text(b) +
                                      ". Bake both at the same size.");
  }
  if (mask != nullptr) {
    check_pixels(*mask, "mask");
    if (mask->width != a.width || mask->height != a.height) {
      throw Error(ErrorCode::input, "The mask is " + size_text(*mask) + ", but the images are " +
                                        size_text(a) + ". Use a mask of their size.");
    }
  }
}

}  // namespace

ImageDifference compare_images(const Image& a, const Image& b, const Image* mask) {
  check_images(a, b, mask);
  const std::size_t texels = std::size_t{a.width} * a.height;
  const std::size_t block_count = (texels + kTexelsPerBlock - 1) / kTexelsPerBlock;
  std::vector<double> texel_angles(a.channels >= 3 ? texels : 0);
  std::vector<BlockSums> all_block_sums(block_count);
  parallel_for(block_count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      all_block_sums[i] = compare_block(a, b, mask, i * kTexelsPerBlock,
                                        std::min(texels, (i + 1) * kTexelsPerBlock), texel_angles);
    }
  });

  ImageDifference result;
  BlockSums total_sums;
  for (std::size_t i = 0; i < block_count; ++i) {
    const BlockSums& block_sums = all_block_sums[i];
    if (!texel_angles.empty()) {
      const auto from = texel_angles.begin() + static_cast<std::ptrdiff_t>(i * kTexelsPerBlock);
      std::copy(from, from + static_cast<std::ptrdiff_t>(block_sums.compared_values),
                texel_angles.begin() + static_cast<std::ptrdiff_t>(total_sums.compared_values));
    }
    total_sums.compared_values += block_sums.compared_values;
    total_sums.angle_sum += block_sums.angle_sum;
    total_sums.error_sum += block_sums.error_sum;
    if (block_sums.max_angle > total_sums.max_angle) {
      total_sums.max_angle = block_sums.max_angle;
      total_sums.worst_angle_texel = block_sums.worst_angle_texel;
    }
    if (block_sums.max_error > total_sums.max_error) {
      total_sums.max_error = block_sums.max_error;
      total_sums.worst_error_texel = block_sums.worst_error_texel;
    }
  }
  result.compared_texels = total_sums.compared_values;
  if (total_sums.compared_values == 0) return result;
  const auto count = static_cast<double>(total_sums.compared_values);
  result.mean_error = total_sums.error_sum / (count * a.channels);
  result.max_error = total_sums.max_error;
  std::size_t worst_texel = total_sums.worst_error_texel;
  if (!texel_angles.empty()) {
    texel_angles.resize(total_sums.compared_values);
    result.mean_angle_degrees = total_sums.angle_sum / count;
    result.max_angle_degrees = total_sums.max_angle;
    result.p99_angle_degrees = percentile(texel_angles, 99);
    result.p95_angle_degrees = percentile(texel_angles, 95);
    worst_texel = total_sums.worst_angle_texel;
  }
  result.worst_x = static_cast<std::uint32_t>(worst_texel % a.width);
  result.worst_y = static_cast<std::uint32_t>(worst_texel / a.width);
  return result;
}

Image image_differences(const Image& a, const Image& b, const Image* mask, bool by_channel) {
  check_images(a, b, mask);
  const bool compares_angles = a.channels >= 3 && !by_channel;
  Image result{a.width, a.height, 1, {}};
  result.pixels.resize(std::size_t{a.width} * a.height);
  parallel_for(result.pixels.size(), kTexelsPerBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (mask != nullptr && mask->pixels[i * mask->channels] == 0.0F) {
        result.pixels[i] = -1;
        continue;
      }
      const float* texel_a = &a.pixels[i * a.channels];
      const float* texel_b = &b.pixels[i * a.channels];
      double value = 0;
      if (compares_angles) {
        value = normal_angle_degrees(texel_a, texel_b);
      } else {
        for (std::size_t c = 0; c < a.channels; ++c) {
          value = std::max(value, channel_error(texel_a[c], texel_b[c]));
        }
      }
      result.pixels[i] = static_cast<float>(value);
    }
  });
  return result;
}

}  // namespace kiln
