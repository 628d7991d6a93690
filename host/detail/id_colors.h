// Distinct colours for parts and names.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kiln {

/// Colour of the part with a number. The colours of different parts are far apart, and none is
/// black, the background.
std::array<float, 3> part_color(std::uint32_t part);

/// Colours of names: exact in 8 bits, all different, and none black. A name has the same colour in
/// every mesh, unless a name before it in alphabetical order has a colour that is too near; in this
/// case the later name gets another colour.
std::vector<std::array<float, 3>> name_colors(std::span<const std::string> names);

}  // namespace kiln
