#include "lowpoly/packing_press.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/heartbeat.h"

namespace kiln {
namespace {

/// Of an outline at first, and at most; and by what share it grows.
constexpr std::int32_t kFirstWeight = 16, kMostWeight = 1024;
/// Of the random places, so many are made better.
constexpr std::size_t kBest = 2;

}  // namespace

PackingPress::PackingPress(const ChartSheets& sheets, const Sheet& sheet, std::uint32_t samples,
                           std::mt19937& random)
    : sheets_(sheets),
      sheet_(sheet),
      samples_(samples),
      random_(random),
      stride_(std::size_t{sheet.cells} + 1),
      sums_(stride_ * sheet.cells, 0),
      spots_(sheets.outlines().size()),
      weights_(spots_.size(), kFirstWeight),
      turns_(spots_.size()) {
  for (const ChartMask& mask : sheet.masks) {
    first_sums_.push_back(run_sums_.size());
    for (const ChartMask::Run& run : mask.runs) {
      const auto row = static_cast<std::uint32_t>(run.row * stride_);
      run_sums_.push_back({row + run.first, row + run.last + 1});
    }
  }
  first_sums_.push_back(run_sums_.size());
  for (std::uint32_t i = 0; i < spots_.size(); ++i) {
    for (std::uint32_t turn = 0; turn < ChartSheets::kTurns; ++turn) {
      const ChartMask& mask = mask_of(i, turn);
      if (mask.runs.empty() || std::max(mask.width, mask.height) > sheet_.cells) continue;
      turns_[i].push_back(turn);
    }
  }
}

const ChartMask& PackingPress::mask_of(std::uint32_t outline, std::uint32_t turn) const {
  return sheet_.masks[std::size_t{outline} * ChartSheets::kTurns + turn];
}

/// Adds a weight to the cells under an outline.
void PackingPress::add(std::uint32_t outline, std::int32_t weight) {
  const Spot& spot = spots_[outline];
  for (const ChartMask::Run& run : mask_of(outline, spot.turn).runs) {
    std::int32_t* const sums = sums_.data() + (spot.y + run.row) * stride_;
    std::int32_t* at = sums + spot.x + run.first + 1;
    const auto count = static_cast<std::int32_t>(run.last - run.first + 1);
    std::int32_t ramp = weight;
    for (std::int32_t i = 0; i < count; ++i, ramp += weight) at[i] += ramp;
    const std::int32_t all = weight * count;
    const auto rest = static_cast<std::int32_t>(sums + stride_ - (at + count));
    at += count;
    for (std::int32_t i = 0; i < rest; ++i) at[i] += all;
  }
}

/// The weights under an outline. \param most  above it, what is found may be less than all
std::int64_t PackingPress::overlap(std::uint32_t outline, const Spot& spot,
                                   std::int64_t most) const {
  constexpr std::ptrdiff_t kTogether = 8;
  const std::size_t mask = std::size_t{outline} * ChartSheets::kTurns + spot.turn;
  const std::int32_t* const sums = sums_.data() + spot.y * stride_ + spot.x;
  const RunSums *at = run_sums_.data() + first_sums_[mask], *const end = run_sums_.data() +
                                                                         first_sums_[mask + 1];
  std::int64_t sum = 0;
  for (; end - at >= kTogether && sum <= most; at += kTogether) {
    for (std::ptrdiff_t i = 0; i < kTogether; ++i) sum += sums[at[i].after] - sums[at[i].before];
  }
  for (; at != end && sum <= most; ++at) sum += sums[at->after] - sums[at->before];
  return sum;
}

/// Moves a place by steps as long as that lessens the overlap; by shorter and shorter ones.
void PackingPress::descend(std::uint32_t outline, std::uint32_t step, Found& found) const {
  const ChartMask& mask = mask_of(outline, found.spot.turn);
  const auto right = static_cast<int>(sheet_.cells - mask.width),
             top = static_cast<int>(sheet_.cells - mask.height);
  for (; step > 0; step /= 2) {
    for (bool better = true; better && found.overlap > 0;) {
      better = false;
      const Spot from = found.spot;
      for (const auto& [dx, dy] :
           {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}, std::pair{1, 1},
            std::pair{-1, -1}, std::pair{1, -1}, std::pair{-1, 1}}) {
        const int x = std::clamp(static_cast<int>(from.x) + dx * static_cast<int>(step), 0, right);
        const int y = std::clamp(static_cast<int>(from.y) + dy * static_cast<int>(step), 0, top);
        const Spot spot{from.turn, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)};
        const std::int64_t value = overlap(outline, spot, found.overlap);
        if (value >= found.overlap) continue;
        found = {value, spot};
        better = true;
      }
    }
  }
}

void PackingPress::move(std::uint32_t outline) {
  add(outline, -weights_[outline]);
  constexpr std::int64_t kAll = std::numeric_limits<std::int64_t>::max();
  const std::uint32_t step = std::max(1U, sheet_.cells / 64);
  Found best{overlap(outline, spots_[outline], kAll), spots_[outline]};
  descend(outline, step, best);
  std::array<Found, kBest> samples;
  samples.fill({kAll, {}});
  for (std::uint32_t n = 0; n < samples_ && best.overlap > 0; ++n) {
    Spot spot;
    spot.turn = turns_[outline][random_below(random_, turns_[outline].size())];
    const ChartMask& mask = mask_of(outline, spot.turn);
    spot.x = random_below(random_, sheet_.cells - mask.width + 1);
    spot.y = random_below(random_, sheet_.cells - mask.height + 1);
    const std::int64_t value = overlap(outline, spot, samples.back().overlap);
    if (value >= samples.back().overlap) continue;
    samples.back() = {value, spot};
    for (std::size_t k = kBest - 1; k > 0 && samples[k].overlap < samples[k - 1].overlap; --k) {
      std::swap(samples[k], samples[k - 1]);
    }
  }
  for (Found& sample : samples) {
    if (best.overlap == 0 || sample.overlap == kAll) break;
    descend(outline, step, sample);
    if (sample.overlap < best.overlap) best = sample;
  }
  spots_[outline] = best.spot;
  if (best.overlap > 0) {
    weights_[outline] = std::min(kMostWeight, weights_[outline] + weights_[outline] / 8 + 1);
  }
  add(outline, weights_[outline]);
}

bool PackingPress::begin(const Sheet& from, const Packed& packed) {
  const double grow = static_cast<double>(sheet_.cells) / from.cells;
  for (std::uint32_t i = 0; i < spots_.size(); ++i) {
    Spot& spot = spots_[i];
    spot.turn = static_cast<std::uint8_t>(packed.turn[i]);  // All are placed, so none is below 0.
    const ChartMask &mask = mask_of(i, spot.turn),
                    &old = from.masks[std::size_t{i} * ChartSheets::kTurns + spot.turn];
    if (std::max(mask.width, mask.height) > sheet_.cells) return false;
    const auto place = [&](std::uint32_t at, std::uint32_t width, std::uint32_t now) {
      const double left = (at + 0.5 * width) * grow - 0.5 * now;
      return static_cast<std::uint32_t>(
          std::clamp(std::round(left), 0.0, static_cast<double>(sheet_.cells) - now));
    };
    spot.x = place(packed.x[i], old.width, mask.width);
    spot.y = place(packed.y[i], old.height, mask.height);
    add(i, weights_[i]);
  }
  return true;
}

bool PackingPress::run(std::uint32_t moves) {
  std::vector<std::uint32_t> waiting;
  for (std::uint32_t done = 0; done < moves;) {
    Heartbeat::beat();
    waiting.clear();
    for (std::uint32_t i = 0; i < spots_.size(); ++i) {
      std::int64_t own = 0;
      for (const ChartMask::Run& run : mask_of(i, spots_[i].turn).runs)
        own += run.last - run.first + 1;
      if (overlap(i, spots_[i], std::numeric_limits<std::int64_t>::max()) > own * weights_[i])
        waiting.push_back(i);
    }
    if (waiting.empty()) return true;
    for (std::size_t n = waiting.size(); n > 1; --n)
      std::swap(waiting[n - 1], waiting[random_below(random_, n)]);
    for (const std::uint32_t i : waiting) move(i);
    done += static_cast<std::uint32_t>(waiting.size());
  }
  return false;
}

Packed PackingPress::packed() const {
  Packed packed;
  for (const Spot& spot : spots_) {
    packed.turn.push_back(static_cast<std::int8_t>(spot.turn));
    packed.x.push_back(spot.x);
    packed.y.push_back(spot.y);
  }
  sheets_.place(sheet_, packed);
  return packed;
}

}  // namespace kiln
