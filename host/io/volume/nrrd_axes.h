// The axes of a NRRD file: sizes, spacings, directions, and which three of them are the volume's.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/volume/volume_header.h"
#include "io/volume/volume_reader.h"

namespace kiln {

/// One axis of the file, of any number.
struct NrrdAxis {
  std::uint64_t size = 0;
  std::string kind;  ///< Empty: not said
  std::optional<double> spacing;
  std::optional<double> minimum;  ///< Position of its start
  std::optional<double> maximum;  ///< ... and of its end
  bool cell_centered = false;
  bool node_centered = false;
  bool has_direction = false;  ///< `space directions` is given, and not "none" here
  std::array<double, 3> direction{};
};

std::vector<NrrdAxis> parse_axes(const VolumeInput& input, const HeaderFields& fields);

/// Which of the axes are the volume's three.
std::array<std::size_t, 3> choose_axes(const VolumeInput& input, const HeaderFields& fields,
                                       const std::vector<NrrdAxis>& axes);

/// Gives the volume its axes and origin, right-handed.
void place_in_space(const VolumeInput& input, const HeaderFields& fields,
                    const std::vector<NrrdAxis>& axes, const std::array<std::size_t, 3>& chosen,
                    Volume& volume);

}  // namespace kiln
