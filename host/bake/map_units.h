// Units in which errors of maps are reported, and differences of values in these units.
#pragma once

#include <string_view>

#include "detail/registry.h"

namespace kiln {

/// Unit of a map's errors, and the factor that converts values to it.
struct MapUnit {
  std::string_view name;
  double scale = 1;
};
MapUnit unit_of(const MapRow& row);

/// Difference of two values in the map's unit: the angle of unit vectors, the length of other vectors over
/// MapRow::compared_channels, and the CIE 1976 difference of colours, a distance in CIELAB. A difference of alpha
/// from transparent to opaque counts as 100.
double map_difference(const MapRow& row, const float* a, const float* b);

}  // namespace kiln
