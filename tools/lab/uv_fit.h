// Whether two meshes are fit for matching by UVs.
#pragma once

#include <optional>
#include <string>

#include "kiln/kiln.h"

namespace kiln::cli {

/// Something that was to be compared but does not do for two meshes.
struct LeftOut {
  std::string name, reason;
};

/// Whether a way to match does for two meshes. By UVs: HIGH must have some, and both layouts must agree
/// and share some place (found by baking a small map). Others always do.
/// \param name  of what is to be compared, for people
/// \param must  throw where it does not
/// \returns nothing where it does
/// \throws Error(input) where it must do, but does not
std::optional<LeftOut> unfit(MatchMethod method, const std::string& name, const Source& source,
                             const Mesh& high, const Mesh& low, const UvOptions& uv, bool must);

}  // namespace kiln::cli
