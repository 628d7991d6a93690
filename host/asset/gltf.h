// Reads glTF 2.0: meshes, hierarchy and materials.
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

/// Reads a whole .glb or .gltf; parse_mesh() returns only its mesh. External files are read if input.folder is set.
/// Memory is linear in the file and its buffers, except for meshes with several instances. \throws Error(input)
/// \param materials  true: materials are read as well
Asset read_gltf(const MeshInput& input, bool materials);

/// Reads the materials, with unique names and in the file's order, followed by "default" for primitives without one.
/// Missing picture files give a warning "picture-missing", and only the factor is used.
std::vector<Material> read_gltf_materials(const MeshInput& input);
/// Reads the materials of a parsed file. \param uv_set  the set with which the mesh is read
std::vector<Material> read_gltf_materials(const GltfFile& file, std::uint32_t uv_set);

/// An affine map of UVs, with v pointing down as in glTF.
struct UvMap {
  std::array<double, 6> m{1, 0, 0, 0, 1, 0};  ///< The two rows of the map's matrix

  std::array<double, 2> at(double u, double v) const {
    return {m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5]};
  }
  bool operator==(const UvMap&) const = default;
};

/// Returns, per material, the transform (KHR_texture_transform) from integer UVs to its pictures; nullopt if it needs
/// none. Programs that quantise (gltfpack) store UVs as integers, and each picture's transform undoes the scaling:
/// without it a layout would fill 1/256 of a map. Transforms of float UVs place pictures, and do not belong to the
/// layout. If a material's pictures have several such transforms, the one that brings its UVs into the unit square is
/// used; among several of these, the one with the largest result.
/// \param warns  true: report this ("uv-transforms")
std::vector<std::optional<UvMap>> gltf_uv_maps(const GltfFile& file, std::uint32_t uv_set,
                                               bool warns);

/// The UV sets that the file's pictures use, in ascending order.
std::set<std::uint32_t> gltf_uv_sets(const GltfFile& file);

/// Unique names of a file's materials, as in the mesh; the last one is for primitives without a material.
std::vector<std::string> gltf_material_names(const GltfFile& file);

}  // namespace kiln
