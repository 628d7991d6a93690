// Failures that throw nothing, and needs of a measured mesh.
#pragma once

#include <string>
#include <vector>

#include "kiln/kiln.h"

namespace kiln::cli {

/// A map with nothing in it is no success. \throws Error(input) that says why nothing matched
void check_result(const BakeReport& report, const Mesh& high, const Mesh& low);

/// Why a bake found no point for any texel, a sentence for people.
std::string why_nothing(const BakeReport& report, const Mesh& high, const Mesh& low);

/// For bakes that miss much: a sentence, if the meshes' boxes do not fit as they are; with a space before it.
/// \param moved  whether that one lies beside the other is told, too: LOW may be of a part of HIGH
std::string hint_of_boxes(const Mesh& high, const Mesh& low, bool moved);

/// A hint if boxes fit only after swapping axes or scaling. \param names  of both, for the message
void warn_of_boxes(const std::string& names, const Mesh& high, const Mesh& low,
                   std::vector<Warning>& warnings);

/// \param otherwise  what else helps, such as ", or leave LOW out" \throws Error(input) where it has no UVs
void check_has_uvs(const Mesh& low, const std::string& path, const std::string& otherwise);

/// Reads a low poly whose map is to be measured.
/// \param otherwise  ends the message: ", or ..."
/// \throws Error(input) where it has no UVs
Mesh load_low(const std::string& path, const std::string& otherwise, std::vector<Warning>& warnings,
              const LoadMeshOptions& options = {});

}  // namespace kiln::cli
