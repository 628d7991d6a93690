// The pose of a glTF mesh at rest: morph targets by their default weights, then the skin by where its joints' nodes
// are (glTF 2.0, 3.7.2.2 and 3.7.3).
//
// A vertex v of a skinned mesh lies at the sum over its joints of w * J * B * v: w its weight, J the joint's transform
// to the world, B the skin's inverse bind matrix of it. The transform of the mesh's own node has no part in that. A
// morph target adds its weight times its offset first.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "asset/gltf_file.h"
#include "asset/hierarchy.h"

namespace kiln {

/// Joints of a skin: from the space of the mesh's vertices to the world.
using GltfJoints = std::vector<AffineMap>;

/// Joints that move a primitive's vertices, of all its sets together.
struct GltfInfluences {
  std::size_t width = 0;  ///< Joints a vertex; 0: it is not skinned
  std::vector<std::uint32_t>
      joints;                   ///< Below the skin's number of them, where the weight is not 0
  std::vector<double> weights;  ///< Sum 1 a vertex, or all 0

  /// The map of a vertex; nothing where no joint moves it.
  std::optional<AffineMap> map_of(const GltfJoints& of, std::size_t vertex) const;
};

/// Translation, rotation (x, y, z, w; of any length but 0) and scale as a map.
AffineMap map_of_parts(const std::array<double, 3>& translation, std::array<double, 4> rotation,
                       const std::array<double, 3>& scale);

/// A node's transform to its parent. \throws Error(input)
AffineMap map_of_node(const GltfValue& node);

/// Transforms of the nodes that are asked for.
class GltfWorlds {
 public:
  /// \param parents  of all nodes, without cycles
  /// \param frame    applied after those of roots, where there is one
  GltfWorlds(const GltfFile& file, std::vector<std::optional<std::size_t>> parents,
             std::optional<AffineMap> frame);

  /// From a node's space to the world.
  const AffineMap& of(std::size_t node);
  /// The joints of a skin.
  const GltfJoints& joints(std::size_t skin);

 private:
  const GltfFile& file_;
  std::vector<std::optional<std::size_t>> parents_;
  std::optional<AffineMap> frame_;
  std::map<std::size_t, AffineMap> worlds_;
  std::map<std::size_t, GltfJoints> joints_;
};

/// Where EXT_mesh_gpu_instancing puts a node's mesh, in the node's space; once as it is without the extension.
std::vector<AffineMap> instances_of(const GltfFile& file, const GltfValue& node);

/// Adds up what `names` of a primitive's sets JOINTS_0, WEIGHTS_0 and so on hold.
/// \param joints, weights  as read, four a vertex, one for each set
/// \param count            of the skin's joints
GltfInfluences influences_of(const GltfValue& attributes, const std::vector<GltfNumbers>& joints,
                             const std::vector<GltfNumbers>& weights, std::size_t count);

}  // namespace kiln
