#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Which way a sample of a Match was decided, or why it was not.
enum class SampleStatus : std::uint8_t {
  empty = 0,      ///< No sample here: the texel is not covered
  outward = 1,    ///< Ray along the sample's direction
  inward = 2,     ///< Ray against it
  cage = 3,       ///< Ray from the cage inward
  missed = 4,     ///< No point within the distance
  view = 5,       ///< Seen in a depth view
  closest = 6,    ///< The nearest point
  uv = 7,         ///< The point with the same UV
  outermost = 8,  ///< Ray along the direction, past a nearer face
};

/// The correspondence of a bake, per sample of the map, kept on the host: everything else can be baked
/// from it again. Arrays have width * height elements (of the supersampled map), rows from the top. What
/// must hold of them says validate() (kiln/validate.h).
struct Match {
  std::uint32_t width = 0;             ///< map width * samples
  std::uint32_t height = 0;            ///< map height * samples
  std::uint32_t samples = 1;           ///< N x N a texel
  std::uint64_t source_triangles = 0;  ///< For checking against the mesh it is used with
  std::uint64_t source_hash = 0;       ///< Of the high poly's triangles and positions; 0: not known
  std::uint64_t low_hash = 0;          ///< Of the low poly's triangles, positions and UVs
  std::vector<std::uint32_t> triangle;  ///< Source triangle, 0xFFFFFFFF: none
  std::vector<float> u;                 ///< Weight of the triangle's corner 1
  std::vector<float> v;                 ///< Weight of the triangle's corner 2
  std::vector<float> distance;          ///< World units, outward positive
  std::vector<std::uint8_t> status;     ///< Values of SampleStatus

  /// The status of a sample; \param i below width * height.
  SampleStatus status_of(std::size_t i) const { return static_cast<SampleStatus>(status[i]); }
};

/// Writes a Match as a float EXR with channels `triangle` (unsigned int), `u`, `v`, `distance` (float),
/// `status` (unsigned int). The file appears whole or not at all. Several threads may save and load at once.
/// \throws Error(output); Error(input) for a match that does not hold together
void save_match(const Match& match, const std::filesystem::path& path);
/// Reads what save_match() wrote. \throws Error(input) that names the file and the field
Match load_match(const std::filesystem::path& path);

}  // namespace kiln
