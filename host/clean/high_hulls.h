// Collision hulls in a high poly.
#pragma once

#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

/// Leaves out objects and groups of a high poly that engines never draw: UCX_, UBX_, USP_, UCP_, -colonly, -convcolonly.
/// -col and -convcol stay, which Godot draws. A mesh of nothing else stays as it is.
/// \param warnings  where to append "collision-hulls", which names them
void drop_hidden_hulls(Mesh& high, std::vector<Warning>& warnings);

}  // namespace kiln
