#include "measure/light_trials.h"

#include <algorithm>
#include <cmath>

#include "measure/light_limits.h"

namespace kiln {

using namespace light_limits;

std::uint64_t LightCost::vertices(std::uint64_t positions, std::uint32_t size) const {
  const auto count = static_cast<double>(positions);
  return static_cast<std::uint64_t>(size == 0 ? splits * count : count + seams * std::sqrt(count));
}

LightBytes LightCost::bytes(std::uint64_t positions, std::uint64_t faces,
                            std::uint32_t size) const {
  return light_bytes(vertices(positions, size), faces, size, channels, bits);
}

LightBytes LightCost::measured(const LightTrial& trial) {
  seams_known = true;
  seams = static_cast<double>(trial.vertices - trial.positions) /
          std::sqrt(static_cast<double>(trial.positions));
  return light_bytes(trial.vertices, trial.faces, trial.size, channels, bits);
}

bool is_wide(const LightTrial& trial) { return trial.laid_out_for != trial.size; }

LightReach LightReach::of(std::span<const LightTrial> trials) {
  LightReach reach;
  for (const LightTrial& trial : trials) {
    if (trial.size == 0) continue;
    reach.finest = std::max(reach.finest, trial.faces);
    reach.largest = std::max(reach.largest, trial.size);
  }
  return reach;
}

bool LightReach::faces(std::uint64_t count) const {
  return finest == 0 || static_cast<double>(count) <= kMostLeap * static_cast<double>(finest);
}

std::uint32_t LightReach::size(std::uint32_t wanted) const {
  return largest == 0 ? wanted : std::min(wanted, 2 * largest);
}

std::uint64_t faces_laid_out(std::span<const LightTrial> trials) {
  std::uint64_t faces = 0;
  for (const LightTrial& trial : trials) {
    if (trial.size != 0 && !is_wide(trial)) faces += trial.faces;
  }
  return faces;
}

double share_asked(const LightTrial& next, double laid_out, double faces) {
  if (next.size == 0 || next.faces <= kQuickFaces) return kWorthwhile;
  const double with_next = laid_out + static_cast<double>(next.faces);
  return with_next > kMostLaidOut * faces ? kMuchLighter : kWorthwhile;
}

bool has_texels(std::uint64_t faces, std::uint32_t size) {
  return size == 0 || 1.0 * size * size >= kTexelsOfFace * static_cast<double>(faces);
}

LightMisses LightMisses::of(std::span<const LightTrial> trials, std::uint32_t size, double wanted) {
  LightMisses misses{size};
  for (const LightTrial& trial : trials) {
    if (trial.size != size || is_wide(trial) || trial.measured <= wanted) continue;
    const auto bytes = static_cast<double>(trial.bytes.total());
    misses.heaviest = std::max(misses.heaviest, bytes);
    misses.finest = std::max(misses.finest, trial.faces);
    if (misses.nearest == 0 || trial.measured < misses.nearest) {
      misses.nearest = trial.measured;
      misses.nearest_faces = static_cast<double>(trial.faces);
    }
    if (trial.expected <= wanted) ++misses.count;
    if (trial.measured <= kNearly * wanted) ++misses.near;
  }
  return misses;
}

double LightMisses::aim(double wanted) const {
  if (size == 0) return wanted;
  return wanted * (1 - kFirstCare - kCare * static_cast<double>(count));
}

double LightMisses::next_bytes(double best) const {
  const double finer = heaviest * (1 + kFiner * static_cast<double>(std::min(count, kFinerMisses)));
  return std::min(finer, (heaviest + best) / 2);
}

double LightMisses::price() const { return 1 + kMissPrice * static_cast<double>(count); }

double LightMisses::between(double best, double wanted) const {
  const bool far = nearest > 0 && nearest <= kAlmost * wanted && best > kFarHeavier * heaviest;
  return far ? std::sqrt(heaviest * best) : 0;
}

bool LightMisses::nearly(double wanted) const {
  return size != 0 && near > 0 && near <= kMostNear && nearest <= kNearly * wanted;
}

double LightMisses::next_faces(double wanted) const {
  return nearest_faces * std::pow(nearest / aim(wanted), 1 / kFallsWithFaces);
}

double LightMisses::falling(std::uint64_t faces) const {
  if (nearest == 0) return kEndless;
  return nearest * std::pow(nearest_faces / static_cast<double>(faces), kFallsWithFaces);
}

const LightOffer& quickest(std::span<const LightOffer> offers, double most) {
  const LightOffer& cheapest =
      *std::min_element(offers.begin(), offers.end(),
                        [](const LightOffer& a, const LightOffer& b) { return a.price < b.price; });
  if (cheapest.size == 0) return cheapest;
  const LightOffer* best = &cheapest;
  for (const LightOffer& offer : offers) {
    if (offer.size == 0 || offer.faces >= best->faces) continue;
    const bool far_fewer = offer.price < most && kFarFewer * offer.faces <= best->faces;
    const double share = far_fewer ? kMuchLighter : kWorthwhile;
    if (share * offer.price < cheapest.price) best = &offer;
  }
  return *best;
}

void fill_trade(LightBake& plan, const LightModel& model, std::span<const std::uint32_t> sizes,
                const std::function<LightTrial(std::size_t, std::uint32_t)>& guess) {
  plan.trade.clear();
  plan.outlook.clear();
  plan.levels.clear();
  const std::map<std::size_t, LightModel::Node> known = model.known();
  const std::size_t coarsest = known.empty() ? 0 : known.rbegin()->first + 1;
  for (const std::uint32_t size : sizes) {
    const LightMisses misses = LightMisses::of(plan.trials, size, plan.wanted);
    const double aim = misses.aim(plan.wanted);
    std::size_t level = std::min(coarsest, model.count());
    while (level > 0 && (model.guessed(level - 1, size) > aim ||
                         guess(level - 1, size).faces <= misses.finest)) {
      --level;
    }
    if (level == 0) continue;
    const LightTrial fewest = guess(level - 1, size);
    if (fewest.bytes.total() <= kShown * plan.chosen.bytes.total()) plan.trade.push_back(fewest);
  }
  for (const auto& [level, node] : known) {
    for (const std::uint32_t size : sizes) plan.outlook.push_back(guess(level, size));
    const LightTrial plain = guess(level, 0);
    plan.levels.push_back({plain.faces, plain.positions, node.plain, node.limit});
  }
  std::reverse(plan.levels.begin(), plan.levels.end());
}

double most_one_sided(const LightPlanOptions& options) {
  return options.max_outline > 0 ? options.max_outline : kMostOneSided;
}

bool has_outlines(const LightTrial& trial, double max_outline) {
  return max_outline == 0 || trial.one_sided <= max_outline;
}

bool is_better(const LightTrial& next, const LightTrial& best, double wanted) {
  const bool best_reaches = best.measured <= wanted;
  if (next.measured <= wanted) return !best_reaches || next.bytes.total() < best.bytes.total();
  return !best_reaches && next.measured < best.measured;
}

void correct(std::span<LightTrial> trials, const LightTrial& measured) {
  for (LightTrial& trial : trials) {
    if (trial.faces == measured.faces && trial.size == measured.size &&
        trial.laid_out_for == measured.laid_out_for) {
      trial = measured;
    }
  }
}

bool was_tried(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size) {
  return std::any_of(trials.begin(), trials.end(), [&](const LightTrial& trial) {
    return trial.faces == faces && trial.size == size && !is_wide(trial);
  });
}

bool tried_about(std::span<const LightTrial> trials, std::uint64_t faces, std::uint32_t size) {
  return std::any_of(trials.begin(), trials.end(), [&](const LightTrial& trial) {
    const double ratio = static_cast<double>(trial.faces) / static_cast<double>(faces);
    return trial.size == size && !is_wide(trial) && ratio < kOtherFaces && ratio > 1 / kOtherFaces;
  });
}

}  // namespace kiln
