// Reads FBX by ufbx.
#pragma once

#include "asset/mesh_reader.h"
#include "kiln/asset.h"

namespace kiln {

/// Reads the meshes of all nodes in world space, one object each; polygons are kept. The result is in metres with Y up.
/// A node's transform is FBX's own product: T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1, with its modes of scale
/// inheritance. The geometric transform applies to the node's own mesh only. Skinned meshes are in the pose of the
/// nodes' properties, not of an animation: v' = sum of w bone_to_world geometry_to_bone v; before that, blend shapes
/// are added by their percentage. Missing normals are computed from smoothing groups or smooth edges. Reads only
/// `input.bytes`; external pictures are searched for by name in the file's folder.
/// \throws Error(input), also in builds without ufbx
Asset read_fbx(const MeshInput& input);

}  // namespace kiln
