// FBX through ufbx.
#pragma once

#include "asset/mesh_reader.h"
#include "kiln/asset.h"

namespace kiln {

/// All nodes' meshes in world space, an object each; polygons stay polygons. In metres with Y up.
///
/// A node's transform is FBX's own product: T Roff Rp Rpre R Rpost^-1 Rp^-1 Soff Sp S Sp^-1, with its ways to inherit
/// a scale. The geometric transform moves the node's own mesh alone. Meshes with bones stand as these do by
/// the properties of the nodes, not by an animation: v' = sum of w bone_to_world geometry_to_bone v; before
/// that, blend shapes are added by their percentage. Without normals, smoothing groups or smooth edges give them.
/// Reads nothing but `input.bytes`; pictures that are not embedded are named, and looked for in the file's folder.
/// \throws Error(input): also where this build is without ufbx
Asset read_fbx(const MeshInput& input);

}  // namespace kiln
