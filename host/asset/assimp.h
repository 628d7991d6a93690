// Reads Collada, 3DS and X by Assimp.
#pragma once

#include "asset/mesh_reader.h"
#include "kiln/asset.h"

namespace kiln {

/// Reads the meshes of all nodes in world space, one object each; polygons are kept. Skinned meshes
/// are in the pose of their joints. If the file states its axes and unit (Collada), the result is
/// in metres with Y up; 3DS and X state no unit. Reads only `input.bytes`; external pictures are
/// searched for by name in the file's folder. A child process with limited time and memory reads
/// the file first, so that a crash of Assimp becomes an error.
/// \throws Error(input), also in builds without Assimp
Asset read_by_assimp(const MeshInput& input);

}  // namespace kiln
