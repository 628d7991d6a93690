// glTF 2.0: meshes, hierarchy and materials.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "asset/gltf_file.h"
#include "kiln/asset.h"

namespace kiln {

/// Reads .glb or .gltf whole; parse_mesh() gives its mesh alone. Files beside it are read where input.folder is
/// given. Memory is linear in the file and its buffers, but for meshes that several nodes place.
/// \throws Error(input)
/// \param materials  whether to read them, too
Asset read_gltf(const MeshInput& input, bool materials);

/// Its materials, each with a name of its own, in the file's order; behind them "default", that of primitives without
/// one. Pictures of their own files must be there: else a warning "picture-missing", and the factor alone.
std::vector<Material> read_gltf_materials(const MeshInput& input);
/// \param uv_set  that the mesh is read with
std::vector<Material> read_gltf_materials(const GltfFile& file, std::uint32_t uv_set);

/// An affine map of UVs whose v runs down, as glTF's.
struct UvMap {
  std::array<double, 6> m{1, 0, 0, 0, 1, 0};  ///< Two rows

  std::array<double, 2> at(double u, double v) const {
    return {m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5]};
  }
  bool operator==(const UvMap&) const = default;
};

/// Per material, where UVs that are stored as integers lie in its pictures (KHR_texture_transform); nothing where they
/// are its pictures' own. Programs that quantise (gltfpack) store UVs in steps, and leave it to each picture's transform
/// to scale them back: without it a layout would fill 1/256 of a map. Transforms of UVs in floats are placements of
/// pictures, and no part of the layout.
///
/// Where a material's pictures have several such transforms, the one counts that brings its UVs into the unit square,
/// of these the one that fills most.
/// \param warns  whether to say so ("uv-transforms")
std::vector<std::optional<UvMap>> gltf_uv_maps(const GltfFile& file, std::uint32_t uv_set,
                                               bool warns);

/// Sets of UVs that any picture of the file's materials lies on, in order.
std::set<std::uint32_t> gltf_uv_sets(const GltfFile& file);

/// Names of a file's materials as the mesh has them, each another; the last is that of primitives without one.
std::vector<std::string> gltf_material_names(const GltfFile& file);

}  // namespace kiln
