// Quantisation errors of 8-bit pictures.
#include "io/image/stored_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/normal_angle.h"
#include "base/parallel.h"
#include "io/image/gpu_texture.h"
#include "io/image/picture.h"
#include "io/image/png.h"
#include "kiln/image.h"

namespace kiln {
namespace {

constexpr std::size_t kBandRows = 4;  // Number of rows per block

/// z of a unit normal, computed from x and y. All three are encoded as n/2 + 1/2.
float z_of_xy(float x, float y) {
  const float a = 2 * x - 1, b = 2 * y - 1;
  return std::sqrt(std::max(0.0F, 1 - a * a - b * b)) / 2 + 0.5F;
}

/// Some rows of an image as they would be decoded from a file, which may have fewer channels.
class StoredRows {
 public:
  /// \param first_row  the file's row with which the image begins; 0 for textures and lossy formats
  StoredRows(const Image& image, std::size_t first_row, const SaveImageOptions& options,
             const DitherBlocks& dither, const Image& lossy)
      : image_(image),
        first_row_(first_row),
        dither_(dither),
        lossy_(lossy),
        bytes_(std::size_t{image.width} * kBandRows * image.channels) {
    const bool texture = is_texture(options.format);
    if (texture) format_ = TextureFormat::of(image, options.use);
    channels_ = texture && format_.in_blocks ? format_.channels : image.channels;
    decoded_values_.resize(std::size_t{image.width} * kBandRows * channels_);
  }

  std::size_t channels() const { return channels_; }
  const float* at(std::size_t x, std::size_t row) const {
    return &decoded_values_[(row * image_.width + x) * channels_];
  }

  void read(std::size_t band) {
    if (!lossy_.pixels.empty()) return read_lossy(band);
    if (!format_.in_blocks) return read_bytes(band);
    encode_blocks(image_, format_, band, bytes_.data());
    const std::uint8_t* from = bytes_.data();
    for (std::size_t x = 0; x < image_.width; x += kBandRows) {
      for (std::size_t c = 0; c < channels_; ++c, from += 8) {
        const BlockValues block = decode_bc4({from, 8});
        for (std::size_t i = 0; i < block.size(); ++i) {
          decoded_values_[(i / kBandRows * image_.width + x + i % kBandRows) * channels_ + c] =
              block[i] / 255;
        }
      }
    }
  }

 private:
  void read_bytes(std::size_t band) {
    const std::size_t row = std::size_t{image_.width} * channels_;
    for (std::size_t k = 0; k < kBandRows; ++k) {
      const std::size_t y = kBandRows * band + k;
      if (y < first_row_ || y >= first_row_ + image_.height) continue;
      quantise_row(image_, 8, dither_, y, bytes_.data(), first_row_);
      for (std::size_t i = 0; i < row; ++i)
        decoded_values_[k * row + i] = static_cast<float>(bytes_[i]) / 255;
    }
  }

  void read_lossy(std::size_t band) {
    for (std::size_t k = 0; k < kBandRows && kBandRows * band + k < image_.height; ++k) {
      for (std::size_t x = 0; x < image_.width; ++x) {
        const float* const from = lossy_.at(x, kBandRows * band + k);
        // A file does not store alpha if it is opaque everywhere
        for (std::size_t c = 0; c < channels_; ++c) {
          decoded_values_[(k * image_.width + x) * channels_ + c] =
              c < lossy_.channels ? from[c] : 1;
        }
      }
    }
  }

  const Image& image_;
  std::size_t first_row_;
  const DitherBlocks& dither_;
  const Image& lossy_;
  TextureFormat format_{};
  std::size_t channels_ = 0;
  std::vector<std::uint8_t> bytes_;
  std::vector<float> decoded_values_;
};

/// Squared error of a texel, or for normals, the angle.
double error_of(const float* value, std::size_t channels, const float* stored,
                std::size_t stored_channels, TextureUse use) {
  const bool is_normal = use == TextureUse::normal || use == TextureUse::tangent_normal;
  if (is_normal && channels >= 2) {
    const bool is_two_channel = channels == 2 || stored_channels == 2 || value[2] == 0;
    const std::array<float, 3> back{stored[0], stored[1],
                                    is_two_channel ? z_of_xy(stored[0], stored[1]) : stored[2]};
    const std::array<float, 3> own{
        value[0], value[1],
        channels == 2 || value[2] == 0 ? z_of_xy(value[0], value[1]) : value[2]};
    return normal_angle_degrees(own.data(), back.data());
  }
  double max_error = 0;
  for (std::size_t c = 0; c < std::min(channels, stored_channels); ++c) {
    const double error = std::abs(double{value[c]} - stored[c]) * 255;
    max_error = std::max(max_error, std::isfinite(error) ? error : 255.0);
  }
  return max_error;
}

}  // namespace

StoredErrorSums::StoredErrorSums(std::size_t height)
    : sums_((height + kBandRows - 1) / kBandRows) {}

void StoredErrorSums::add(const Image& rows, std::size_t first_row, const SaveImageOptions& options,
                          const DitherBlocks& dither, const Image& lossy,
                          std::span<const std::uint8_t> coverage) {
  constexpr std::uint8_t kBakedState = 1;  // TexelState::baked
  const std::size_t end = first_row + rows.height, first_band = first_row / kBandRows;
  const std::size_t bands = (end + kBandRows - 1) / kBandRows - first_band;
  parallel_for(bands, 4, [&](std::size_t begin, std::size_t stop) {
    StoredRows stored(rows, first_row, options, dither, lossy);
    for (std::size_t band = first_band + begin; band < first_band + stop; ++band) {
      stored.read(band);
      Sum& sum = sums_[band];
      for (std::size_t k = 0; k < kBandRows; ++k) {
        if (kBandRows * band + k < first_row || kBandRows * band + k >= end) continue;
        const std::size_t y = kBandRows * band + k - first_row;
        for (std::size_t x = 0; x < rows.width; ++x) {
          if (!coverage.empty() && coverage[y * rows.width + x] != kBakedState) continue;
          const double error = error_of(rows.at(x, y), rows.channels, stored.at(x, k),
                                        stored.channels(), options.use);
          sum.sum += error;
          sum.max = std::max(sum.max, error);
          ++sum.texels;
        }
      }
    }
  });
}

void StoredErrorSums::add(const Image& rows, std::size_t first_row, const SaveImageOptions& options,
                          std::span<const std::uint8_t> coverage) {
  const bool dithers =
      options.dither && !is_texture(options.format) && options.format != ImageFormat::tiff8;
  const DitherBlocks dither(rows, dithers ? Dither::on : Dither::off);
  add(rows, first_row, options, dither, Image(), coverage);
}

StoredError StoredErrorSums::error() const {
  Sum all;
  for (const Sum& sum : sums_) {
    all.sum += sum.sum;
    all.max = std::max(all.max, sum.max);
    all.texels += sum.texels;
  }
  return {all.texels == 0 ? 0 : all.sum / static_cast<double>(all.texels), all.max};
}

StoredError error_of_stored(const Image& image, const SaveImageOptions& options,
                            std::span<const std::uint8_t> coverage) {
  StoredErrorSums sums(image.height);
  sums.add(image, 0, options, coverage);
  return sums.error();
}

StoredError picture_error(const Image& image, const PictureEncoding& encoding,
                          std::span<const std::uint8_t> coverage) {
  SaveImageOptions options;
  options.format = ImageFormat::png8;
  options.use = encoding.use;
  const bool lossy = encoding.is_lossy();
  StoredErrorSums sums(image.height);
  sums.add(image, 0, options,
           lossy ? DitherBlocks() : DitherBlocks(image, encoding.dither, encoding.use),
           lossy ? load_image(encode_picture(image, encoding)) : Image(), coverage);
  return sums.error();
}

}  // namespace kiln
