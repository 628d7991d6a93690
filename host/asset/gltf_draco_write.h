// KHR_draco_mesh_compression, out.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kiln {

/// Numbers of all vertices that a primitive is packed with.
struct DracoStream {
  enum class Use { position, normal, uv, other };

  Use use = Use::other;
  std::size_t width = 0;              ///< Numbers a vertex
  std::vector<float> values;          ///< Empty where `shares` has them
  std::vector<std::uint16_t> shares;  ///< Of 65535; kept as they are
};

/// True if Draco was built in.
bool can_pack_draco();

/// A primitive as Draco packs it.
struct DracoPrimitive {
  std::string bytes;
  std::size_t vertices = 0;        ///< When unpacked
  std::size_t indices = 0;         ///< The same
  std::vector<std::uint32_t> ids;  ///< Of the streams, in order
};

/// Packs triangles: positions and UVs in 16 bits of their range, other numbers in 12. \throws Error(usage) without Draco
DracoPrimitive pack_draco(std::span<const std::uint32_t> indices, std::size_t vertices,
                          std::span<const DracoStream> streams);

}  // namespace kiln
