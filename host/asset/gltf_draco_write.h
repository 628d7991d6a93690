// Writing of KHR_draco_mesh_compression.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kiln {

/// An attribute of all vertices of a primitive.
struct DracoStream {
  enum class Use { position, normal, uv, other };

  Use use = Use::other;
  std::size_t width = 0;              ///< Numbers per vertex
  std::vector<float> values;          ///< Empty if `shares` is used
  std::vector<std::uint16_t> shares;  ///< In 1/65535; stored exactly
};

/// True if Draco was built in.
bool can_pack_draco();

/// A primitive compressed by Draco.
struct DracoPrimitive {
  std::string bytes;
  std::size_t vertices = 0;        ///< After decompression
  std::size_t indices = 0;         ///< After decompression
  std::vector<std::uint32_t> ids;  ///< Ids of the streams, in order
};

/// Compresses triangles: positions and UVs in 16 bits of their range, other attributes in 12. \throws Error(usage)
/// without Draco
DracoPrimitive pack_draco(std::span<const std::uint32_t> indices, std::size_t vertices,
                          std::span<const DracoStream> streams);

}  // namespace kiln
