// The sample scenes. Meshes are closed, about two units tall, centred on the origin, +Y up.
#pragma once

#include <cstdint>

#include "kiln/image_data.h"
#include "kiln/mesh.h"
#include "sweep.h"

namespace kiln::sample {

/// A lidded stone urn carved with leaves, a guilloche, scales, a meander and flutes, chipped, cracked and
/// pitted.
Mesh urn(std::uint64_t faces);
void urn(std::uint64_t faces, MeshPieceSink& sink);

/// A weathered boulder with strata, ridges and cracks.
Mesh rock(std::uint64_t faces);
void rock(std::uint64_t faces, MeshPieceSink& sink);

/// Gives a mesh's vertices colours of weathered stone: strata, stains and lichen.
void paint_stone(Mesh& mesh);

/// Heights of mountains and valleys, 0 to 1. \param size  pixels a side, 2 or more
Image terrain(std::uint32_t size);

}  // namespace kiln::sample
