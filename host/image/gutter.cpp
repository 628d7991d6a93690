#include "image/gutter.h"

#include <algorithm>
#include <atomic>
#include <span>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "image/push_pull.h"
#include "shared/image.h"

namespace kiln {
namespace {

// Number of keys per band. It limits the device memory and the time of a launch, and is small
// enough that a band's keys stay in the cache.
constexpr std::size_t kKeysPerBand = std::size_t{1} << 22;

// Makes the device's mask of some rows: 1 for texels whose values may be copied. Rows are padded to
// a multiple of 8 texels. Texels that earlier bands have filled are not copied from.
void make_mask(const Image& image, std::span<const std::uint8_t> coverage, std::uint32_t first,
               std::uint32_t count, std::uint32_t stride, bool missed_is_source,
               std::span<std::uint8_t> mask) {
  parallel_for(count, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      const std::uint8_t* from = &coverage[(first + y) * image.width];
      std::uint8_t* to = &mask[y * stride];
      for (std::size_t x = 0; x < image.width; ++x) {
        const bool source =
            from[x] == kCoverageBaked || (missed_is_source && from[x] == kCoverageMissed);
        to[x] = source ? 1 : 0;
      }
      std::fill(to + image.width, to + stride, std::uint8_t{0});
    }
  });
}

/// A texel that is filled, and the texel whose value it gets.
struct CopiedTexel {
  std::size_t texel, source;
};

template <std::size_t kChannels>
void copy_values(std::span<const CopiedTexel> copies, float* pixels) {
  for (const auto [texel, source] : copies) {
    std::copy_n(&pixels[source * kChannels], kChannels, &pixels[texel * kChannels]);
  }
}

void copy_values(std::span<const CopiedTexel> copies, Image& image) {
  float* const pixels = image.pixels.data();
  if (image.channels == 1) return copy_values<1>(copies, pixels);
  if (image.channels == 2) return copy_values<2>(copies, pixels);
  if (image.channels == 3) return copy_values<3>(copies, pixels);
  copy_values<4>(copies, pixels);
}

// Fills empty texels of a band with the values at the offsets that the device has found.
// \param first_row  the band's first row in the image
// \returns the number of texels that were filled
template <typename Offset, int kShift>
std::uint64_t fill_copies(std::span<const GutterImage> images, std::span<std::uint8_t> coverage,
                          const kiln_gutter_band& band, std::size_t first_row,
                          const std::vector<Offset>& offsets) {
  constexpr std::int64_t kBias = std::int64_t{1} << (kShift - 1);
  const std::size_t width = images.front().image->width;
  std::atomic<std::uint64_t> total{0};
  parallel_for(band.row_count, 16, [&](std::size_t begin, std::size_t end) {
    std::uint64_t count = 0;
    std::vector<CopiedTexel> copies;
    for (std::size_t row = begin; row < end; ++row) {
      const std::size_t y = first_row + row;
      const Offset* from = &offsets[row * band.stride];
      copies.clear();
      for (std::size_t x = 0; x < width; ++x) {
        std::uint8_t& state = coverage[y * width + x];
        if (from[x] == 0 || state != kCoverageEmpty) continue;
        const std::int64_t dy = static_cast<std::int64_t>(from[x] >> kShift) - kBias;
        const std::int64_t dx =
            static_cast<std::int64_t>(from[x] & ((Offset{1} << kShift) - 1)) - kBias;
        const std::size_t texel = y * width + x;
        const auto offset_in_texels =
            static_cast<std::size_t>(dy * static_cast<std::int64_t>(width) + dx);
        copies.push_back({texel, texel + offset_in_texels});
        state = kCoverageGutter;
      }
      for (const GutterImage& image : images) copy_values(copies, *image.image);
      count += copies.size();
    }
    total += count;
  });
  return total;
}

template <typename Key, typename Offset, int kShift>
std::uint64_t fill_nearest(cl::Context& context, std::span<const GutterImage> images,
                           std::span<std::uint8_t> coverage, const RowRange& filled,
                           std::uint32_t radius, bool missed_is_source, const char* defines) {
  const Image& image = *images.front().image;
  kiln_gutter_band band{};
  band.stride = (image.width + 7) / 8 * 8;
  band.pad = (radius + 7) / 8 * 8;
  band.radius = radius;
  const std::size_t key_stride = band.stride + 2 * std::size_t{band.pad};
  const std::uint32_t filled_rows = filled.last - filled.first;
  const auto rows = static_cast<std::uint32_t>(std::clamp<std::size_t>(
      kKeysPerBand / key_stride, std::min<std::size_t>(64, filled_rows), filled_rows));
  // The kernel reads `radius` rows above and below each tile, so smaller tiles would mostly repeat
  // work.
  band.tile_rows = std::min(rows, std::max(64U, radius));

  // A band copies texels at most `radius` rows away. If that is most of the image, all bands share
  // one mask.
  const std::uint32_t mask_rows =
      rows + 2 * radius < image.height / 2 ? rows + 2 * radius : image.height;
  cl::Array<std::uint8_t> mask(context, std::size_t{band.stride} * mask_rows);
  cl::Array<Key> keys(context, key_stride * rows);
  cl::Array<Offset> offsets(context, std::size_t{band.stride} * rows);
  context.fill(keys, static_cast<Key>(0x7F7F7F7F7F7F7F7FULL));
  const cl::Kernel columns = context.kernel("image", "kiln_image_search_columns", defines);
  const cl::Kernel nearest = context.kernel("image", "kiln_image_search_rows", defines);

  std::uint64_t count = 0;
  std::vector<Offset> found(offsets.size());
  for (std::uint32_t first = filled.first; first < filled.last; first += rows) {
    band.row_count = std::min(rows, filled.last - first);
    const std::uint32_t top = mask_rows < image.height && first > radius ? first - radius : 0;
    if (mask_rows < image.height || first == filled.first) {
      band.height = std::min(mask_rows, image.height - top);
      mask.write_by(
          context, std::size_t{band.stride} * band.height, [&](std::span<std::uint8_t> sources) {
            make_mask(image, coverage, top, band.height, band.stride, missed_is_source, sources);
          });
    }
    band.first_row = first - top;
    const std::size_t groups = band.stride / 8;
    const std::size_t tiles = (band.row_count + band.tile_rows - 1) / band.tile_rows;
    context.launch(columns, groups * tiles, kLocal, band, mask, keys);
    context.launch(nearest, groups * band.row_count, kLocal, band, mask, keys, offsets);
    offsets.read(context, found);
    count += fill_copies<Offset, kShift>(images, coverage, band, first, found);
  }
  return count;
}

std::uint64_t fill_nearest(cl::Context& context, std::span<const GutterImage> images,
                           std::span<std::uint8_t> coverage, const RowRange& filled,
                           std::uint32_t radius, bool missed_is_source) {
  const Image& image = *images.front().image;
  // No distance exceeds the diagonal, which is shorter than this sum
  radius = std::min(radius, image.width + image.height);
  if (radius <= KILN_GUTTER_NARROW_RADIUS) {
    return fill_nearest<std::uint32_t, std::uint16_t, KILN_GUTTER_NARROW_SHIFT>(
        context, images, coverage, filled, radius, missed_is_source, "");
  }
  radius = std::min<std::uint32_t>(radius, KILN_GUTTER_WIDE_RADIUS);
  return fill_nearest<std::uint64_t, std::uint32_t, KILN_GUTTER_WIDE_SHIFT>(
      context, images, coverage, filled, radius, missed_is_source, "-DKILN_GUTTER_WIDE=1");
}

// Fills missed texels by push-pull and, with `everywhere`, also empty ones.
// \returns the number of empty texels that were filled
std::uint64_t fill_smooth(std::span<const GutterImage> images, std::span<std::uint8_t> coverage,
                          const GutterOptions& options, bool everywhere) {
  const std::size_t texels = coverage.size();
  std::vector<std::uint8_t> is_known(texels);
  std::vector<std::uint8_t> is_wanted(texels);
  std::atomic<std::uint64_t> empty{0};
  std::atomic<bool> has_wanted_texels{false};
  parallel_for(texels, std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
    std::uint64_t empty_here = 0;
    bool has_wanted_here = false;
    for (std::size_t i = begin; i < end; ++i) {
      const bool missed = coverage[i] == kCoverageMissed && options.fill_missed;
      // With `everywhere`, padding from the step before is used as known data. Otherwise it is not,
      // since it only repeats baked texels, which are used already.
      is_known[i] =
          coverage[i] != kCoverageEmpty && !missed && (everywhere || coverage[i] != kCoverageGutter)
              ? 1
              : 0;
      is_wanted[i] = missed || (everywhere && coverage[i] == kCoverageEmpty) ? 1 : 0;
      has_wanted_here = has_wanted_here || is_wanted[i] != 0;
      if (coverage[i] == kCoverageEmpty) ++empty_here;
    }
    empty += empty_here;
    if (has_wanted_here) has_wanted_texels = true;
  });
  if (!has_wanted_texels) return 0;
  for (const GutterImage& image : images) {
    if (!push_pull(*image.image, is_known, is_wanted, image.unit_vectors)) return 0;
  }
  if (!everywhere) return 0;
  parallel_for(texels, std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (coverage[i] == kCoverageEmpty) coverage[i] = kCoverageGutter;
    }
  });
  return empty;
}

/// \throws Error(internal) for images and a coverage of different sizes
void check_sizes(std::span<const GutterImage> images, std::span<const std::uint8_t> coverage) {
  const Image& first = *images.front().image;
  const std::size_t texels = std::size_t{first.width} * first.height;
  for (const GutterImage& gutter_image : images) {
    const Image& image = *gutter_image.image;
    if (texels == 0 || image.width != first.width || image.height != first.height ||
        image.channels < 1 || image.channels > 4 || coverage.size() != texels ||
        image.pixels.size() != texels * image.channels) {
      throw Error(ErrorCode::internal,
                  "Padding needs images of one size with 1 to 4 channels, and a coverage with one "
                  "value per texel.");
    }
  }
}

}  // namespace

std::uint64_t fill_gutter(cl::Context& context, Image& image, std::span<std::uint8_t> coverage,
                          const GutterOptions& options) {
  const GutterImage one{&image, options.unit_vectors};
  return fill_gutters(context, {&one, 1}, coverage, options);
}

std::uint64_t fill_gutters(cl::Context& context, std::span<const GutterImage> images,
                           std::span<std::uint8_t> coverage, const GutterOptions& options) {
  if (options.texels < -1) {
    throw Error(ErrorCode::usage, "The padding is " + std::to_string(options.texels) +
                                      " texels; use 0 or more, or -1 to fill everything.");
  }
  if (images.empty()) return 0;
  check_sizes(images, coverage);
  const bool everywhere = options.texels == -1;
  std::uint64_t count = 0;
  if (options.texels != 0) {
    const auto radius = everywhere ? 1U : static_cast<std::uint32_t>(options.texels);
    count = fill_nearest(context, images, coverage, {0, images.front().image->height}, radius,
                         !options.fill_missed);
  }
  if (everywhere || options.fill_missed)
    count += fill_smooth(images, coverage, options, everywhere);
  return count;
}

std::uint64_t fill_gutter_rows(cl::Context& context, std::span<const GutterImage> images,
                               std::span<std::uint8_t> coverage, std::uint32_t texels,
                               const RowRange& rows) {
  if (images.empty() || texels == 0 || rows.first >= rows.last) return 0;
  check_sizes(images, coverage);
  return fill_nearest(context, images, coverage, rows, texels, /*missed_is_source=*/true);
}

}  // namespace kiln
