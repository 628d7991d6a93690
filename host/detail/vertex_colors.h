// Colours of the high poly's vertices at a point.
#pragma once

#include "detail/point_map.h"

namespace kiln {

/// \throws Error(input) if the high poly has no vertex colours; the message names the map and the remedy
void check_vertex_colors(const Source::Impl& source, const char* map, const char* remedy);

/// \param point  must not be a miss
/// \param value  [out] red, green and blue in linear light, and alpha
void read_vertex_color(const Source::Impl& source, const HighPoint& point, float* value);

}  // namespace kiln
