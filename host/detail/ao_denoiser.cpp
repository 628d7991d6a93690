#include "detail/ao_denoiser.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "detail/hemisphere_rays.h"
#include "mesh/kernels_shared.h"
#include "shared/ao_denoiser.h"
#include "shared/visibility.h"

namespace kiln {
namespace {

constexpr std::size_t kGrain = 1 << 14;
constexpr std::uint32_t kNone = 0xFFFFFFFFU;

double square(double value) { return value * value; }

/// Squares of what each estimate is from the other one, smoothed.
double crossed(std::span<const float> raw, std::span<const float> level, std::size_t a) {
  const std::size_t b = a + 1;
  return square(static_cast<double>(raw[a]) - level[b]) +
         square(static_cast<double>(raw[b]) - level[a]);
}

}  // namespace

AoDenoiser::AoDenoiser(cl::Context& context, const LowSurface& surface, std::uint32_t width,
                       std::uint32_t height)
    : context_(context),
      surface_(surface),
      topology_(SurfaceTopology::of(surface)),
      width_(width),
      height_(height),
      tiles_across_((width + kTile - 1) / kTile) {}

void AoDenoiser::sort_into_tiles(const Texels& texels) {
  tiles_down_ = (texels.row_count + kTile - 1) / kTile;
  place_.assign(texels.place.begin(), texels.place.end());
  tile_first_.assign(std::size_t{tiles_across_} * tiles_down_ + 1, 0U);
  for (const std::uint32_t place : place_) ++tile_first_[tile_of(place) + 1];
  for (std::size_t t = 1; t < tile_first_.size(); ++t) tile_first_[t] += tile_first_[t - 1];
  by_tile_.resize(count_);
  std::vector<std::uint32_t> next(tile_first_.begin(), tile_first_.end() - 1);
  for (std::uint32_t i = 0; i < count_; ++i) by_tile_[next[tile_of(place_[i])]++] = i;
}

void AoDenoiser::prepare(const Texels& texels) {
  count_ = static_cast<std::uint32_t>(texels.place.size());
  sort_into_tiles(texels);
  const std::size_t pixels = std::size_t{texels.row_count} * width_;
  const auto number = std::make_unique_for_overwrite<std::uint32_t[]>(pixels);
  const auto triangle = std::make_unique_for_overwrite<std::uint32_t[]>(pixels);
  parallel_for(pixels, kGrain, [&](std::size_t begin, std::size_t end) {
    std::fill(&number[begin], &number[end], kNone);
    std::fill(&triangle[begin], &triangle[end], KILN_NO_TRIANGLE);
  });
  parallel_for(count_, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      number[place_[i]] = static_cast<std::uint32_t>(i);
      triangle[place_[i]] = texels.triangle[i];
    }
  });
  const TexelLinks links = TexelLinks::of(surface_, topology_, {triangle.get(), pixels}, width_,
                                          height_, texels.first_row);
  const std::size_t neighbour_count = std::size_t{KILN_SHARE_NEIGHBOURS} * count_;
  const auto numbered = [&](std::uint32_t own, std::uint32_t place) {
    const std::uint32_t found = place == KILN_VISIBILITY_NO_LINK ? kNone : number[place];
    return found == kNone ? own : found;
  };
  make_room(context_, neighbours_, neighbour_count);
  neighbours_.write_by(context_, neighbour_count, [&](std::span<std::uint32_t> neighbours) {
    parallel_for(count_, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto own = static_cast<std::uint32_t>(i);
        const std::uint32_t at = place_[i], w = width_;
        const bool inner = links.kind[at] == KILN_VISIBILITY_INNER;
        const std::array<std::uint32_t, KILN_SHARE_NEIGHBOURS> beside{
            at - 1, at + 1, at - w, at + w, at - w - 1, at - w + 1, at + w - 1, at + w + 1};
        for (std::size_t k = 0; k < beside.size(); ++k) {
          neighbours[i * beside.size() + k] = inner ? numbered(own, beside[k]) : own;
        }
      }
    });
    constexpr std::size_t kLink = KILN_SHARE_NEIGHBOURS + 1;
    parallel_for(links.links.size() / kLink, kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const std::uint32_t* link = &links.links[b * kLink];
        const std::uint32_t own = number[link[0]];
        for (std::size_t k = 0; k < KILN_SHARE_NEIGHBOURS; ++k) {
          neighbours[std::size_t{KILN_SHARE_NEIGHBOURS} * own + k] = numbered(own, link[k + 1]);
        }
      }
    });
  });
  const kiln_share_params params{count_, texels.points_plane};
  make_room(context_, from_, std::size_t{2} * count_);
  make_room(context_, to_, std::size_t{2} * count_);
  context_.launch(context_.kernel("ao_denoiser", "kiln_share_weights"), count_, kLocal, params,
                  neighbours_, texels.points);
}

AoDenoiser::Levels AoDenoiser::smoothed(std::span<const float> estimates) {
  Levels levels;
  levels.of[0] = estimates;
  from_.write(context_, estimates);
  const cl::Kernel smooth = context_.kernel("ao_denoiser", "kiln_share_smooth");
  const kiln_share_params params{count_, 0};
  for (std::size_t k = 1; k < levels.of.size(); ++k) {
    for (std::uint32_t step = kSteps[k - 1]; step < kSteps[k]; ++step) {
      context_.launch(smooth, count_, kLocal, params, neighbours_, from_, to_);
      std::swap(from_, to_);
    }
    levels.memory[k] = std::make_unique_for_overwrite<float[]>(estimates.size());
    const std::span<float> level(levels.memory[k].get(), estimates.size());
    from_.read(context_, level);
    levels.of[k] = level;
  }
  return levels;
}

void AoDenoiser::Tile::add(const Tile& other) {
  count += other.count;
  blur += other.blur;
  for (std::size_t k = 0; k < kSteps.size(); ++k) {
    error[k] += other.error[k];
    noise[k] += other.noise[k];
  }
}

AoDenoiser::Tile AoDenoiser::errors_of(const Levels& levels, std::size_t tile) const {
  const std::span<const float> raw = levels.of[0], once = levels.of[1];
  Tile sum;
  sum.count = tile_first_[tile + 1] - tile_first_[tile];
  for (std::size_t n = tile_first_[tile]; n < tile_first_[tile + 1]; ++n) {
    const std::size_t a = std::size_t{2} * by_tile_[n], b = a + 1;
    for (std::size_t k = 0; k < levels.of.size(); ++k) {
      const std::span<const float> level = levels.of[k];
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

std::vector<AoDenoiser::Choice> AoDenoiser::choose(const Levels& levels) const {
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
      // The loss of the first step shows through the noise of single texels alone: two standard deviations of that
      // are not taken for it. The loss of further steps is known better.
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

/// The tiles before and behind each place along a side, and how far it is on the way between their middles.
std::vector<AoDenoiser::Between> AoDenoiser::between(std::uint32_t places, std::uint32_t tiles) {
  std::vector<Between> result(places);
  for (std::uint32_t at = 0; at < places; ++at) {
    const double middle = (at + 0.5) / kTile - 0.5, before = std::floor(middle);
    const auto tile = [&](double number) {
      return static_cast<std::uint32_t>(std::clamp(number, 0.0, tiles - 1.0));
    };
    result[at] = {tile(before), tile(before + 1), middle - before};
  }
  return result;
}

AoDenoiser::Result AoDenoiser::run(std::span<const float> estimates) {
  const Levels levels = smoothed(estimates);
  const std::vector<Choice> choices = choose(levels);
  Result result{std::vector<float>(count_), std::vector<float>(count_)};
  const std::vector<Between> columns = between(width_, tiles_across_);
  const std::vector<Between> rows = between(tiles_down_ * kTile, tiles_down_);
  parallel_for(count_, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t x = place_[i] % width_, y = place_[i] / width_;
      const auto [x0, x1, right] = columns[x];
      const auto [y0, y1, below] = rows[y];
      double sum = 0, weights = 0;
      const auto add = [&](std::uint32_t across, std::uint32_t down, double weight) {
        const Choice& choice = choices[std::size_t{down} * tiles_across_ + across];
        if (choice.level < 0) return;
        const std::span<const float> level = levels.of[static_cast<std::size_t>(choice.level)];
        sum += weight * (static_cast<double>(level[2 * i]) + level[2 * i + 1]) / 2;
        weights += weight;
      };
      add(x0, y0, (1 - right) * (1 - below));
      add(x1, y0, right * (1 - below));
      add(x0, y1, (1 - right) * below);
      add(x1, y1, right * below);
      result.shares[i] = static_cast<float>(sum / weights);
      result.errors[i] = choices[std::size_t{y / kTile} * tiles_across_ + x / kTile].error;
    }
  });
  return result;
}

}  // namespace kiln
