// Collada, 3DS and X through Assimp.
#pragma once

#include "asset/mesh_reader.h"
#include "kiln/asset.h"

namespace kiln {

/// All nodes' meshes in world space, an object each; polygons stay polygons. Meshes with bones stand as their joints
/// do. In metres with Y up where the file says its axes and unit (Collada); 3DS and X say no unit. Reads nothing but `input.bytes`; pictures that are not embedded are named, and looked for
/// in the file's folder.
/// A child process reads the file first, within limits of time and memory: where Assimp crashes, that is an error.
/// \throws Error(input): also where this build is without Assimp
Asset read_by_assimp(const MeshInput& input);

}  // namespace kiln
