// The sample scenes. Each is a closed mesh about two units tall, centred on the origin, +Y up.
#pragma once

#include <cstdint>

#include "kiln/mesh.h"

namespace kiln::sample {

/// A lidded stone urn carved with leaves, a guilloche, scales, a meander and flutes, chipped, cracked and
/// pitted.
Mesh urn(std::uint64_t faces);

/// A weathered boulder with strata, ridges and cracks.
Mesh rock(std::uint64_t faces);

}  // namespace kiln::sample
