// Distinct colours for parts and names.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kiln {

/// Colour of a part, given by its number. Colours of different parts are far apart; none is black, the
/// background.
std::array<float, 3> part_color(std::uint32_t part);

/// Colours of names: exact in 8 bits, all different, none black. A name has the same colour in every mesh, unless an
/// alphabetically earlier name has a colour that is too near; then the later name gets another one.
std::vector<std::array<float, 3>> name_colors(std::span<const std::string> names);

}  // namespace kiln
