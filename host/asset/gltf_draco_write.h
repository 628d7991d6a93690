// Writes KHR_draco_mesh_compression.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kiln {

/// An attribute of all vertices of a primitive, as one stream of numbers.
struct DracoStream {
  enum class Use { position, normal, uv, other };

  Use use = Use::other;
  std::size_t width = 0;      ///< How many numbers the stream holds for each vertex
  std::vector<float> values;  ///< The stream's numbers; empty if `shares` holds them
  /// The stream's numbers if all lie in [0, 1]: multiples of 1/65535, which are stored exactly
  std::vector<std::uint16_t> shares;
};

/// True if Draco was built in.
bool can_pack_draco();

/// A primitive's triangles, compressed by Draco.
struct DracoPrimitive {
  std::string bytes;
  std::size_t vertices = 0;        ///< Number of vertices after decompression
  std::size_t indices = 0;         ///< Number of indices after decompression
  std::vector<std::uint32_t> ids;  ///< Ids of the streams in Draco, in the order of the streams
};

/// Compresses triangles: positions and UVs in 16 bits of their range, other attributes in 12. \throws Error(usage)
/// without Draco
DracoPrimitive pack_draco(std::span<const std::uint32_t> indices, std::size_t vertices,
                          std::span<const DracoStream> streams);

}  // namespace kiln
