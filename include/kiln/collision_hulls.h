#pragma once

#include <cstdint>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/mesh.h"

namespace KILN_PUBLIC kiln {

/// Separates the collision hulls of game engines from a low poly: objects or groups whose names begin with UCX_, UBX_,
/// USP_ or UCP_ (Unreal), or end in -colonly or -convcolonly (Godot). Names that end in -col or -convcol, which Godot
/// also draws, count as hulls if the mesh has other objects or groups. Names are compared without case, and without a
/// copy's number (".001"). A mesh without hulls is unchanged. Thread safety: may be called from several threads, for
/// different meshes.
/// \param low       changed: loses the hulls, and names and attributes that only they used
/// \param warnings  where to append "collision-hulls", which names them; may be null
/// \returns the hulls, each an object with its name; no triangles if there are none
/// \throws Error(input) if the whole mesh consists of hulls; it is unchanged then
Mesh take_collision_hulls(Mesh& low, std::vector<Warning>* warnings = nullptr);

/// For each triangle 1 if take_collision_hulls() would remove it, else 0.
std::vector<std::uint8_t> collision_hulls(const Mesh& low);

}  // namespace kiln
