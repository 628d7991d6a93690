// Collision hulls within a high poly.
#pragma once

#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

/// Removes objects and groups of a high poly that engines never draw: UCX_, UBX_, USP_, UCP_, -colonly, -convcolonly.
/// Keeps -col and -convcol, which Godot draws. A mesh that consists of hidden hulls alone is not changed.
/// \param warnings  receives "collision-hulls" with their names
void drop_hidden_hulls(Mesh& high, std::vector<Warning>& warnings);

}  // namespace kiln
