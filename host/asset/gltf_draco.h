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
  /// The attributes that were requested, with one element per point
  std::vector<GltfNumbers> attributes;
};

/// An attribute of compressed data.
struct DracoAttribute {
  std::uint64_t id = 0;   ///< Id of the attribute in the extension
  GltfValue accessor;     ///< The accessor that describes the type of the attribute's numbers
  std::size_t width = 0;  ///< Number of components per element, as for GltfFile::numbers()
  std::string name;       ///< Name of the attribute, for messages
};

/// The counts in the header of compressed data.
struct DracoCounts {
  std::uint64_t triangles = 0;
  std::uint64_t vertices = 0;  ///< Number of vertices before some are split at seams
};

/// Reads the header of a primitive's compressed data, without decompressing it. In builds without
/// Draco all counts are 0.
/// \throws Error(input) if the data is too small for the counts
DracoCounts count_draco(const GltfFile& file, const GltfValue& extension);

/// Decompresses a primitive. Its size limits the memory that is allocated: 512 triangles per byte.
/// \throws Error(input), also in builds without Draco
DracoMesh unpack_draco(const GltfFile& file, const GltfValue& extension,
                       const std::vector<DracoAttribute>& attributes);

}  // namespace kiln
