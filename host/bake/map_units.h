// In which unit a map's errors are told, and how far two of its values are apart.
#pragma once

#include <string_view>

#include "detail/registry.h"

namespace kiln {

/// The unit of a map's errors, and what its values are multiplied with to be in it.
struct MapUnit {
  std::string_view name;
  double scale = 1;
};
MapUnit unit_of(const MapRow& row);

/// Difference of two values in the map's unit: unit vectors by their angle, other vectors by their length, over
/// MapRow::compared_channels.
/// Colours by the CIE 1976 difference, the length between them in CIELAB; alpha counts as 100 from clear to solid.
double map_difference(const MapRow& row, const float* a, const float* b);

}  // namespace kiln
