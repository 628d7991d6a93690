#include "bake/layers.h"

#include <algorithm>

#include "bake/encode_texels.h"
#include "bake/report.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/system_memory.h"
#include "image/gutter.h"

namespace kiln {
namespace {

// Padding that reaches across any map.
constexpr std::int32_t kUnlimitedPadding = 16384;

bool is_averaged(MapType type) { return type != MapType::id && type != MapType::coverage; }

GutterOptions padding_rules(const MapInfo& map, const BakeOptions& options, std::int32_t texels) {
  const bool fill = leaves_out_misses(map, options.encoding.miss);
  return {texels, fill, map.type == MapType::unit_vector};
}

/// Fills empty texels around charts. \returns number of padding texels
std::uint64_t pad(cl::Context& context, const MapInfo& map, const BakeOptions& options,
                  std::int32_t texels, Image& image, std::vector<std::uint8_t>& coverage) {
  GutterOptions gutter = padding_rules(map, options, texels);
  if (map.type != MapType::id) return fill_gutter(context, image, coverage, gutter);
  // Ids cannot be averaged. So empty texels get the nearest id instead of the averages of push-pull, and so do missed
  // texels.
  if (texels < 0) gutter.texels = kUnlimitedPadding;
  gutter.fill_missed = false;
  std::vector<std::uint8_t> coverage_to_fill = coverage;
  if (options.encoding.miss == MissPolicy::fill) {
    std::replace(coverage_to_fill.begin(), coverage_to_fill.end(), std::uint8_t{kCoverageMissed},
                 std::uint8_t{kCoverageEmpty});
  }
  const std::uint64_t count = fill_gutter(context, image, coverage_to_fill, gutter);
  for (std::size_t i = 0; i < coverage_to_fill.size(); ++i) {
    if (coverage[i] == kCoverageEmpty) coverage[i] = coverage_to_fill[i];
  }
  return count;
}

/// Adds weights for colours: transparent texels get the lowest weight, so they count only where all texels
/// are transparent.
ChartMap weigh_by_opacity(const Image& opacity, ChartMap charts) {
  constexpr float kMaxOpacityWeight = 255;  // At this limit, the sum of 256 weights fits in 16 bits
  if (charts.weight.empty()) charts.weight.assign(charts.chart.size(), 1);
  for (std::size_t i = 0; i < charts.weight.size(); ++i) {
    const float share = std::clamp(opacity.pixels[i], 0.0F, 1.0F);
    const float weight = static_cast<float>(charts.weight[i]) * kMaxOpacityWeight * share;
    charts.weight[i] = static_cast<std::uint16_t>(std::max(1.0F, weight));
  }
  return charts;
}

/// Converts normals to three channels in [0, 1], which renderers read, whatever the map's encoding is.
Image normals_as_rendered(const MapInfo& map, const BakeOptions& options,
                          const std::vector<std::uint8_t>& coverage, Image image) {
  BakeOptions raw_options;
  raw_options.encoding.space = options.encoding.space;
  raw_options.encoding.miss = options.encoding.miss;
  encode_texels(map, raw_options, coverage, image);
  return image;
}

/// True if no later stage of a bake needs whole images, so that maps can be finished row by row.
bool allows_rows(const BakeOptions& options) {
  return !options.encoding.mips && options.encoding.gutter >= 0 &&
         !options.encoding.two_component && options.match.fallback.empty() &&
         options.match.fallback_blend == 0 && options.match.visibility.clusters == 1 &&
         !options.report.errors;
}

/// True if a map's texels depend only on texels within the padding's width.
bool allows_rows(const MapInfo& map, const BakeOptions& options) {
  return is_averaged(map.type) && !leaves_out_misses(map, options.encoding.miss);
}

/// Memory in bytes that grows with the map: maps, temporary arrays of padding, mip levels, a band, and a stored
/// match. It is checked before the bake, so that the bake does not fail halfway.
/// \param by_rows  true: maps that can be finished row by row are not kept
std::uint64_t peak_bytes(const BakeOptions& options, std::span<const MapRow> rows,
                         std::uint32_t band, bool by_rows) {
  // Number of channels of all maps, plus one for the memory that coverage and chart indices take
  std::uint64_t channels = 1;
  const auto count = [&](const MapInfo& map) {
    if (!by_rows || !allows_rows(map, options)) channels += map.channels;
  };
  for (const MapKind kind : options.maps) count(map_row(kind).info);
  for (const MapRow& row : rows) count(row.info);
  const std::uint64_t texels = std::uint64_t{options.width} * options.height;
  const std::uint64_t level = texels * channels * sizeof(float);
  const std::uint64_t samples = texels * options.samples * options.samples;
  // Bytes of a band per sample: 80 were measured, including the arrays in the lines above
  constexpr std::uint64_t kBytesPerBandSample = 64;
  constexpr std::uint64_t kBytesPerKeptSample = 4 * sizeof(float) + 1;
  // Memory for mip levels: a third of that for the maps, and 8 bytes per texel for a copy of the largest map's levels
  // and for the texel's chart index.
  return level + (options.encoding.mips ? level / 3 + texels * 2 * sizeof(float) : 0) +
         kBytesPerBandSample * std::min<std::uint64_t>(samples, band) +
         (options.report.keep_match ? kBytesPerKeptSample * samples : 0);
}

}  // namespace

Layers::Layers(const Source::Impl& source, const LowSurface& surface, const BakeOptions& options,
               ImageStorage storage, std::uint32_t footprint_divisor, bool is_reference)
    : rows_(context_of(source.device), options) {
  own_rows_ = own_rows(options);
  const bool by_rows =
      storage == ImageStorage::rows && allows_rows(options) && !any_map_obeys_max_error(options);
  if (storage != ImageStorage::none) {
    require_memory("The maps",
                   peak_bytes(options, own_rows_, band_samples(source, options), by_rows));
    coverage_.resize(std::size_t{options.width} * options.height);
  }
  const MapRequest request{source,          surface,           options,
                           shared_results_, footprint_divisor, is_reference};
  band_reads_ = request.reads();
  const auto add = [&](const MapRow& row) {
    if (std::any_of(layers_.begin(), layers_.end(),
                    [&](const Layer& layer) { return layer.row == &row; })) {
      return;
    }
    Image image{options.width, options.height, row.info.channels, {}};
    layers_.push_back({&row, row.make(request), std::move(image), {}});
    if (by_rows && allows_rows(row.info, options)) layers_.back().rows = rows_.add(row.info);
  };
  for (const MapKind kind : options.maps) add(map_row(kind));
  for (const MapRow& row : own_rows_) add(row);
  for (Layer& layer : layers_) {
    if (layer.rows) continue;
    const std::size_t values = coverage_.size() * layer.image.channels;
    layer.image.pixels.reserve(values);
    unwritten_bytes_ += values * sizeof(float);
  }
  count_unwritten(static_cast<std::int64_t>(unwritten_bytes_));
}

Layers::~Layers() { count_unwritten(-static_cast<std::int64_t>(unwritten_bytes_)); }

void Layers::extend(Image& image, std::size_t texels) {
  std::vector<float>& pixels = image.pixels;
  const std::size_t old_size = pixels.size(), new_size = texels * image.channels;
  if (new_size <= old_size) return;
  const std::size_t bytes = (new_size - old_size) * sizeof(float);
  auto* const first = reinterpret_cast<std::byte*>(pixels.data() + old_size);
  constexpr std::size_t kBytesPerTask = std::size_t{1} << 20;
  parallel_for(bytes, kBytesPerTask, [&](std::size_t begin, std::size_t end) {
    os::populate_pages(first + begin, end - begin);
  });
  pixels.resize(new_size);
  unwritten_bytes_ -= bytes;
  count_unwritten(-static_cast<std::int64_t>(bytes));
}

void Layers::extend_images() {
  for (Layer& layer : layers_) {
    if (!layer.rows) extend(layer.image, coverage_.size());
  }
  if (rows_.empty()) return;
  rows_.extend(layers_.front().image.height);
  rows_.finish(coverage_);
}

BandPixels Layers::pixels(Layer& layer, const TexelBand& band) {
  const std::size_t width = layer.image.width;
  const std::size_t offset = band.first_row * width, count = band.row_count * width;
  if (layer.rows) {
    rows_.extend(band.first_row + band.row_count);
    return {rows_.rows(*layer.rows, band.first_row, band.row_count),
            std::span(coverage_).subspan(offset, count)};
  }
  extend(layer.image, offset + count);
  const std::size_t channels = layer.image.channels;
  return {std::span(layer.image.pixels).subspan(offset * channels, count * channels),
          std::span(coverage_).subspan(offset, count)};
}

void Layers::run(const TexelBand& band, const DeviceCorrespondence& match) {
  for (Layer& layer : layers_) layer.map_maker->run(band, match, pixels(layer, band));
}

void Layers::run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                         const DeviceCorrespondence& other, const cl::Array<float>& shares) {
  shared_results_.next_band();
  for (Layer& layer : layers_) {
    layer.map_maker->run_blended(band, match, other, shares, pixels(layer, band));
  }
}

void Layers::recompute_texels(const TexelBand& part, const DeviceCorrespondence& match,
                              std::span<const std::size_t> places) {
  shared_results_.next_band();
  std::vector<float> values;
  std::vector<std::uint8_t> coverage(places.size());
  for (Layer& layer : layers_) {
    // Maps that depend on positions change in every texel, so they are not recomputed in part
    if (layer.row->follows_positions) continue;
    const std::size_t channels = layer.image.channels;
    values.resize(channels * places.size());
    layer.map_maker->run(part, match, {values, coverage});
    for (std::size_t i = 0; i < places.size(); ++i) {
      std::copy_n(&values[channels * i], channels, &layer.image.pixels[channels * places[i]]);
    }
  }
}

const Image* Layers::unit_vectors() const {
  for (const Layer& layer : layers_) {
    if (layer.row->info.type == MapType::unit_vector) return &layer.image;
  }
  return nullptr;
}

bool Layers::any_map_depends_on_positions() const {
  return std::any_of(layers_.begin(), layers_.end(),
                     [](const Layer& layer) { return layer.row->follows_positions; });
}

bool Layers::any_map_reads_around() const {
  return std::any_of(layers_.begin(), layers_.end(),
                     [](const Layer& layer) { return layer.row->reads_around; });
}

bool Layers::any_map_obeys_max_error(const BakeOptions& options) const {
  const std::vector<double> bounds = occlusion_error_bounds(options);
  // Errors are at most 1, so a bound of 1 or more is always met.
  return std::any_of(bounds.begin(), bounds.end(), [](double bound) { return bound < 1; });
}

bool Layers::any_map_fills_misses() const {
  return std::any_of(layers_.begin(), layers_.end(), [](const Layer& layer) {
    return layer.row->info.missed == MissedTexels::neighbours;
  });
}

bool Layers::any_map_needs_visibility() const {
  return std::any_of(layers_.begin(), layers_.end(),
                     [](const Layer& layer) { return obeys(layer.row->info, "match.visibility"); });
}

std::vector<std::vector<Image>> Layers::mips(cl::Context& context, const BakeOptions& options,
                                             const ChartMap& charts) const {
  std::vector<std::vector<Image>> mip_levels_of_maps(layers_.size());
  const auto opacity = std::find_if(layers_.begin(), layers_.end(),
                                    [](const Layer& layer) { return layer.row->weights; });
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const MapInfo& map = layers_[l].row->info;
    if (!is_averaged(map.type)) continue;
    MipOptions mip_options;
    mip_options.unit_vectors = map.type == MapType::unit_vector;
    mip_options.missed_have_values =
        !padding_rules(map, options, options.encoding.gutter).fill_missed;
    if (options.encoding.miss == MissPolicy::mark && mip_options.unit_vectors) {
      mip_options.missed = {1, -1, 1, 0};
    }
    std::int32_t gutter = options.encoding.gutter;
    const bool is_weighted_by_opacity = layers_[l].row->weighted && opacity != layers_.end();
    const ChartMap weighted =
        is_weighted_by_opacity ? weigh_by_opacity(opacity->image, charts) : ChartMap();
    for (MipLevel& level : make_mips(layers_[l].image, coverage_,
                                     is_weighted_by_opacity ? weighted : charts, mip_options)) {
      if (gutter > 0) gutter = std::max(2, gutter / 2);
      pad(context, map, options, gutter, level.image, level.coverage);
      encode_texels(map, options, level.coverage, level.image);
      mip_levels_of_maps[l].push_back(std::move(level.image));
    }
  }
  return mip_levels_of_maps;
}

/// Pads a map, and all other maps with the same charts and padding rules. \returns the indices of the padded maps
std::vector<std::size_t> Layers::pad_with(cl::Context& context, const BakeOptions& options,
                                          std::size_t first, std::vector<Image>& images,
                                          std::vector<std::uint8_t>& coverage,
                                          std::uint64_t& padded) const {
  const bool has_missed_texels =
      std::find(coverage_.begin(), coverage_.end(), kCoverageMissed) != coverage_.end();
  // Maps of ids need their own padding rules if texels were missed, or if padding is unlimited.
  const auto needs_own_rules = [&](const MapInfo& map) {
    return map.type == MapType::id && (has_missed_texels || options.encoding.gutter < 0);
  };
  const MapInfo& map = layers_[first].row->info;
  coverage = coverage_;
  if (!rows_.empty()) {  // The padding of these maps is marked already
    std::replace(coverage.begin(), coverage.end(), std::uint8_t{kCoverageGutter},
                 std::uint8_t{kCoverageEmpty});
  }
  if (needs_own_rules(map)) {
    padded = pad(context, map, options, options.encoding.gutter, images[first], coverage);
    return {first};
  }
  const GutterOptions gutter = padding_rules(map, options, options.encoding.gutter);
  std::vector<std::size_t> same_rule_maps;
  std::vector<GutterImage> gutter_images;
  for (std::size_t l = first; l < images.size(); ++l) {
    const MapInfo& other = layers_[l].row->info;
    const GutterOptions other_gutter = padding_rules(other, options, options.encoding.gutter);
    if (layers_[l].rows || other.type == MapType::coverage || needs_own_rules(other)) continue;
    if (has_missed_texels && other_gutter.fill_missed != gutter.fill_missed) continue;
    same_rule_maps.push_back(l);
    gutter_images.push_back({&images[l], other_gutter.unit_vectors});
  }
  padded = fill_gutters(context, gutter_images, coverage, gutter);
  return same_rule_maps;
}

std::vector<Image> Layers::finish(cl::Context& context, const BakeOptions& options, bool keep,
                                  std::vector<std::uint8_t>& coverage, std::uint64_t& padded,
                                  Image* drawn) {
  std::vector<Image> images;
  for (Layer& layer : layers_) images.push_back(keep ? layer.image : std::move(layer.image));
  std::vector<std::uint8_t> is_map_padded(images.size());
  std::size_t last = 0;  // index of the last padded map
  std::optional<std::size_t> first_by_rows;
  std::size_t last_by_rows = 0;
  coverage.clear();
  for (std::size_t first = 0; first < images.size(); ++first) {
    if (layers_[first].rows) {
      if (!first_by_rows) first_by_rows = first;
      last_by_rows = first;
      continue;
    }
    if (is_map_padded[first] != 0 || layers_[first].row->info.type == MapType::coverage) continue;
    std::vector<std::uint8_t> full_coverage;
    std::uint64_t count = 0;
    const std::vector<std::size_t> same_rule_maps =
        pad_with(context, options, first, images, full_coverage, count);
    for (const std::size_t l : same_rule_maps) {
      const MapInfo& map = layers_[l].row->info;
      if (drawn != nullptr && layers_[l].row->is_shading_normal) {
        *drawn = normals_as_rendered(map, options, full_coverage, images[l]);
      }
      encode_texels(map, options, full_coverage, images[l]);
      is_map_padded[l] = 1;
    }
    if (same_rule_maps.back() >= last) {
      last = same_rule_maps.back();
      padded = count;
    }
    if (coverage.empty() && !first_by_rows) coverage = std::move(full_coverage);
  }
  if (first_by_rows) {
    if (coverage.empty()) coverage = std::move(coverage_);
    if (last_by_rows >= last) padded = rows_.padded();
  }
  if (coverage.empty()) {
    // The coverage includes padding, even if there is no map to pad.
    coverage = coverage_;
    Image empty_image{options.width, options.height, 1, std::vector<float>(coverage.size())};
    padded =
        fill_gutter(context, empty_image, coverage,
                    {options.encoding.gutter, options.encoding.miss != MissPolicy::keep, false});
  }
  return images;
}

void Layers::finish_texels(const BakeOptions& options, std::span<const std::size_t> places,
                           const Adjacency& padding, std::vector<BakedMap>& maps) const {
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const MapInfo& map = layers_[l].row->info;
    if (map.type == MapType::coverage) continue;
    const Image& raw = layers_[l].image;
    Image& finished = maps[l].image;
    const std::size_t channels = raw.channels;
    const auto write_texel = [&](std::size_t from, std::size_t to, std::uint8_t coverage) {
      float* pixel = &finished.pixels[channels * to];
      std::copy_n(&raw.pixels[channels * from], channels, pixel);
      encode_texel(map, options, coverage, pixel);
    };
    parallel_for(places.size(), 1 << 12, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t place = places[i];
        write_texel(place, place, coverage_[place]);
        for (const std::uint32_t copy : padding.of(place))
          write_texel(place, copy, kCoverageGutter);
      }
    });
  }
}

Adjacency Layers::padding_copies(cl::Context& context, std::int32_t texels) const {
  const std::uint32_t width = layers_.front().image.width;
  Image places{width, layers_.front().image.height, 2, {}};
  places.pixels.resize(coverage_.size() * 2);
  for (std::size_t i = 0; i < coverage_.size(); ++i) {
    places.pixels[2 * i] = static_cast<float>(i % width);
    const std::size_t y = i / width;
    places.pixels[2 * i + 1] = static_cast<float>(y);
  }
  std::vector<std::uint8_t> coverage = coverage_;
  fill_gutter(context, places, coverage, {texels, false, false});
  return Adjacency::make(coverage_.size(), coverage_.size(), [&](std::size_t i) {
    if (coverage[i] != kCoverageGutter) return coverage_.size();
    return static_cast<std::size_t>(places.pixels[2 * i + 1]) * width +
           static_cast<std::size_t>(places.pixels[2 * i]);
  });
}

}  // namespace kiln
