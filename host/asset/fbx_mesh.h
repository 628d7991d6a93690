// Transforms a mesh of an FBX to world space: by its node, bones, and blend shapes.
#pragma once

#ifdef KILN_HAS_UFBX
#include <vector>

#include "asset/fbx_library.h"
#include "asset/hierarchy.h"
#include "asset/mesh_builder.h"
#include "asset/scene_parts.h"

namespace kiln {

AffineMap fbx_map(const ufbx_matrix& matrix);

/// Transforms vertices and normals of a mesh. Blend shapes are added first; then the skin applies, or the node if there
/// is no skin.
class FbxPose {
 public:
  /// Prepares the pose of a node's mesh. \param to_world  transform from the file's axes and unit
  FbxPose(const ufbx_node& node, const ufbx_mesh& mesh, const AffineMap& to_world);

  bool is_skinned() const { return !poses_.empty(); }
  bool is_morphed() const { return !morphed_.empty(); }
  /// A vertex of the mesh in its own space, with blend shapes added.
  const ufbx_vec3& vertex(std::size_t index) const {
    return morphed_.empty() ? mesh_.vertices.data[index] : morphed_[index];
  }
  MeshBuilder::Position place(std::size_t vertex) const;
  /// A normal of unit length in world space, or zero if that is impossible.
  Vec3 normal(std::size_t vertex, const ufbx_vec3& normal) const;
  /// True if the transform of the vertex mirrors.
  bool mirrors(std::size_t vertex) const;

 private:
  AffineMap map(std::size_t vertex) const;

  const ufbx_mesh& mesh_;
  AffineMap to_world_;
  AffineMap of_node_;
  NormalTransform turn_of_node_;
  // For each vertex, the transform to the file's world; empty if the mesh has no skin
  std::vector<ufbx_matrix> poses_;
  std::vector<ufbx_vec3> morphed_;  // Vertices with blend shapes added; empty if no shape is active
};

/// The file's normals under blend shapes, per corner. Each normal is rotated by the mean rotation of the faces that
/// share it, as in Blender. Empty if no blend shape is active. Time: linear.
std::vector<ufbx_vec3> morphed_normals(const ufbx_mesh& mesh, const FbxPose& pose);

}  // namespace kiln
#endif
