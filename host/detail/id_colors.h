// Colours that tell things apart.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kiln {

/// Colour of a number: far apart from others', the same for the same number; none is black, which is the background.
std::array<float, 3> part_color(std::uint32_t part);

/// Colours of names: exact in 8 bits, all different, none black. A name has the same colour wherever it
/// appears. Another name of the mesh, earlier in the alphabet, may have one too near; then it differs.
std::vector<std::array<float, 3>> name_colors(std::span<const std::string> names);

}  // namespace kiln
