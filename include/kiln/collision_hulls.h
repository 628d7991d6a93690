#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Takes the collision hulls of game engines off a low poly: objects or groups named UCX_, UBX_, USP_ or UCP_
/// (Unreal), and those that end in -colonly or -convcolonly (Godot), or in -col or -convcol where the mesh has others
/// beside (Godot draws these as well). Capitals do not count, nor the number of a copy behind (".001").
/// Nothing is changed where there are none. Thread safety: may be called from several threads, for other meshes.
/// \param low       changed: what only the hulls had is left out as well, names among it
/// \param warnings  where to append "collision-hulls", which names them; may be null
/// \returns the hulls, each an object of its name; without triangles where there are none
/// \throws Error(input) where all of the mesh is hulls; it stays as it is then
Mesh take_collision_hulls(Mesh& low, std::vector<Warning>* warnings = nullptr);

/// Per triangle, 1 where take_collision_hulls() takes it, else 0.
std::vector<std::uint8_t> collision_hulls(const Mesh& low);

}  // namespace kiln
