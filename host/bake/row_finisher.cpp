#include "bake/row_finisher.h"

#include <algorithm>

#include "bake/encode_texels.h"
#include "base/parallel.h"
#include "image/gutter.h"

namespace kiln {
namespace {

// Number of values in one task of a parallel copy or fill
constexpr std::size_t kValuesPerTask = std::size_t{1} << 18;

void copy_values(const float* from, std::size_t count, float* to) {
  parallel_for(count, kValuesPerTask, [&](std::size_t begin, std::size_t end) {
    std::copy(from + begin, from + end, to + begin);
  });
}

}  // namespace

RowFinisher::RowFinisher(cl::Context& context, const BakeOptions& options)
    : context_(context),
      options_(options),
      padding_(static_cast<std::uint32_t>(options.encoding.gutter)) {}

std::size_t RowFinisher::add(const MapInfo& map) {
  maps_.push_back({map, Image{options_.width, 0, map.channels, {}}, nullptr});
  return maps_.size() - 1;
}

void RowFinisher::extend(std::uint32_t end_row) {
  if (end_row <= end_row_) return;
  for (Map& map : maps_) {
    std::vector<float>& pixels = map.window.pixels;
    map.window.height = end_row - first_row_;
    pixels.resize(std::size_t{map.window.width} * map.window.height * map.window.channels);
  }
  end_row_ = end_row;
}

std::span<float> RowFinisher::rows(std::size_t map, std::uint32_t first_row,
                                   std::uint32_t row_count) {
  Image& window = maps_[map].window;
  const std::size_t row = std::size_t{window.width} * window.channels;
  return std::span(window.pixels).subspan((first_row - first_row_) * row, row_count * row);
}

void RowFinisher::pass_rows_on(Map& map, std::span<const std::uint8_t> coverage,
                               std::uint32_t end_row) {
  finished_.width = map.window.width;
  finished_.height = end_row - final_end_;
  finished_.channels = map.window.channels;
  const std::size_t row = std::size_t{finished_.width} * finished_.channels;
  finished_.pixels.resize(finished_.height * row);
  copy_values(&map.window.pixels[(final_end_ - first_row_) * row], finished_.pixels.size(),
              finished_.pixels.data());
  encode_texels(map.info, options_, coverage, finished_);
  map.target->put(finished_, coverage);
}

void RowFinisher::finish(std::span<std::uint8_t> coverage) {
  const std::uint32_t end_row = end_row_ == options_.height ? end_row_
                                : end_row_ > padding_       ? end_row_ - padding_
                                                            : 0;
  if (end_row <= final_end_ || maps_.empty()) return;
  const std::size_t width = options_.width;
  std::vector<GutterImage> images;
  for (Map& map : maps_) images.push_back({&map.window, map.info.type == MapType::unit_vector});
  padded_ += fill_gutter_rows(context_, images,
                              coverage.subspan(first_row_ * width, (end_row_ - first_row_) * width),
                              padding_, {final_end_ - first_row_, end_row - first_row_});
  for (Map& map : maps_) {
    pass_rows_on(map, coverage.subspan(final_end_ * width, (end_row - final_end_) * width),
                 end_row);
  }
  final_end_ = end_row;
  // Rows stay in the window as long as later rows may copy from them
  const std::uint32_t first_row = end_row > padding_ ? end_row - padding_ : 0;
  for (Map& map : maps_) {
    const std::size_t row = std::size_t{map.window.width} * map.window.channels;
    const auto begin = map.window.pixels.begin();
    map.window.pixels.erase(begin,
                            begin + static_cast<std::ptrdiff_t>((first_row - first_row_) * row));
    map.window.height = end_row_ - first_row;
  }
  first_row_ = first_row;
}

}  // namespace kiln
