// Transforms a mesh of an FBX to world space: by its node, its bones and its blend shapes.
#pragma once

#ifdef KILN_HAS_UFBX
#include <vector>

#include "asset/fbx_library.h"
#include "asset/hierarchy.h"
#include "asset/mesh_builder.h"
#include "asset/scene_parts.h"

namespace kiln {

AffineMap fbx_map(const ufbx_matrix& matrix);

/// Transforms vertices and normals of a mesh: first blend shapes are added, then the skin is
/// applied, or the node's transform if there is no skin.
class FbxPose {
 public:
  /// \param to_world  transform from the file's axes and unit to those of Mesh
  FbxPose(const ufbx_node& node, const ufbx_mesh& mesh, const AffineMap& to_world);

  bool is_skinned() const { return !poses_.empty(); }
  bool is_morphed() const { return !morphed_.empty(); }
  /// A vertex in the mesh's own space, after blend shapes were added.
  const ufbx_vec3& vertex(std::size_t index) const {
    return morphed_.empty() ? mesh_.vertices.data[index] : morphed_[index];
  }
  MeshBuilder::Position world_position(std::size_t vertex) const;
  /// A normal in world space, of unit length, or zero if it cannot be normalized.
  Vec3 normal(std::size_t vertex, const ufbx_vec3& normal) const;
  /// True if the vertex's transform mirrors.
  bool mirrors(std::size_t vertex) const;

 private:
  AffineMap map(std::size_t vertex) const;

  const ufbx_mesh& mesh_;
  AffineMap to_world_;
  AffineMap of_node_;
  NormalTransform normal_transform_of_node_;
  // For each vertex, the transform to the file's world space; empty if the mesh has no skin
  std::vector<ufbx_matrix> poses_;
  // Vertices after blend shapes were added; empty if no shape is active
  std::vector<ufbx_vec3> morphed_;
};

/// The file's normals at the corners after blend shapes were added. Each normal is rotated by the
/// mean rotation of the faces that share it, as in Blender. Empty if no blend shape is active.
/// Linear time.
std::vector<ufbx_vec3> morphed_normals(const ufbx_mesh& mesh, const FbxPose& pose);

}  // namespace kiln
#endif
