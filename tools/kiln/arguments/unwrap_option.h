// How a low poly is laid out, as --unwrap says.
#pragma once

#include <cstdint>
#include <string>

#include "kiln/lowpoly.h"

namespace kiln::cli {

/// \param method  "pairs"; all else is charts
/// \param size    the map's smaller side, texels
/// Charts stand 1/256 of the size apart (8 texels of 2,048), at least 2 texels; pairs 2 texels.
UnwrapOptions unwrap_options(const std::string& method, std::uint32_t size);

}  // namespace kiln::cli
