#include "detail/share_filter.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/parallel.h"
#include "detail/hemisphere_rays.h"
#include "mesh/kernels_shared.h"
#include "shared/share_filter.h"
#include "shared/visibility.h"

namespace kiln {
namespace {

constexpr std::size_t kGrain = 1 << 14;
constexpr std::uint32_t kFilterTile = 16;  // texels a side
constexpr std::uint32_t kNone = 0xFFFFFFFFU;

double square(double value) { return value * value; }

/// Squares of what each estimate is from the other one, smoothed.
double crossed(const std::vector<float>& raw, const std::vector<float>& level, std::size_t a) {
  const std::size_t b = a + 1;
  return square(static_cast<double>(raw[a]) - level[b]) +
         square(static_cast<double>(raw[b]) - level[a]);
}

}  // namespace

ShareFilter::ShareFilter(cl::Context& context, const LowSurface& surface, std::uint32_t width,
                         std::uint32_t height)
    : context_(context),
      surface_(surface),
      topology_(SurfaceTopology::of(surface)),
      width_(width),
      height_(height),
      tiles_across_((width + kFilterTile - 1) / kFilterTile) {}

void ShareFilter::sort_into_tiles(const Texels& texels) {
  tiles_down_ = (texels.row_count + kFilterTile - 1) / kFilterTile;
  place_.assign(texels.place.begin(), texels.place.end());
  const auto tile_of = [&](std::uint32_t place) {
    return place / width_ / kFilterTile * tiles_across_ + place % width_ / kFilterTile;
  };
  tile_first_.assign(std::size_t{tiles_across_} * tiles_down_ + 1, 0);
  for (const std::uint32_t place : place_) ++tile_first_[tile_of(place) + 1];
  for (std::size_t t = 1; t < tile_first_.size(); ++t) tile_first_[t] += tile_first_[t - 1];
  by_tile_.resize(count_);
  std::vector<std::uint32_t> next(tile_first_.begin(), tile_first_.end() - 1);
  for (std::uint32_t i = 0; i < count_; ++i) by_tile_[next[tile_of(place_[i])]++] = i;
}

void ShareFilter::prepare(const Texels& texels) {
  count_ = static_cast<std::uint32_t>(texels.place.size());
  sort_into_tiles(texels);
  const std::size_t pixels = std::size_t{texels.row_count} * width_;
  std::vector<std::uint32_t> number(pixels, kNone), triangle(pixels, KILN_NO_TRIANGLE);
  for (std::uint32_t i = 0; i < count_; ++i) {
    number[place_[i]] = i;
    triangle[place_[i]] = texels.triangle[i];
  }
  const TexelLinks links =
      TexelLinks::of(surface_, topology_, triangle, width_, height_, texels.first_row);
  std::vector<std::uint32_t> neighbours(std::size_t{KILN_SHARE_NEIGHBOURS} * count_);
  const auto numbered = [&](std::uint32_t own, std::uint32_t place) {
    const std::uint32_t found = place == KILN_VISIBILITY_NO_LINK ? kNone : number[place];
    return found == kNone ? own : found;
  };
  parallel_for(count_, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto own = static_cast<std::uint32_t>(i);
      const std::uint32_t at = place_[i], w = width_;
      if (links.kind[at] != KILN_VISIBILITY_INNER) continue;
      const std::array<std::uint32_t, KILN_SHARE_NEIGHBOURS> beside{
          at - 1, at + 1, at - w, at + w, at - w - 1, at - w + 1, at + w - 1, at + w + 1};
      for (std::size_t k = 0; k < beside.size(); ++k) {
        neighbours[i + k * count_] = numbered(own, beside[k]);
      }
    }
  });
  constexpr std::size_t kLink = KILN_SHARE_NEIGHBOURS + 1;
  parallel_for(links.links.size() / kLink, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const std::uint32_t* link = &links.links[b * kLink];
      const std::uint32_t own = number[link[0]];
      for (std::size_t k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) {
        neighbours[own + k * count_] = numbered(own, link[k + 1]);
      }
    }
  });
  make_room(context_, neighbours_, neighbours.size());
  neighbours_.write(context_, neighbours);
  const kiln_share_params params{count_, count_, texels.points_plane};
  context_.launch(context_.kernel("share_filter", "kiln_share_weights"), count_, kLocal, params,
                  neighbours_, texels.points);
}

ShareFilter::Levels ShareFilter::smoothed(std::span<const float> estimates) {
  Levels levels;
  levels[0].assign(estimates.begin(), estimates.end());
  make_room(context_, from_, estimates.size());
  make_room(context_, to_, estimates.size());
  from_.write(context_, estimates);
  const cl::Kernel smooth = context_.kernel("share_filter", "kiln_share_smooth");
  const kiln_share_params params{count_, count_, 0};
  for (std::size_t k = 1; k < levels.size(); ++k) {
    for (std::uint32_t step = kSteps[k - 1]; step < kSteps[k]; ++step) {
      context_.launch(smooth, count_, kLocal, params, neighbours_, from_, to_);
      std::swap(from_, to_);
    }
    levels[k].resize(estimates.size());
    from_.read(context_, levels[k]);
  }
  return levels;
}

void ShareFilter::Tile::add(const Tile& other) {
  count += other.count;
  blur += other.blur;
  for (std::size_t k = 0; k < kSteps.size(); ++k) {
    error[k] += other.error[k];
    noise[k] += other.noise[k];
  }
}

ShareFilter::Tile ShareFilter::errors_of(const Levels& levels, std::size_t tile) const {
  const std::vector<float>&raw = levels[0], &once = levels[1];
  Tile sum;
  sum.count = tile_first_[tile + 1] - tile_first_[tile];
  for (std::size_t n = tile_first_[tile]; n < tile_first_[tile + 1]; ++n) {
    const std::size_t a = std::size_t{2} * by_tile_[n], b = a + 1;
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const std::vector<float>& level = levels[k];
      // Both estimates' mean has half of their noise, which is half the square of what they are apart.
      const double noise = square(static_cast<double>(level[a]) - level[b]) / 4;
      sum.noise[k] += noise;
      if (k <= 1) {
        sum.error[k] += noise;
        continue;
      }
      sum.error[k] += (crossed(raw, level, a) - crossed(raw, once, a)) / 2 +
                      square(static_cast<double>(once[a]) - once[b]) / 2 - noise;
    }
    sum.blur += crossed(raw, once, a) / 2 - square(static_cast<double>(raw[a]) - raw[b]) / 2 -
                square(static_cast<double>(once[a]) - once[b]) / 2;
  }
  return sum;
}

std::vector<ShareFilter::Choice> ShareFilter::choose(const Levels& levels) const {
  std::vector<Tile> tiles(tile_first_.size() - 1);
  parallel_for(tiles.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) tiles[t] = errors_of(levels, t);
  });
  std::vector<Choice> choices(tiles.size());
  const auto across = static_cast<std::int64_t>(tiles_across_);
  const auto down = static_cast<std::int64_t>(tiles_down_);
  parallel_for(tiles.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (auto t = static_cast<std::int64_t>(begin); t < static_cast<std::int64_t>(end); ++t) {
      const auto own = static_cast<std::size_t>(t);
      if (tiles[own].count == 0) continue;
      const std::int64_t x = t % across, y = t / across;
      Tile around;
      for (std::int64_t j = std::max<std::int64_t>(0, y - 1); j <= std::min(down - 1, y + 1); ++j) {
        for (std::int64_t i = std::max<std::int64_t>(0, x - 1); i <= std::min(across - 1, x + 1);
             ++i) {
          around.add(tiles[static_cast<std::size_t>(j * across + i)]);
        }
      }
      // What the first step loses shows through the noise of single texels alone: two standard deviations of that
      // are not taken for it. Of what further steps lose more is known.
      const double doubt = 8 * around.noise[0] / std::sqrt(around.count);
      const double blur = std::max(0.0, around.blur - doubt);
      double least = 0;
      for (std::size_t k = 0; k < kSteps.size(); ++k) {
        const double squares = std::max(around.error[k], around.noise[k]) + (k == 0 ? 0.0 : blur);
        if (k != 0 && squares >= least) continue;
        least = squares;
        choices[own] = {static_cast<std::int32_t>(k),
                        static_cast<float>(std::sqrt(squares / around.count))};
      }
    }
  });
  return choices;
}

ShareFilter::Result ShareFilter::run(std::span<const float> estimates) {
  const Levels levels = smoothed(estimates);
  const std::vector<Choice> choices = choose(levels);
  Result result{std::vector<float>(count_), std::vector<float>(count_)};
  // The tiles before and behind a place, and how far it is on the way between their middles.
  const auto between = [](std::uint32_t at, std::uint32_t tiles) {
    const double middle = (at + 0.5) / kFilterTile - 0.5, before = std::floor(middle);
    const auto tile = [&](double number) {
      return static_cast<std::uint32_t>(std::clamp(number, 0.0, tiles - 1.0));
    };
    return std::tuple(tile(before), tile(before + 1), middle - before);
  };
  parallel_for(count_, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto [x0, x1, right] = between(place_[i] % width_, tiles_across_);
      const auto [y0, y1, below] = between(place_[i] / width_, tiles_down_);
      double sum = 0, weights = 0;
      const auto add = [&](std::uint32_t x, std::uint32_t y, double weight) {
        const Choice& choice = choices[std::size_t{y} * tiles_across_ + x];
        if (choice.level < 0) return;
        const std::vector<float>& level = levels[static_cast<std::size_t>(choice.level)];
        sum += weight * (static_cast<double>(level[2 * i]) + level[2 * i + 1]) / 2;
        weights += weight;
      };
      add(x0, y0, (1 - right) * (1 - below));
      add(x1, y0, right * (1 - below));
      add(x0, y1, (1 - right) * below);
      add(x1, y1, right * below);
      result.shares[i] = static_cast<float>(sum / weights);
      const std::uint32_t tile =
          place_[i] / width_ / kFilterTile * tiles_across_ + place_[i] % width_ / kFilterTile;
      result.errors[i] = choices[tile].error;
    }
  });
  return result;
}

}  // namespace kiln
