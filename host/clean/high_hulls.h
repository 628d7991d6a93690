// Removes collision hulls from a high poly.
#pragma once

#include <string>
#include <vector>

#include "kiln/error.h"
#include "kiln/mesh.h"

namespace kiln {

/// True for the name of an object or group that engines never draw. The name of a group may consist of several words.
bool names_hidden_hull(const std::string& name);

/// Removes those objects and groups of a high poly that engines never draw: UCX_, UBX_, USP_, UCP_, -colonly,
/// -convcolonly. Keeps -col and -convcol, which Godot draws. A mesh that consists of hidden hulls alone is not changed.
/// \param warnings  receives the warning "collision-hulls" with the names of the hulls
void drop_hidden_hulls(Mesh& high, std::vector<Warning>& warnings);

}  // namespace kiln
