#include "detail/id_colors.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "base/fnv.h"

namespace kiln {
namespace {

using Bytes = std::array<std::uint8_t, 3>;

// Minimum distances between the colours of two names, in RGB from 0 to 255, from the preferred to
// the smallest one. If kTriesPerDistance candidates are nearer than a distance to a colour in use,
// the next distance is tried.
constexpr std::array<int, 4> kMinDistances = {80, 40, 20, 1};
constexpr int kTriesPerDistance = 48;
// Number of names whose colours have these distances. The colours of further names only have to
// differ from all others.
constexpr std::size_t kMaxSeparatedNames = 1024;

/// RGB of a hue at a brightness.
/// \param hue_angle  in turns, [0, 1)
std::array<float, 3> hue_color(double hue_angle, double brightness) {
  const double hue = 6 * hue_angle;
  std::array<float, 3> color{};
  for (std::size_t c = 0; c < 3; ++c) {
    // Distance between the hue and that of the channel's primary colour, on a circle of
    // circumference 6.
    const double hue_distance =
        std::abs(std::fmod(hue + 6 - 2.0 * static_cast<double>(c) + 3, 6.0) - 3);
    color[c] =
        static_cast<float>(brightness * (0.15 + 0.85 * std::clamp(2 - hue_distance, 0.0, 1.0)));
  }
  return color;
}

/// Hash of a name and the number of an attempt: FNV-1a, then one step of splitmix64.
std::uint64_t name_hash(const std::string& name, std::uint64_t attempt) {
  std::uint64_t hash = fnv1a(name) + (attempt + 1) * 0x9E3779B97F4A7C15U;
  hash = (hash ^ (hash >> 30U)) * 0xBF58476D1CE4E5B9U;
  hash = (hash ^ (hash >> 27U)) * 0x94D049BB133111EBU;
  return hash ^ (hash >> 31U);
}

/// One of about 60 colours, chosen by a name's hash. Any two of them are at least 85 apart, so two
/// names seldom get colours that are too near.
Bytes first_candidate(const std::string& name, std::uint64_t attempt) {
  const std::uint64_t number = name_hash(name, attempt);
  Bytes color{};
  for (std::size_t c = 0; c < 3; ++c) {
    color[c] = static_cast<std::uint8_t>(85 * (number >> (8 * c) & 3U));
  }
  if (*std::max_element(color.begin(), color.end()) < 170) color[(number >> 32U) % 3] = 255;
  return color;
}

/// Any colour, chosen by a name's hash, that is bright enough to differ from the background.
Bytes candidate_color(const std::string& name, std::uint64_t attempt) {
  const std::uint64_t number = name_hash(name, attempt);
  Bytes color{};
  for (std::size_t c = 0; c < 3; ++c) {
    color[c] = static_cast<std::uint8_t>(number >> (8 * c));
  }
  if (*std::max_element(color.begin(), color.end()) < 96) color[(number >> 32U) % 3] |= 0xC0U;
  return color;
}

int color_distance(const Bytes& a, const Bytes& b) {
  int squared_distance = 0;
  for (std::size_t c = 0; c < 3; ++c) squared_distance += (a[c] - b[c]) * (a[c] - b[c]);
  return static_cast<int>(std::sqrt(squared_distance));
}

Bytes color_of(const std::string& name, const std::vector<Bytes>& used_colors,
               const std::set<Bytes>& used_color_set) {
  for (const int min_distance : used_colors.size() < kMaxSeparatedNames ? std::span(kMinDistances)
                                                                        : std::span<const int>()) {
    for (int attempt = 0; attempt < kTriesPerDistance; ++attempt) {
      const auto number = static_cast<std::uint64_t>(attempt);
      const Bytes color = min_distance == kMinDistances[0] ? first_candidate(name, number)
                                                           : candidate_color(name, number);
      if (std::all_of(used_colors.begin(), used_colors.end(), [&](const Bytes& other) {
            return color_distance(color, other) >= min_distance;
          })) {
        return color;
      }
    }
  }
  std::uint64_t attempt = 0;
  while (used_color_set.contains(candidate_color(name, attempt))) ++attempt;
  return candidate_color(name, attempt);
}

}  // namespace

std::array<float, 3> part_color(std::uint32_t part) {
  constexpr double kGoldenShare = 0.6180339887498949;
  return hue_color(std::fmod(part * kGoldenShare, 1.0), 1 - 0.25 * (part % 3));
}

std::vector<std::array<float, 3>> name_colors(std::span<const std::string> names) {
  std::vector<std::size_t> order(names.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return names[a] < names[b]; });
  std::vector<std::array<float, 3>> colors(names.size());
  std::vector<Bytes> used_colors;
  std::set<Bytes> used_color_set;
  for (const std::size_t i : order) {
    const Bytes color = color_of(names[i], used_colors, used_color_set);
    used_colors.push_back(color);
    used_color_set.insert(color);
    for (std::size_t c = 0; c < 3; ++c) colors[i][c] = static_cast<float>(color[c]) / 255.0F;
  }
  return colors;
}

}  // namespace kiln
