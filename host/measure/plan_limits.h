// What a plan begins with, prepares for and takes for near enough.
#pragma once

#include <cstddef>
#include <cstdint>

#include "kiln/bake.h"

namespace kiln {

inline constexpr std::uint32_t kFirstSize = 128;
/// Another way to match must get nearer by this to be worth what it costs.
inline constexpr double kGain = 0.97;
/// A share of places that rays may miss without there being something wrong.
inline constexpr double kFewMissed = 0.01;
/// Of the map that a way to match is told to prepare for where it has yet to be tried.
inline constexpr std::uint32_t kLimitSize = 1024;
inline constexpr std::uint32_t kLimitDirections = 128;
inline constexpr std::uint32_t kLimitView = 512;
/// Triangles from which on building a hierarchy takes longer than all else.
inline constexpr std::size_t kMany = 2000000;
/// An error this close to what the shape allows is as good as it.
inline constexpr double kLevel = 1.05;
/// What is expected to miss the error by less may reach it.
inline constexpr double kNear = 1.04;

/// The two layouts turned out not to agree, at one size or another, or nothing lies at the same UVs.
struct Unfit {};

/// Whether a bake had texels, and found a point for none of them.
inline bool found_nothing(const BakeReport& report) {
  return report.samples != 0 && report.missed == report.samples;
}

inline double missed_share(const BakeReport& report) {
  if (report.samples == 0) return 1;
  return static_cast<double>(report.missed) / static_cast<double>(report.samples);
}

}  // namespace kiln
