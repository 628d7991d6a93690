// Reads KHR_draco_mesh_compression.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asset/gltf_file.h"

namespace kiln {

#ifdef KILN_HAS_DRACO
inline constexpr bool kReadsDraco = true;
#else
inline constexpr bool kReadsDraco = false;
#endif

inline constexpr const char* kDraco = "KHR_draco_mesh_compression";

/// Decompressed data of a primitive.
struct DracoMesh {
  std::vector<std::uint32_t> indices;  ///< Three indices per triangle, each below `points`
  std::size_t points = 0;
  std::vector<GltfNumbers> attributes;  ///< The requested attributes, with one element per point
};

/// An attribute of compressed data.
struct DracoAttribute {
  std::uint64_t id = 0;   ///< Id of the attribute in the extension
  GltfValue accessor;     ///< The accessor that describes the attribute's numbers
  std::size_t width = 0;  ///< Numbers per element, as for GltfFile::numbers()
  std::string name;       ///< The attribute's name, for messages
};

/// Numbers that the header of compressed data states.
struct DracoCounts {
  std::uint64_t triangles = 0;
  std::uint64_t vertices = 0;  ///< Number of vertices before any are split at seams
};

/// Reads the header of a primitive's compressed data, without decompression. All counts are 0 in builds without Draco.
/// \throws Error(input) if the counts exceed the data's size
DracoCounts count_draco(const GltfFile& file, const GltfValue& extension);

/// Decompresses a primitive. Allocations are limited by its size: 512 triangles per byte.
/// \throws Error(input), also in builds without Draco
DracoMesh unpack_draco(const GltfFile& file, const GltfValue& extension,
                       const std::vector<DracoAttribute>& attributes);

}  // namespace kiln
