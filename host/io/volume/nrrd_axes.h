// The axes of a NRRD file: their sizes, spacings and directions, and the choice of three of them
// for the volume.
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

/// An axis of a NRRD file.
struct NrrdAxis {
  std::uint64_t size = 0;
  std::string kind;  ///< The field `kinds` for this axis; empty if missing
  std::optional<double> spacing;
  std::optional<double> minimum;  ///< Position of the axis's start
  std::optional<double> maximum;  ///< Position of the axis's end
  bool cell_centered = false;
  bool node_centered = false;
  /// True if `space directions` gives a direction for this axis, not "none"
  bool has_direction = false;
  std::array<double, 3> direction{};
};

std::vector<NrrdAxis> parse_axes(const VolumeInput& input, const HeaderFields& fields);

/// Chooses the three axes that are the volume's.
std::array<std::size_t, 3> choose_axes(const VolumeInput& input, const HeaderFields& fields,
                                       const std::vector<NrrdAxis>& axes);

/// Sets the axes and the origin of the volume, converted to a right-handed space.
void place_in_space(const VolumeInput& input, const HeaderFields& fields,
                    const std::vector<NrrdAxis>& axes, const std::array<std::size_t, 3>& chosen,
                    Volume& volume);

}  // namespace kiln
