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
/// \param materials  true: materials are read, too
Asset read_gltf(const MeshInput& input, bool materials);

/// Reads the materials in the order of the file, with unique names, followed by "default" for
/// primitives without a material. If a picture is missing, a warning "picture-missing" says so, and
/// only the factor is used.
std::vector<Material> read_gltf_materials(const MeshInput& input);
/// Reads the materials of a parsed file.
/// \param uv_set  the set with which the mesh is read
std::vector<Material> read_gltf_materials(const GltfFile& file, std::uint32_t uv_set);

/// An affine map of UVs, with v pointing down as in glTF.
struct UvMap {
  std::array<double, 6> m{1, 0, 0, 0, 1, 0};  ///< The two rows of the map's matrix

  std::array<double, 2> at(double u, double v) const {
    return {m[0] * u + m[1] * v + m[2], m[3] * u + m[4] * v + m[5]};
  }
  bool operator==(const UvMap&) const = default;
};

/// For each material, the transform (KHR_texture_transform) by which the UVs of the mesh become
/// those of its pictures; nullopt if none is needed. It is only needed if UVs are integers:
/// programs that quantise (gltfpack) store them so, and the transform of each picture undoes the
/// scaling. Without it, the layout would fill 1/256 of a map. Transforms of float UVs place a
/// picture, and are no part of the layout. If the pictures of a material have several such
/// transforms, the one is used that moves the UVs into the unit square; if several do, the one that
/// makes the layout largest.
/// \param warns  true: adds a warning "uv-transforms" in this case
std::vector<std::optional<UvMap>> gltf_uv_maps(const GltfFile& file, std::uint32_t uv_set,
                                               bool warns);

/// UV sets that the file's pictures use, in ascending order.
std::set<std::uint32_t> gltf_uv_sets(const GltfFile& file);

/// Unique names of the materials, as in the mesh; the last name is for primitives without a
/// material.
std::vector<std::string> gltf_material_names(const GltfFile& file);

}  // namespace kiln
