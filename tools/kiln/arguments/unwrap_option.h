// The layout of a low poly, as --unwrap says.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kiln/unwrap.h"

namespace kiln::cli {

/// For every command that has --density. \throws Error(usage) where it was given and no large charts are laid out
void check_density(bool given, const std::string& method);

/// \param method  "pairs" or "squares"; all else is charts
/// \param size    the map's smaller side, texels
/// \param high    whose detail charts get texels by; null: by area
/// Charts stand 1/256 of the size apart (8 texels of 2,048), at least 2 texels; pairs and squares 2 texels.
UnwrapOptions unwrap_options(const std::string& method, std::uint32_t size,
                             const Mesh* high = nullptr);

}  // namespace kiln::cli
