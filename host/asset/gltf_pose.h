// Computes the rest pose of a glTF mesh: morph targets are added with their default weights, then
// the skin is applied with the node transforms of its joints (glTF 2.0, 3.7.2.2 and 3.7.3). A
// vertex v of a skinned mesh lies at the sum over its joints of w * J * B * v, where w is its
// weight, J the joint's transform to the world, and B the inverse bind matrix of the joint. The
// transform of the mesh's own node is ignored. A morph target first adds its weight times its
// offset.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "asset/gltf_file.h"
#include "asset/hierarchy.h"

namespace kiln {

/// For each joint of a skin, the transform from the space of the mesh's vertices to the world.
using GltfJoints = std::vector<AffineMap>;

/// Joints and weights of a primitive's vertices, from all of its sets.
struct GltfInfluences {
  std::size_t width = 0;              ///< Number of joints per vertex; 0: not skinned
  std::vector<std::uint32_t> joints;  ///< Indices of joints; only valid where the weight is not 0
  std::vector<double> weights;        ///< Weights; their sum per vertex is 1, or all are 0

  /// The transform of a vertex; nullopt if no joint affects the vertex.
  std::optional<AffineMap> map_of(const GltfJoints& of, std::size_t vertex) const;
};

/// The transform with this translation, rotation (a quaternion x, y, z, w of any length above 0)
/// and scale.
AffineMap map_of_parts(const std::array<double, 3>& translation, std::array<double, 4> rotation,
                       const std::array<double, 3>& scale);

/// The transform of a node to its parent.
/// \throws Error(input)
AffineMap map_of_node(const GltfValue& node);

/// The transforms of nodes to the world. Each is computed when it is first needed.
class GltfWorlds {
 public:
  /// \param parents  parent of each node; without cycles
  /// \param frame    transform that is applied after those of the root nodes, if any
  GltfWorlds(const GltfFile& file, std::vector<std::optional<std::size_t>> parents,
             std::optional<AffineMap> frame);

  /// The transform from a node's space to the world.
  const AffineMap& of(std::size_t node);
  /// The transforms of a skin's joints.
  const GltfJoints& joints(std::size_t skin);

 private:
  const GltfFile& file_;
  std::vector<std::optional<std::size_t>> parents_;
  std::optional<AffineMap> frame_;
  std::map<std::size_t, AffineMap> world_transforms_;
  std::map<std::size_t, GltfJoints> joints_;
};

/// The transforms by which EXT_mesh_gpu_instancing places a node's mesh, in the space of the node.
/// Without that extension, only the identity.
std::vector<AffineMap> instances_of(const GltfFile& file, const GltfValue& node);

/// Merges the sets of joints and weights of a primitive: JOINTS_0 and WEIGHTS_0, JOINTS_1 and
/// WEIGHTS_1, and so on.
/// \param joints, weights  the sets as read, with four numbers per vertex
/// \param count            number of joints of the skin
GltfInfluences influences_of(const GltfValue& attributes, const std::vector<GltfNumbers>& joints,
                             const std::vector<GltfNumbers>& weights, std::size_t count);

}  // namespace kiln
