#include "image/mips.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "image/gutter.h"

namespace kiln {
namespace {

constexpr std::size_t kBlockRows = 16;
// Mean vectors shorter than this have no meaningful direction.
constexpr double kVanishingLength = 1e-6;
// Vectors are not normalized if their squared length differs from 1 by at most this. Normalizing
// would only change the last bit, and maps that are constant must stay constant.
constexpr double kUnitSlack = 1e-6;
// Two areas count as equal if their ratio is at least this; in maps with odd sides, rounding makes
// equal areas differ.
constexpr double kMinAreaRatio = 1 - 1e-9;

/// A fragment: what one chart covers of a texel.
template <std::size_t kChannels>
struct Fragment {
  double area = 0;  // Area in samples of level 0
  std::uint32_t chart = 0;
  std::array<float, kChannels> mean{};
};

/// The texels of level k - 1 that a texel of level k covers along one axis, and their weights.
struct Taps {
  std::size_t first = 0, count = 1;
  std::array<double, 3> weight{1, 1, 1};

  /// \param at    coordinate of the texel of level k
  /// \param fine  number of texels of level k - 1 along the axis
  static Taps of(std::size_t at, std::size_t fine) {
    if (fine == 1) return {};
    if (fine % 2 == 0) return {2 * at, 2, {1, 1, 0}};
    // If level k - 1 has 2m + 1 texels, a texel of level k is (2m + 1) / m of them wide. It
    // begins `at` / m of their width after the start of the first one that it covers.
    const std::size_t half = fine / 2;
    const auto m = static_cast<double>(half);
    const auto i = static_cast<double>(at);
    return {2 * at, 3, {(m - i) / m, 1, (i + 1) / m}};
  }
};

/// Describes level 0, on which each texel belongs to at most one chart.
template <std::size_t kChannels>
struct BaseLevel {
  const Image& image;
  std::span<const std::uint8_t> coverage;
  const ChartMap& charts;
  bool missed_have_values;

  std::uint32_t width() const { return image.width; }
  std::uint32_t height() const { return image.height; }
  bool is_missed(std::size_t x, std::size_t y) const {
    return !missed_have_values && coverage[y * image.width + x] == kCoverageMissed;
  }
  std::span<const Fragment<kChannels>> fragments(std::size_t x, std::size_t y,
                                                 Fragment<kChannels>& own) const {
    const std::size_t texel = y * image.width + x;
    const std::uint8_t state = coverage[texel];
    if (state != kCoverageBaked && (state != kCoverageMissed || !missed_have_values)) return {};
    own.area = charts.weight.empty() ? 1 : charts.weight[texel];
    own.chart = charts.chart[texel];
    std::copy_n(&image.pixels[texel * kChannels], kChannels, own.mean.begin());
    return {&own, 1};
  }
};

/// A coarser level. A texel has one fragment for each chart in it, sorted by chart.
template <std::size_t kChannels>
struct FragmentChain {
  struct Block {
    // Index of each texel's first fragment in `fragments`; the last entry is the number of fragments
    std::vector<std::uint32_t> first;
    std::vector<Fragment<kChannels>> fragments;
  };
  std::uint32_t level_width = 0, level_height = 0;
  std::vector<Block> blocks;  // The fragments of the level's texels, in blocks of kBlockRows rows
  // Coverage of each texel if missed texels have no values; otherwise empty
  std::vector<std::uint8_t> coverage;

  std::uint32_t width() const { return level_width; }
  std::uint32_t height() const { return level_height; }
  bool is_missed(std::size_t x, std::size_t y) const {
    return !coverage.empty() && coverage[y * level_width + x] == kCoverageMissed;
  }
  std::span<const Fragment<kChannels>> fragments(std::size_t x, std::size_t y,
                                                 Fragment<kChannels>&) const {
    const Block& block = blocks[y / kBlockRows];
    const std::size_t texel = y % kBlockRows * level_width + x;
    return {block.fragments.data() + block.first[texel],
            block.first[texel + 1] - block.first[texel]};
  }
};

template <std::size_t kChannels>
constexpr std::size_t kVector = std::min<std::size_t>(3, kChannels);

template <std::size_t kChannels>
double squared_length(const std::array<float, kChannels>& v) {
  double squared = 0;
  for (std::size_t c = 0; c < kVector<kChannels>; ++c) squared += double{v[c]} * v[c];
  return squared;
}

/// Area and mean of several fragments of one chart.
template <std::size_t kChannels>
class FragmentSum {
 public:
  void add(const Fragment<kChannels>& fragment, double weight) {
    const double area = weight * fragment.area;
    if (area_sum_ == 0) first_ = fragment.mean;
    area_sum_ += area;
    for (std::size_t c = 0; c < kChannels; ++c) sum_[c] += area * fragment.mean[c];
  }
  Fragment<kChannels> fragment(std::uint32_t chart, bool unit_vectors) const {
    Fragment<kChannels> result;
    result.area = area_sum_;
    result.chart = chart;
    const double share = 1 / area_sum_;
    for (std::size_t c = 0; c < kChannels; ++c) {
      result.mean[c] = static_cast<float>(sum_[c] * share);
    }
    if (unit_vectors && squared_length(result.mean) < kVanishingLength * kVanishingLength) {
      // If the mean vanishes, the first vector replaces it. Its length is set large enough to have
      // a direction, but too small to change coarser means noticeably.
      const double scale = 2 * kVanishingLength / std::sqrt(squared_length(first_));
      for (std::size_t c = 0; c < kVector<kChannels>; ++c) {
        result.mean[c] = static_cast<float>(scale * first_[c]);
      }
    }
    return result;
  }

 private:
  static std::array<double, kChannels> minus_zero() {
    std::array<double, kChannels> sum;
    sum.fill(-0.0);  // Starts with -0, since 0 + -0 would turn -0 into 0
    return sum;
  }

  double area_sum_ = 0;
  std::array<double, kChannels> sum_ = minus_zero();
  std::array<float, kChannels> first_{};
};

template <std::size_t kChannels>
void write_value(const Fragment<kChannels>& fragment, bool unit_vectors, float* pixel) {
  std::copy_n(fragment.mean.begin(), kChannels, pixel);
  if (!unit_vectors) return;
  const double squared_mean = squared_length(fragment.mean);
  if (std::abs(squared_mean - 1) <= kUnitSlack) return;
  const double scale = 1 / std::sqrt(squared_mean);
  for (std::size_t c = 0; c < kVector<kChannels>; ++c) {
    pixel[c] = static_cast<float>(pixel[c] * scale);
  }
}

/// Computes one row of texels of the next level.
template <std::size_t kChannels, typename Finer>
class RowMaker {
 public:
  RowMaker(const Finer& finer, std::size_t y, bool unit_vectors)
      : finer_(finer), column_taps_(Taps::of(y, finer.height())), unit_vectors_(unit_vectors) {}

  /// Appends the fragments of a texel, one per chart that it touches, sorted by chart.
  /// \returns true if the texel covers a missed texel of the finer level
  bool append_fragments(std::size_t x, std::vector<Fragment<kChannels>>& fragments) {
    const Taps across = Taps::of(x, finer_.width());
    bool is_missed = false;
    count_ = 0;
    for (std::size_t j = 0; j < column_taps_.count; ++j) {
      for (std::size_t i = 0; i < across.count; ++i) {
        const std::size_t fine_x = across.first + i;
        const std::size_t fine_y = column_taps_.first + j;
        is_missed = is_missed || finer_.is_missed(fine_x, fine_y);
        const auto list = finer_.fragments(fine_x, fine_y, base_fragments_[count_]);
        if (list.empty()) continue;
        fragment_cursors_[count_++] = {list.data(), list.data() + list.size(),
                                       column_taps_.weight[j] * across.weight[i]};
      }
    }
    merge_fragments(fragments);
    return is_missed;
  }

 private:
  struct FragmentCursor {
    const Fragment<kChannels>*at, *end;
    double weight;
  };

  /// Merges the lists of fragments, which are sorted by chart. Fragments of the same chart are added in the
  /// order of their texels.
  void merge_fragments(std::vector<Fragment<kChannels>>& fragments) {
    if (count_ == 0) return;
    const std::uint32_t own = fragment_cursors_[0].at->chart;
    const bool has_single_chart = std::all_of(
        &fragment_cursors_[0], &fragment_cursors_[count_], [&](const FragmentCursor& cursor) {
          return cursor.at + 1 == cursor.end && cursor.at->chart == own;
        });
    if (has_single_chart) {  // The common case: the texel belongs to a single chart
      FragmentSum<kChannels> sum;
      for (std::size_t k = 0; k < count_; ++k)
        sum.add(*fragment_cursors_[k].at, fragment_cursors_[k].weight);
      fragments.push_back(sum.fragment(own, unit_vectors_));
      return;
    }
    while (count_ != 0) {
      std::uint32_t chart = fragment_cursors_[0].at->chart;
      for (std::size_t k = 1; k < count_; ++k)
        chart = std::min(chart, fragment_cursors_[k].at->chart);
      FragmentSum<kChannels> sum;
      std::size_t left = 0;
      for (std::size_t k = 0; k < count_; ++k) {
        FragmentCursor cursor = fragment_cursors_[k];
        if (cursor.at->chart == chart) sum.add(*cursor.at++, cursor.weight);
        if (cursor.at != cursor.end) fragment_cursors_[left++] = cursor;
      }
      count_ = left;
      fragments.push_back(sum.fragment(chart, unit_vectors_));
    }
  }

  const Finer& finer_;
  const Taps column_taps_;
  const bool unit_vectors_;
  std::array<Fragment<kChannels>, 9> base_fragments_;
  std::array<FragmentCursor, 9> fragment_cursors_{};
  std::size_t count_ = 0;
};

template <std::size_t kChannels>
const Fragment<kChannels>& largest_fragment(std::span<const Fragment<kChannels>> fragments) {
  double most = 0;
  for (const auto& fragment : fragments) most = std::max(most, fragment.area);
  return *std::find_if(fragments.begin(), fragments.end(),
                       [&](const auto& fragment) { return fragment.area >= most * kMinAreaRatio; });
}

template <std::size_t kChannels, typename Finer>
FragmentChain<kChannels> make_next_level(const Finer& finer, const MipOptions& options,
                                         MipLevel& out) {
  FragmentChain<kChannels> fragment_chain;
  const std::uint32_t width = std::max(1U, finer.width() / 2);
  const std::uint32_t height = std::max(1U, finer.height() / 2);
  fragment_chain.level_width = width;
  fragment_chain.level_height = height;
  fragment_chain.blocks.resize((height + kBlockRows - 1) / kBlockRows);
  const std::size_t texels = std::size_t{width} * height;
  out.coverage.assign(texels, kCoverageEmpty);
  out.image = {width, height, kChannels, std::vector<float>(texels * kChannels)};
  parallel_for(fragment_chain.blocks.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      auto& block = fragment_chain.blocks[b];
      const std::size_t first_row = b * kBlockRows;
      const std::size_t last_row = std::min<std::size_t>(first_row + kBlockRows, height);
      block.first.reserve((last_row - first_row) * width + 1);
      block.fragments.reserve((last_row - first_row) * width);
      for (std::size_t y = first_row; y < last_row; ++y) {
        RowMaker<kChannels, Finer> row(finer, y, options.unit_vectors);
        for (std::size_t x = 0; x < width; ++x) {
          const std::size_t texel = y * width + x;
          const std::size_t first_fragment = block.fragments.size();
          block.first.push_back(static_cast<std::uint32_t>(first_fragment));
          const bool is_missed = row.append_fragments(x, block.fragments);
          float* pixel = &out.image.pixels[texel * kChannels];
          if (first_fragment != block.fragments.size()) {
            out.coverage[texel] = kCoverageBaked;
            const std::span<const Fragment<kChannels>> own(&block.fragments[first_fragment],
                                                           block.fragments.size() - first_fragment);
            write_value(largest_fragment(own), options.unit_vectors, pixel);
          } else if (is_missed) {
            out.coverage[texel] = kCoverageMissed;
            std::copy_n(options.missed.begin(), kChannels, pixel);
          }
        }
      }
      block.first.push_back(static_cast<std::uint32_t>(block.fragments.size()));
    }
  });
  if (!options.missed_have_values) fragment_chain.coverage = out.coverage;
  return fragment_chain;
}

template <std::size_t kChannels>
std::vector<MipLevel> make(const Image& image, std::span<const std::uint8_t> coverage,
                           const ChartMap& charts, const MipOptions& options) {
  std::vector<MipLevel> levels;
  if (image.width == 1 && image.height == 1) return levels;
  const BaseLevel<kChannels> base{image, coverage, charts, options.missed_have_values};
  levels.emplace_back();
  FragmentChain<kChannels> fragment_chain =
      make_next_level<kChannels>(base, options, levels.back());
  while (fragment_chain.level_width > 1 || fragment_chain.level_height > 1) {
    levels.emplace_back();
    fragment_chain = make_next_level<kChannels>(fragment_chain, options, levels.back());
  }
  return levels;
}

}  // namespace

ChartMap::ChartMap(std::size_t texels, std::uint32_t samples) : chart(texels) {
  if (samples > 1) weight.resize(texels);
}

void ChartMap::store(cl::Context& context, const TexelBand& band, std::uint32_t width,
                     const std::vector<std::uint32_t>& chart_of_triangle) {
  std::vector<std::uint32_t> texel_index(band.texel_count);
  std::vector<std::uint32_t> first_sample(band.texel_count + std::size_t{1});
  std::vector<std::uint32_t> triangle(band.sample_count);
  band.texel_index.read(context, texel_index);
  band.texel_first.read(context, first_sample);
  band.triangle.read(context, triangle);
  const std::size_t offset = std::size_t{band.first_row} * width;
  parallel_for(band.texel_count, 1 << 14, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> own;
    for (std::size_t t = begin; t < end; ++t) {
      if (weight.empty()) {
        chart[offset + texel_index[t]] = chart_of_triangle[triangle[first_sample[t]]];
        continue;
      }
      own.clear();
      for (std::uint32_t s = first_sample[t]; s < first_sample[t + 1]; ++s) {
        own.push_back(chart_of_triangle[triangle[s]]);
      }
      std::sort(own.begin(), own.end());
      std::size_t most = 0;
      for (std::size_t i = 0; i < own.size();) {
        std::size_t next = i;
        while (next < own.size() && own[next] == own[i]) ++next;
        if (next - i > most) {
          most = next - i;
          chart[offset + texel_index[t]] = own[i];
        }
        i = next;
      }
      weight[offset + texel_index[t]] = static_cast<std::uint16_t>(most);
    }
  });
}

std::vector<MipLevel> make_mips(const Image& image, std::span<const std::uint8_t> coverage,
                                const ChartMap& charts, const MipOptions& options) {
  switch (image.channels) {
    case 1:
      return make<1>(image, coverage, charts, options);
    case 2:
      return make<2>(image, coverage, charts, options);
    case 3:
      return make<3>(image, coverage, charts, options);
    default:
      return make<4>(image, coverage, charts, options);
  }
}

}  // namespace kiln
