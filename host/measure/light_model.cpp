#include "measure/light_model.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace kiln {
namespace {

/// Levels looked at are this far apart: about half as many faces each.
constexpr std::size_t kStep = 17;
/// Levels between two that are known follow from these, unless they are farther apart.
constexpr std::size_t kWide = 3 * kStep;
/// A search that is far from its bound takes larger steps: errors grow at most so many times a step, and it skips at
/// most so many.
constexpr double kGrowth = 3;
constexpr std::size_t kMostSteps = 3;
/// Where a search begins, faces.
constexpr double kFirst = 1000;
/// A rough fit's errors are within e to the power of this, times those of a good one.
constexpr double kMostRough = 0.5;
/// With more faces, errors fall at least with this power of their number.
constexpr double kLeastFall = 0.25;
/// An error is at least this share of the limit above it.
constexpr double kLeastAbove = 0.01;
constexpr double kTiny = 1e-9;
/// What a map of a mip-map's size has of its sharpness: its charts are farther apart.
constexpr double kOfMip = 0.8;
/// And of a map whose charts are laid out for half its size: these are nearer.
constexpr double kOfWide = 1.12;
/// Sharpness grows with a power of a map's texels a side: this one, at least: smaller maps told less than they seem to, since mip-maps are better than maps of their size.
constexpr double kLeastGain = 1.2;
/// Of sharpness against faces, both as logarithms: bounds, and the spread of faces that halves a slope.
constexpr double kLeastSlope = -1, kMostSlope = 1, kScatter = 0.08;

double between(double a, double b, double share) {
  if (!(a > 0) || !(b > 0)) return a + (b - a) * share;
  return std::exp(std::log(a) + (std::log(b) - std::log(a)) * share);
}

}  // namespace

LightModel::LightModel(std::vector<double> faces, std::function<Node(std::size_t)> look,
                       std::function<double(std::size_t)> plain)
    : faces_(std::move(faces)),
      count_(faces_.size()),
      look_(std::move(look)),
      look_plain_(std::move(plain)) {}

void LightModel::Shares::add(double made, double looked) {
  if (!(made > 0) || !(looked > 0)) return;
  sum += std::clamp(std::log(made / looked), -kMostRough, kMostRough);
  ++count;
}

double LightModel::Shares::mean() const { return count == 0 ? 1 : std::exp(sum / count); }

LightModel::Node LightModel::exactly(std::size_t level) {
  const auto known = nodes_.find(level);
  if (known != nodes_.end() && (!known->second.is_plain_looked || known->second.is_made))
    return corrected(known->second);
  Found& found = nodes_[level];
  found.looked = look_(level);
  found.is_looked = true;
  found.is_plain_looked = false;
  return corrected(found);
}

LightModel::Node LightModel::plainly(std::size_t level) {
  if (knows(level)) return corrected(nodes_.at(level));
  const Node line = between_looks(level);
  if (!look_plain_ || !(line.limit > 0)) return exactly(level);
  Found& found = nodes_[level];
  found.looked = line;
  found.looked.plain = look_plain_(level);
  found.is_looked = found.is_plain_looked = true;
  return corrected(found);
}

double LightModel::glance(std::size_t level) {
  if (knows(level) || !look_plain_) return exactly(level).plain;
  return look_plain_(level) * plain_share_.mean();
}

LightModel::Node LightModel::corrected(const Found& found) const {
  Node node = found.made;
  if (!found.is_plain_made) node.plain = found.looked.plain * plain_share_.mean();
  if (!found.is_made) {
    node.bare = found.looked.bare * bare_share_.mean();
    node.limit = found.looked.limit * limit_share_.mean();
  }
  return node;
}

bool LightModel::may_guess_plain(std::size_t level) const {
  return plain_share_.count > 0 && between_looks(level).plain > 0;
}

void LightModel::know(std::size_t level, const Node& node) {
  const Node looked = between_looks(level);
  plain_share_.add(node.plain, looked.plain);
  bare_share_.add(node.bare, looked.bare);
  limit_share_.add(node.limit, looked.limit);
  Found& found = nodes_[level];
  found.made = node;
  if (!found.is_looked) found.looked.plain = looked.plain;
  found.is_made = true;
  found.is_plain_made = node.plain > 0;
}

void LightModel::know_plain(std::size_t level, double plain) {
  plainly(level);
  Found& found = nodes_[level];
  if (found.is_looked) plain_share_.add(plain, found.looked.plain);
  found.made.plain = plain;
  found.is_plain_made = true;
}

double LightModel::faces_for(double limit) const {
  const std::map<std::size_t, Node> nodes = known();
  if (nodes.empty()) return faces_.front();
  const auto finest = nodes.begin(), next = std::next(finest);
  double slope = kLeastFall;
  if (next != nodes.end() && finest->second.limit > 0) {
    slope = std::log(next->second.limit / finest->second.limit) /
            std::log(faces_[finest->first] / faces_[next->first]);
  }
  const double over = std::max(1.0, finest->second.limit / limit);
  return faces_[finest->first] * std::pow(over, 1 / std::max(slope, kLeastFall));
}

std::map<std::size_t, LightModel::Node> LightModel::known() const {
  std::map<std::size_t, Node> result;
  for (const auto& [level, found] : nodes_) result[level] = corrected(found);
  return result;
}

LightModel::Node LightModel::on_line(std::size_t level, std::size_t a, const Node& at_a,
                                     std::size_t b, const Node& at_b) const {
  const double share = std::log(faces_[level] / faces_[a]) / std::log(faces_[b] / faces_[a]);
  return {between(at_a.plain, at_b.plain, share), between(at_a.bare, at_b.bare, share),
          between(at_a.limit, at_b.limit, share)};
}

LightModel::Node LightModel::between_looks(std::size_t level) const {
  std::map<std::size_t, Node> looks;
  for (const auto& [at, found] : nodes_) {
    if (found.is_looked) looks[at] = found.looked;
  }
  const auto after = looks.lower_bound(level);
  if (after == looks.end()) return {};
  if (after->first == level) return after->second;
  if (after == looks.begin()) return {};
  const auto before = std::prev(after);
  return on_line(level, before->first, before->second, after->first, after->second);
}

LightModel::Node LightModel::at(std::size_t level) {
  const std::size_t first = level / kStep * kStep;
  for (;;) {
    const auto after = nodes_.lower_bound(level);
    if (after != nodes_.end() && after->first == level) return corrected(after->second);
    if (after == nodes_.end()) {
      exactly(first == level ? level : std::min(first + kStep, count() - 1));
    } else if (after == nodes_.begin()) {
      // Somewhat finer than all that is known: along their line.
      if (nodes_.size() > 1 && after->first - level <= kStep) return guess(level);
      exactly(first);
    } else if (after->first - std::prev(after)->first > kWide) {
      exactly(first > std::prev(after)->first ? first : std::min(first + kStep, after->first - 1));
    } else {
      return guess(level);
    }
  }
}

LightModel::Node LightModel::guess(std::size_t level) const {
  const auto after = nodes_.lower_bound(level);
  if (after != nodes_.end() && after->first == level) return corrected(after->second);
  if (nodes_.size() < 2) return nodes_.empty() ? Node{} : corrected(nodes_.begin()->second);
  if (after == nodes_.begin()) return beyond(level, nodes_.begin(), nodes_.end());
  if (after == nodes_.end()) return beyond(level, nodes_.rbegin(), nodes_.rend());
  const auto before = std::prev(after);
  return on_line(level, before->first, corrected(before->second), after->first,
                 corrected(after->second));
}

/// Errors of neighbours scatter, so the line goes through one that is farther off. Coarser levels have no less than
/// the last, finer ones no more.
template <class Iterator>
LightModel::Node LightModel::beyond(std::size_t level, Iterator last, Iterator end) const {
  const std::size_t at = last->first;
  const Node known = corrected(last->second);
  Iterator other = std::next(last);
  const auto apart = [at](std::size_t i) { return i > at ? i - at : at - i; };
  while (apart(other->first) < kStep && std::next(other) != end) ++other;
  const Node line = on_line(level, at, known, other->first, corrected(other->second));
  const auto bounded = [&](double value, double bound) {
    return level > at ? std::max(value, bound) : std::min(value, bound);
  };
  return {bounded(line.plain, known.plain), bounded(line.bare, known.bare),
          bounded(line.limit, known.limit)};
}

void LightModel::forget() {
  nodes_.clear();
  plain_share_ = bare_share_ = limit_share_ = {};
}

void LightModel::measured(std::size_t level, std::uint32_t size, double error, Map map) {
  const Node node = exactly(level);
  const double above = std::max({error - node.limit, kLeastAbove * node.limit, kTiny});
  const double range = std::max(node.bare - node.limit, kTiny);
  Known& known = sharpness_[size];
  std::erase_if(known, [&](const Sharpness& other) {
    return other.map == Map::mip || (other.map == Map::wide && other.level == level);
  });
  // A map that is no better than none still tells that larger ones are needed.
  const double share = map == Map::mip ? kOfMip : map == Map::wide ? kOfWide : 1;
  known.push_back({level, std::max(share / above - 1 / range, 0.01 / range), map});
  slope_ = slope();
}

/// Maps of all sizes gain or lose alike with more faces: slopes of one size differ by scatter.
double LightModel::slope() const {
  double products = 0, squares = kScatter;
  for (const auto& [size, known] : sharpness_) {
    double mean_x = 0, mean_y = 0;
    for (const Sharpness& map : known) {
      mean_x += std::log(faces_[map.level]) / static_cast<double>(known.size());
      mean_y += std::log(map.value) / static_cast<double>(known.size());
    }
    for (const Sharpness& map : known) {
      const double x = std::log(faces_[map.level]) - mean_x;
      products += x * (std::log(map.value) - mean_y);
      squares += x * x;
    }
  }
  return std::clamp(products / squares, kLeastSlope, kMostSlope);
}

/// From the map whose level is nearest, along the slope of all. Errors scatter, so maps of about as many faces
/// tell little of it.
double LightModel::at_level(const Known& known, std::size_t level) const {
  Sharpness nearest = known.front();
  const auto apart = [&](const Sharpness& map) {
    return map.level > level ? map.level - level : level - map.level;
  };
  for (const Sharpness& map : known) {
    if (apart(map) <= apart(nearest)) nearest = map;
  }
  return nearest.value * std::pow(faces_[level] / faces_[nearest.level], slope_);
}

double LightModel::sharpness(std::size_t level, std::uint32_t size) const {
  if (sharpness_.empty()) return 0;  // nothing is known of any map
  const auto after = sharpness_.lower_bound(size);
  const auto scaled = [&](const auto& known) {
    const double ratio = static_cast<double>(size) / known->first;
    return at_level(known->second, level) * ratio * ratio;
  };
  if (after == sharpness_.end()) {
    const auto largest = std::prev(after);
    if (largest == sharpness_.begin()) return scaled(largest);
    // Beyond what is known: along the slope of the largest two. Edges are blurred by a texel's width, so that what
    // texels add falls with their number at half the pace of what smooth detail adds.
    const auto smaller = std::prev(largest);
    const double value = at_level(largest->second, level);
    const double slope = std::log(value / at_level(smaller->second, level)) /
                         std::log(1.0 * largest->first / smaller->first);
    const double ratio = static_cast<double>(size) / largest->first;
    return value * std::pow(ratio, std::clamp(slope, kLeastGain, 2.0));
  }
  if (after->first == size || after == sharpness_.begin()) return scaled(after);
  const auto before = std::prev(after);
  const double share =
      std::log(1.0 * size / before->first) / std::log(1.0 * after->first / before->first);
  return between(at_level(before->second, level), at_level(after->second, level), share);
}

double LightModel::expected(std::size_t level, std::uint32_t size) {
  return with_map(at(level), level, size);
}

double LightModel::guessed(std::size_t level, std::uint32_t size) const {
  return with_map(guess(level), level, size);
}

double LightModel::with_map(const Node& node, std::size_t level, std::uint32_t size) const {
  if (size == 0) return node.plain;
  const double range = std::max(node.bare - node.limit, kTiny);
  return node.limit + 1 / (1 / range + sharpness(level, size));
}

std::optional<std::size_t> LightModel::fewest(const std::function<double(std::size_t)>& share,
                                              std::size_t finest) {
  const auto holds = [&](std::size_t level) { return share(level) <= 1; };
  // From the middle outwards, since looking at fine levels takes long and coarse ones tell little.
  std::size_t level = 0;
  while (level + kStep < count() && faces_[level] > kFirst) level += kStep;
  level = std::max(level, finest);
  std::size_t good = level, bad = count();
  double used = share(level);
  if (used <= 1) {
    while (bad == count() && good + kStep < count()) {
      const double room = -std::log(std::max(used, kTiny)) / std::log(kGrowth);
      std::size_t steps = std::clamp(static_cast<std::size_t>(room), std::size_t{1}, kMostSteps);
      while (good + steps * kStep >= count()) --steps;
      used = share(good + steps * kStep);
      (used <= 1 ? good : bad) = good + steps * kStep;
    }
  } else {
    do {
      if (good == finest) return std::nullopt;
      bad = good;
      good = std::max(finest, good - std::min(kStep, good));
    } while (!holds(good));
  }
  while (bad - good > 1) {
    const std::size_t middle = (good + bad) / 2;
    (holds(middle) ? good : bad) = middle;
  }
  return good;
}

}  // namespace kiln
