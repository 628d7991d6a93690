// Writes KHR_draco_mesh_compression.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kiln {

/// An attribute of all vertices of a primitive, as one sequence of numbers.
struct DracoStream {
  enum class Use { position, normal, uv, other };

  Use use = Use::other;
  std::size_t width = 0;      ///< Number of components per vertex
  std::vector<float> values;  ///< The numbers; empty if they are in `shares`
  /// The numbers as multiples of 1/65535, which are stored exactly; used if all lie in [0, 1]
  std::vector<std::uint16_t> shares;
};

/// True if Draco was built in.
bool can_pack_draco();

/// The triangles of a primitive, compressed by Draco.
struct DracoPrimitive {
  std::string bytes;
  std::size_t vertices = 0;        ///< Number of vertices after decompression
  std::size_t indices = 0;         ///< Number of indices after decompression
  std::vector<std::uint32_t> ids;  ///< Id of each stream in Draco, in the order of the streams
};

/// Compresses triangles. Positions and UVs are quantised to 16 bits of their range, other
/// attributes to 12.
/// \throws Error(usage) in builds without Draco
DracoPrimitive pack_draco(std::span<const std::uint32_t> indices, std::size_t vertices,
                          std::span<const DracoStream> streams);

}  // namespace kiln
