#include "image/push_pull.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <vector>

#include "base/parallel.h"

namespace kiln {
namespace {

using Texel = std::array<float, 4>;

// Averages of unit vectors have no meaningful direction if their squared length is smaller than
// this.
constexpr float kMinSquaredLength = 1e-12F;

struct Level {
  std::uint32_t width = 0, height = 0;
  std::vector<float> values;
  std::vector<std::uint8_t> known;
  bool is_complete = false;  // True if every texel is known
};

// A level of the pyramid. The memory of the finest level is the caller's image.
struct LevelView {
  std::uint32_t width, height;
  const float* values;
  const std::uint8_t* known;
};

// \returns false if the vector is too short to have a direction.
bool normalise(Texel& texel, std::size_t channels) {
  const std::size_t count = std::min<std::size_t>(3, channels);
  float squared = 0;
  for (std::size_t c = 0; c < count; ++c) squared += texel[c] * texel[c];
  if (!(squared > kMinSquaredLength)) return false;
  const float length = std::sqrt(squared);
  for (std::size_t c = 0; c < count; ++c) texel[c] /= length;
  return true;
}

void copy_vector(Texel& texel, const float* from, std::size_t channels) {
  std::copy_n(from, std::min<std::size_t>(3, channels), texel.begin());
}

template <std::size_t kChannels>
Level push(const LevelView& fine, bool unit_vectors) {
  Level coarse_level;
  coarse_level.width = (fine.width + 1) / 2;
  coarse_level.height = (fine.height + 1) / 2;
  const std::size_t texels = std::size_t{coarse_level.width} * coarse_level.height;
  coarse_level.values.resize(texels * kChannels);
  coarse_level.known.resize(texels);
  std::atomic<bool> is_complete{true};
  parallel_for(coarse_level.height, 16, [&](std::size_t begin, std::size_t end) {
    bool are_rows_complete = true;
    for (std::size_t y = begin; y < end; ++y) {
      for (std::size_t x = 0; x < coarse_level.width; ++x) {
        Texel sum{};
        const float* first = nullptr;
        int count = 0;
        for (std::size_t cy = 2 * y; cy < std::min<std::size_t>(2 * y + 2, fine.height); ++cy) {
          for (std::size_t cx = 2 * x; cx < std::min<std::size_t>(2 * x + 2, fine.width); ++cx) {
            const std::size_t child = cy * fine.width + cx;
            if (fine.known[child] == 0) continue;
            const float* value = fine.values + child * kChannels;
            if (count++ == 0) first = value;
            for (std::size_t c = 0; c < kChannels; ++c) sum[c] += value[c];
          }
        }
        if (count == 0) {
          are_rows_complete = false;
          continue;
        }
        for (std::size_t c = 0; c < kChannels; ++c) sum[c] /= static_cast<float>(count);
        if (unit_vectors && !normalise(sum, kChannels)) copy_vector(sum, first, kChannels);
        const std::size_t texel = y * coarse_level.width + x;
        coarse_level.known[texel] = 1;
        std::copy_n(sum.begin(), kChannels, &coarse_level.values[texel * kChannels]);
      }
    }
    if (!are_rows_complete) is_complete = false;
  });
  coarse_level.is_complete = is_complete;
  return coarse_level;
}

// Fills in unknown texels of `values`: all of them, or if `is_wanted` is not empty, those that it
// selects.
template <std::size_t kChannels>
void pull(const Level& coarse_level, std::uint32_t width, std::uint32_t height, float* values,
          const std::uint8_t* known, const std::uint8_t* is_wanted, bool unit_vectors) {
  const auto neighbour = [](std::size_t at, std::size_t size) {
    const std::size_t parent = at / 2;
    if (at % 2 == 1) return std::min(parent + 1, size - 1);
    return parent == 0 ? parent : parent - 1;
  };
  parallel_for(height, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y < end; ++y) {
      const float* near_row = &coarse_level.values[y / 2 * coarse_level.width * kChannels];
      const float* far_row =
          &coarse_level.values[neighbour(y, coarse_level.height) * coarse_level.width * kChannels];
      for (std::size_t x = 0; x < width; ++x) {
        const std::size_t texel = y * width + x;
        if (known[texel] != 0 || (is_wanted != nullptr && is_wanted[texel] == 0)) continue;
        const std::size_t near_x = x / 2 * kChannels;
        const std::size_t far_x = neighbour(x, coarse_level.width) * kChannels;
        Texel sum{};
        for (std::size_t c = 0; c < kChannels; ++c) {
          sum[c] = (9.0F * near_row[near_x + c] + 3.0F * near_row[far_x + c] +
                    3.0F * far_row[near_x + c] + far_row[far_x + c]) /
                   16.0F;
        }
        if (unit_vectors && !normalise(sum, kChannels)) {
          copy_vector(sum, near_row + near_x, kChannels);
        }
        std::copy_n(sum.begin(), kChannels, values + texel * kChannels);
      }
    }
  });
}

template <std::size_t kChannels>
bool push_pull_channels(Image& image, std::span<const std::uint8_t> known,
                        std::span<const std::uint8_t> is_wanted, bool unit_vectors) {
  std::vector<Level> levels;
  LevelView view{image.width, image.height, image.pixels.data(), known.data()};
  do {
    levels.push_back(push<kChannels>(view, unit_vectors));
    const Level& last = levels.back();
    view = {last.width, last.height, last.values.data(), last.known.data()};
  } while (!levels.back().is_complete && (view.width > 1 || view.height > 1));
  if (!levels.back().is_complete) return false;
  for (std::size_t i = levels.size() - 1; i > 0; --i) {
    Level& fine = levels[i - 1];
    pull<kChannels>(levels[i], fine.width, fine.height, fine.values.data(), fine.known.data(),
                    nullptr, unit_vectors);
  }
  pull<kChannels>(levels[0], image.width, image.height, image.pixels.data(), known.data(),
                  is_wanted.data(), unit_vectors);
  return true;
}

}  // namespace

bool push_pull(Image& image, std::span<const std::uint8_t> known,
               std::span<const std::uint8_t> is_wanted, bool unit_vectors) {
  switch (image.channels) {
    case 1:
      return push_pull_channels<1>(image, known, is_wanted, unit_vectors);
    case 2:
      return push_pull_channels<2>(image, known, is_wanted, unit_vectors);
    case 3:
      return push_pull_channels<3>(image, known, is_wanted, unit_vectors);
    default:
      return push_pull_channels<4>(image, known, is_wanted, unit_vectors);
  }
}

}  // namespace kiln
