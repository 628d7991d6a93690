// Scenes that golden_test bakes: meshes, a terrain and volumes made from arithmetic and square roots alone, so
// that they are the same bytes on every machine.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

#include "kiln/image_data.h"
#include "kiln/mesh.h"
#include "kiln/volume.h"

namespace kiln::test {

/// The low poly: a smooth body of six charts, one of them mirrored and one turned, over a floor of one
/// chart. Without normals. One cell of its 4 x 2 layout stays empty.
Mesh golden_low();

/// The high poly for it, with the same layout: waves all over, a pit too deep to reach, a horn that leans
/// over, a hole, and a floor that drops at one side. Without normals.
Mesh golden_high();

/// The low poly's topology around both meshes, nearer in some places than in others.
Mesh golden_cage();

/// Gives each vertex one normal, bent away from the surface's own.
Mesh with_bent_normals(Mesh mesh);

/// Gives each triangle its own normal at all corners: hard edges.
Mesh with_face_normals(Mesh mesh);

/// Some triangles without area, some with a corner that is not finite, some twice, and a vertex that no
/// triangle uses.
Mesh with_flaws(Mesh mesh);

/// Far from the world's origin.
Mesh moved_far(Mesh mesh);

/// Writes an OBJ of bent quads and one pentagon, with UVs and normals of its own.
void write_quads(const std::filesystem::path& path);

/// Heights in [0, 1].
Image golden_terrain(std::uint32_t width, std::uint32_t height);

/// A bumpy ring with a cavity beside a ball, cut off at one side of the volume. Single precision, positive
/// inside, slanted axes.
Volume golden_volume();

/// The same as bytes: 128 at the surface; axes of different lengths.
Volume golden_volume_of_bytes();

}  // namespace kiln::test
