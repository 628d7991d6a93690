#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "kiln/export.h"
#include "kiln/material.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// A node of a file's hierarchy (glTF, FBX).
struct AssetNode {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  std::string name;              ///< As the file has it; need not be unique
  std::uint32_t parent = kNone;  ///< Index into Asset::nodes, below the node's own; kNone: a root
  std::array<double, 16> transform{1, 0, 0, 0, 0, 1, 0, 0,
                                   0, 0, 1, 0, 0, 0, 0, 1};  ///< To the parent, column-major
  std::string extras;  ///< JSON of glTF's `extras`; empty: none
};

/// A mesh with its materials and the hierarchy it came from: what a glTF or FBX holds. The mesh has all nodes'
/// instances in world space, an object each (Mesh::objects) and its materials by name (Mesh::materials).
struct Asset {
  Mesh mesh;                        ///< In world space
  std::vector<Material> materials;  ///< One for each of Mesh::material_names, in order
  std::vector<AssetNode> nodes;     ///< Parents before children; empty: a format without hierarchy
  std::vector<std::uint32_t>
      object_nodes;    ///< Per object of the mesh, index into nodes; empty with `nodes`
  std::string extras;  ///< JSON of glTF's `asset.extras`; empty: none
  /// Metres a unit: 1 in glTF, as the file says in FBX; 0: the format does not say.
  double metres = 0;
};

}  // namespace kiln
