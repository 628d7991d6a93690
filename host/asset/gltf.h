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

/// Reads a whole .glb or .gltf; parse_mesh() returns its mesh only. External files are read if input.folder is
/// set. Memory is linear in the file and its buffers, apart from meshes with several instances.
/// \throws Error(input)
/// \param materials  true: read materials, too
Asset read_gltf(const MeshInput& input, bool materials);

/// Its materials with unique names, in the file's order, followed by "default" for primitives without one. Missing
/// picture files give a warning "picture-missing", and the factor alone is used.
std::vector<Material> read_gltf_materials(const MeshInput& input);
/// \param uv_set  the set that the mesh is read with
std::vector<Material> read_gltf_materials(const GltfFile& file, std::uint32_t uv_set);

/// An affine map of UVs whose v points down, as in glTF.
struct UvMap {
  std::array<double, 6> m{1, 0, 0, 0, 1, 0};  ///< Two rows of the affine map

  std::array<double, 2> at(double u, double v) const {
    return {m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5]};
  }
  bool operator==(const UvMap&) const = default;
};

/// Per material, the transform (KHR_texture_transform) from integer UVs to its pictures; none if they need no
/// transform. Programs that quantise (gltfpack) store UVs as integers, and each picture's transform undoes the scaling:
/// without it a layout would fill 1/256 of a map. Transforms of float UVs place pictures, and do not belong to the
/// layout.
///
/// If a material's pictures have several such transforms, the one that brings its UVs into the unit square is used;
/// among several of these, the one with the largest result.
/// \param warns  true: report this ("uv-transforms")
std::vector<std::optional<UvMap>> gltf_uv_maps(const GltfFile& file, std::uint32_t uv_set,
                                               bool warns);

/// UV sets that the file's pictures use, in order.
std::set<std::uint32_t> gltf_uv_sets(const GltfFile& file);

/// Unique names of a file's materials, as in the mesh; the last is that of primitives without one.
std::vector<std::string> gltf_material_names(const GltfFile& file);

}  // namespace kiln
