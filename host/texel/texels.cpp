#include "texel/texels.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/counted.h"
#include "base/percent.h"
#include "texel/texel_bins.h"
#include "texel/texel_pieces.h"

namespace kiln {
namespace {

void check_options(const TexelOptions& options) {
  const auto in_range = [](std::uint32_t size) { return size >= 1 && size <= 16384; };
  if (!in_range(options.width) || !in_range(options.height)) {
    throw Error(ErrorCode::usage, "The map's size is " + std::to_string(options.width) + "x" +
                                      std::to_string(options.height) +
                                      ": each side must be 1 to 16384 texels.");
  }
  if (options.samples < 1 || options.samples > 16) {
    throw Error(ErrorCode::usage, "samples is " + std::to_string(options.samples) +
                                      ": it must be 1 to 16 (N x N samples a texel).");
  }
}

/// Grows an array to at least `size` elements; growing discards its contents.
template <typename T>
void grow_to(cl::Context& context, cl::Array<T>& array, std::size_t size) {
  if (array.size() >= size) return;
  array = cl::Array<T>();
  array = cl::Array<T>(context, size + size / 8);
}

template <typename T>
void upload(cl::Context& context, cl::Array<T>& array, const std::vector<T>& data) {
  grow_to(context, array, data.size());
  array.write(context, std::span<const T>(data));
}

}  // namespace

struct TexelSampler::Impl {
  /// Two triangles that cover the same sample.
  struct Overlap {
    bool found = false;
    std::int32_t y = 0, x = 0;  ///< First row and column of the block, in samples
    std::uint32_t row = 0, column = 0;
    std::uint32_t lower = 0, upper = 0;
  };

  Impl(cl::Context& context_, const LowSurface& surface, const TexelOptions& options)
      : context(context_),
        grid(TexelGrid::of(options.width, options.height, options.samples,
                           options.max_samples_per_band)),
        pieces(TexelPieces::of(surface, options.width * options.samples,
                               options.height * options.samples)),
        small(assign_texels(surface, options)),
        bins(grid, pieces),
        is_band_sampled(grid.band_count(), false),
        slots(grid.slot_table()) {
    cover = context.kernel("texel", "kiln_texel_cover");
    fill = context.kernel("texel", "kiln_texel_fill");
    device_slots = cl::Array<kiln_int>(context, std::span<const kiln_int>(slots));
    device_pieces =
        cl::Array<kiln_texel_piece>(context, std::span<const kiln_texel_piece>(pieces.pieces));
    device_corners =
        cl::Array<kiln_texel_corners>(context, std::span<const kiln_texel_corners>(pieces.corners));
    // From here on, only the device uses the corners, so the host's copy is freed
    pieces.corners = {};
    report.warnings = pieces.warnings;
  }

  SmallCharts assign_texels(const LowSurface& surface, const TexelOptions& options) {
    if (!options.small_charts) return {};
    SmallCharts charts =
        SmallCharts::of(surface, pieces, options.width, options.height, options.samples);
    pieces.add_assigned_texels(surface, charts.texels, options.width, options.height,
                               options.samples);
    return charts;
  }

  kiln_texel_params params(std::uint32_t first_row) const {
    kiln_texel_params result{};
    result.block_count = static_cast<kiln_uint>(current_bins.blocks.size());
    result.group_count = grid.slot_groups;
    result.block_texels = grid.block_texels * grid.block_texels;
    result.texel_samples = grid.samples * grid.samples;
    result.samples = grid.samples;
    result.shift = pieces.fraction_bits;
    result.sample_width = static_cast<kiln_int>(grid.width * grid.samples);
    result.sample_height = static_cast<kiln_int>(grid.height * grid.samples);
    result.width = grid.width;
    result.first_row = first_row;
    return result;
  }

  TexelBand sample(std::uint32_t index, TexelBand&& recycled);
  void record_overlap(const kiln_texel_block& block);
  void warn_about_overlaps();

  cl::Context& context;
  TexelGrid grid;
  TexelPieces pieces;
  SmallCharts small;
  TexelBins bins;
  TexelReport report;
  std::vector<bool> is_band_sampled;
  Overlap overlap;
  std::vector<kiln_int> slots;
  TexelBins::Bins current_bins;
  std::vector<std::uint32_t> counts, first_samples, first_texels;

  cl::Kernel cover, fill;
  cl::Array<kiln_int> device_slots;
  cl::Array<kiln_texel_piece> device_pieces;
  cl::Array<kiln_texel_corners> device_corners;
  cl::Array<kiln_texel_block> device_blocks;
  cl::Array<std::uint32_t> device_lists, device_ids, device_counts, device_first_samples,
      device_first_texels;
};

/// Finds the overlapping triangles of a block in which the device has counted overlaps.
void TexelSampler::Impl::record_overlap(const kiln_texel_block& block) {
  if (overlap.found && std::pair(overlap.y, overlap.x) <= std::pair(block.y, block.x)) return;
  const std::size_t pitch = std::size_t{8} * grid.slot_groups;
  const std::size_t count = std::size_t{grid.block_samples} * grid.block_samples;
  for (std::size_t slot = 0; slot < count; ++slot) {
    const std::int64_t x = std::int64_t{block.x} + slots[slot];
    const std::int64_t y = std::int64_t{block.y} + slots[pitch + slot];
    if (x >= std::int64_t{grid.width} * grid.samples ||
        y >= std::int64_t{grid.height} * grid.samples)
      continue;
    const kiln_texel_piece* first = nullptr;
    for (std::uint32_t entry = block.list_begin; entry < block.list_end; ++entry) {
      const kiln_texel_piece& piece = pieces.pieces[current_bins.piece_lists[entry]];
      bool is_inside_triangle = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::int64_t e =
            (piece.a[k] * x + piece.b[k] * y) * (std::int64_t{1} << pieces.fraction_bits) +
            piece.c[k];
        is_inside_triangle =
            is_inside_triangle && (e > 0 || (e == 0 && ((piece.closed >> k) & 1U) != 0));
      }
      if (!is_inside_triangle) continue;
      if (first == nullptr) {
        first = &piece;
      } else if (first->triangle != piece.triangle) {
        overlap = {true,
                   block.y,
                   block.x,
                   static_cast<std::uint32_t>(y / grid.samples),
                   static_cast<std::uint32_t>(x / grid.samples),
                   first->triangle,
                   piece.triangle};
        return;
      }
    }
  }
}

void TexelSampler::Impl::warn_about_overlaps() {
  if (report.overlapping_samples == 0) return;
  std::erase_if(report.warnings, [](const Warning& w) { return w.code == "uv-overlap"; });
  report.warnings.insert(
      report.warnings.begin(),
      {"uv-overlap",
       "UV triangles of the low poly overlap on " + counted(report.overlapping_samples, "sample") +
           " (" +
           percent(static_cast<double>(report.overlapping_samples) /
                   static_cast<double>(report.samples)) +
           " of those covered), for example triangles " + std::to_string(overlap.lower) + " and " +
           std::to_string(overlap.upper) + " at texel column " + std::to_string(overlap.column) +
           ", row " + std::to_string(overlap.row) +
           ": the triangle with the lowest index was baked there. Give the charts places of their "
           "own, unless they share texels on purpose.",
       report.overlapping_samples});
}

TexelBand TexelSampler::Impl::sample(std::uint32_t index, TexelBand&& recycled) {
  TexelBand band = std::move(recycled);
  band.first_row = index * grid.band_rows();
  band.row_count = std::min(grid.band_rows(), grid.height - band.first_row);
  band.texel_count = 0;
  band.sample_count = 0;
  band.samples = grid.samples;
  band.small_triangles = small.triangles.empty() ? nullptr : &small.triangles;

  bins.fill(index, current_bins);
  const std::size_t block_count = current_bins.blocks.size();
  kiln_texel_params parameters = params(band.first_row);
  upload(context, device_blocks, current_bins.blocks);
  upload(context, device_lists, current_bins.piece_lists);
  grow_to(context, device_counts, block_count);
  grow_to(context, device_ids, block_count * 8 * grid.slot_groups);
  context.launch(cover, block_count, kLocal, parameters, device_blocks, device_lists, device_pieces,
                 device_slots, device_ids, device_counts);
  counts.resize(block_count);
  device_counts.read(context, std::span(counts));

  first_samples.resize(block_count);
  first_texels.resize(block_count);
  std::uint64_t overlaps = 0;
  for (std::size_t i = 0; i < block_count; ++i) {
    first_samples[i] = band.sample_count;
    first_texels[i] = band.texel_count;
    band.sample_count += KILN_TEXEL_SAMPLES(counts[i]);
    band.texel_count += KILN_TEXEL_TEXELS(counts[i]);
    const std::uint32_t overlapping = KILN_TEXEL_OVERLAPS(counts[i]);
    overlaps += overlapping;
    if (overlapping != 0) record_overlap(current_bins.blocks[i]);
  }

  grow_to(context, band.texel_index, band.texel_count);
  grow_to(context, band.texel_first, band.texel_count + std::size_t{1});
  const std::size_t room = std::min({band.sample_slot.size(), band.triangle.size(),
                                     band.barycentric.size() / 2, band.points.size() / 7});
  band.capacity = static_cast<std::uint32_t>(room);
  if (room < band.sample_count) {
    // Allocates an eighth more, so that bands with slightly more samples reuse the arrays. Old arrays are released
    // first, to avoid holding both.
    band.capacity = band.sample_count + band.sample_count / 8;
    band.sample_slot = {};
    band.triangle = {};
    band.barycentric = {};
    band.points = {};
    band.sample_slot = cl::Array<std::uint32_t>(context, band.capacity);
    band.triangle = cl::Array<std::uint32_t>(context, band.capacity);
    band.barycentric = cl::Array<float>(context, std::size_t{2} * band.capacity);
    band.points = cl::Array<float>(context, std::size_t{7} * band.capacity);
  }
  parameters.capacity = band.capacity;
  if (band.sample_count != 0) {
    upload(context, device_first_samples, first_samples);
    upload(context, device_first_texels, first_texels);
    context.launch(fill, block_count, kLocal, parameters, device_blocks, device_first_samples,
                   device_first_texels, device_pieces, device_corners, device_slots, device_ids,
                   band.texel_index, band.texel_first, band.sample_slot, band.triangle,
                   band.barycentric, band.points);
  }
  band.texel_first.write(context, std::span<const std::uint32_t>(&band.sample_count, 1),
                         band.texel_count);

  if (!is_band_sampled[index]) {
    is_band_sampled[index] = true;
    report.texels += band.texel_count;
    report.samples += band.sample_count;
    report.overlapping_samples += overlaps;
    warn_about_overlaps();
  }
  return band;
}

TexelSampler::TexelSampler(cl::Context& context, const LowSurface& surface,
                           const TexelOptions& options) {
  check_options(options);
  impl_ = std::make_unique<Impl>(context, surface, options);
}
TexelSampler::~TexelSampler() = default;
TexelSampler::TexelSampler(TexelSampler&&) noexcept = default;

std::uint32_t TexelSampler::band_count() const { return impl_->grid.band_count(); }

TexelBand TexelSampler::sample(std::uint32_t band, TexelBand recycled) {
  if (band >= band_count()) {
    throw Error(ErrorCode::internal, "Band " + std::to_string(band) + " of " +
                                         std::to_string(band_count()) + " is out of range.");
  }
  return impl_->sample(band, std::move(recycled));
}

const TexelReport& TexelSampler::report() const { return impl_->report; }
const SmallCharts& TexelSampler::small_charts() const { return impl_->small; }

}  // namespace kiln
