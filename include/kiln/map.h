#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "kiln/bake.h"

namespace kiln {

/// What the values of a map are, and so how they are averaged, padded and encoded.
enum class MapType {
  unit_vector,    ///< Averaged as a direction; encoded as n/2 + 1/2 unless BakeOptions::raw
  signed_scalar,  ///< One number of either sign
  scalar,         ///< One number of 0 or more
  vector,         ///< Numbers of either sign, each by itself
  id,             ///< A colour that names something: never averaged, no mip chain
  coverage,       ///< About texels, not the high poly: no padding, no mip chain
};

/// A map that bake() can make.
struct MapInfo {
  MapKind kind;  ///< Its name, for BakeOptions::maps and for file names
  std::uint32_t channels = 3;
  MapType type = MapType::unit_vector;
  std::string_view holds;  ///< In words, with the unit
  /// Values that integer formats put at 0 and at 1. Both 0: they depend on what was baked; see value_range().
  float low = 0, high = 1;
};

/// All maps, in the order that they are listed to people.
std::span<const MapInfo> maps();

/// \throws Error(usage) for a name that no map has; the message lists those there are
const MapInfo& find_map(std::string_view name);

/// Values of each channel that an integer format puts at 0 and at 1.
struct ValueRange {
  float low = 0, high = 1;
};

/// The range of a baked map: MapInfo's; else of the texels that are baked: -m to m with the largest magnitude
/// m for MapType::signed_scalar, the least to the greatest value of the channel for others.
/// \param coverage  BakeResult::coverage
/// \param channel   below the map's channels
ValueRange value_range(const BakedMap& map, std::span<const std::uint8_t> coverage,
                       std::uint32_t channel);

}  // namespace kiln
