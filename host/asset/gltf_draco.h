// KHR_draco_mesh_compression.
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

/// Content of a primitive's packed data.
struct DracoMesh {
  std::vector<std::uint32_t> indices;  ///< Three a triangle, each below `points`
  std::size_t points = 0;
  std::vector<GltfNumbers> attributes;  ///< As asked for; each of so many points
};

/// An attribute of packed data.
struct DracoAttribute {
  std::uint64_t id = 0;   ///< As the extension numbers it
  GltfValue accessor;     ///< Says what its numbers are
  std::size_t width = 0;  ///< As GltfFile::numbers() takes it
  std::string name;       ///< For messages
};

/// What packed data says it holds.
struct DracoCounts {
  std::uint64_t triangles = 0;
  std::uint64_t vertices = 0;  ///< Before seams of attributes split any
};

/// Reads the head of what the extension of a primitive names, and unpacks nothing. Without Draco all are 0.
/// \throws Error(input) where it says that it holds more than its bytes can
DracoCounts count_draco(const GltfFile& file, const GltfValue& extension);

/// Unpacks what the extension of a primitive names. What a file may allocate goes by its bytes: 512 triangles each.
/// \throws Error(input): also where this build is without Draco
DracoMesh unpack_draco(const GltfFile& file, const GltfValue& extension,
                       const std::vector<DracoAttribute>& attributes);

}  // namespace kiln
