// Reads and prepares the high poly: mesh files or a height field.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/clean.h"
#include "kiln/height_field.h"
#include "kiln/job.h"
#include "kiln/normals.h"
#include "options/option_table.h"

namespace kiln {

/// True if an option that only height fields use is set.
inline bool has_height_field_options(const HeightFieldOptions& heights) {
  return heights.height != 1 || heights.width != 0 || heights.no_data || !heights.guess_no_data;
}

/// True if a path's extension is that of a height field: PNG, EXR or TIFF.
bool is_height_field(const std::string& path);

/// File formats of meshes, as a list for help texts: "PLY, OBJ, ...".
std::string mesh_format_list();
/// File formats of the high poly, as a list for help texts.
std::string high_poly_formats();

/// A high poly, with its heights if it is a height field.
struct HighPolyInput {
  Mesh mesh;
  /// The heights of a height field, NaN in holes; nullopt for a mesh
  std::optional<Image> heights;
  Asset
      nodes_and_materials;  ///< Nodes and materials of the files; see MeshFiles::nodes_and_materials
  /// Options of the height field, with the file's extent if none was given
  HeightFieldOptions field = {};
  ShadingReport shading;  ///< How the normals were computed: the result of shade()
};

/// Reads the high poly. Several files must be meshes, and are joined.
/// \param named, with_materials  see load_meshes()
/// \param options  of meshes
/// \param keep_hulls  false removes collision hulls that engines never draw, with a warning; see drop_hidden_hulls()
/// \throws Error(usage) if a mesh has options of height fields, Error(input) like the readers
HighPolyInput load_high(const std::vector<JobInput>& inputs, const HeightFieldOptions& heights,
                        const LoadMeshOptions& options, bool named, std::vector<Warning>& warnings,
                        bool with_materials = false, bool keep_hulls = false);
HighPolyInput load_high(const std::string& path, const HeightFieldOptions& heights,
                        std::vector<Warning>& warnings, const LoadMeshOptions& options = {});

/// Sets pixels without a height to NaN, with a warning.
/// \param path  the file's path, or a name, for messages
/// \returns the options, with the file's extent if none is given
HeightFieldOptions prepare_heights(const std::string& path, Heights& read,
                                   const HeightFieldOptions& options,
                                   std::vector<Warning>& warnings);

/// Options of the repairs that --clean chooses; nullopt if it chooses none.
/// \param repair_all  true if CleanHigh::automatic repairs everything, false for windings alone
/// \param all_parts  true to keep parts of any size
std::optional<CleanOptions> clean_options(CleanHigh choice, bool repair_all, bool keep_inner,
                                          double fill_holes, bool all_parts);
/// Repairs a high poly, and warns of each kind of repair. \param options  nullopt: nothing is repaired
CleanReport clean_high(Mesh& high, const std::optional<CleanOptions>& options,
                       std::vector<Warning>& warnings);

/// Computes HIGH's normals after all repairs, by shade_high(). Height fields keep their own.
void shade(const ShadingOptions& options, HighPolyInput& high, std::vector<Warning>& warnings);
ShadingReport shade(const ShadingOptions& options, Mesh& high, std::vector<Warning>& warnings);
/// A summary line about computed normals; empty if the file has normals.
Message shading_line(const ShadingReport& shading, const ShadingOptions& options);
Json describe(const ShadingReport& shading);

/// Corrects normals of HIGH or LOW that oppose their faces, with a warning; see agree_normals().
/// \param which  "HIGH" or "LOW", for messages
void correct_normals(const std::string& which, Trusted trust, Mesh& mesh,
                     std::vector<Warning>& warnings);

/// Explains that rays from LOW hit only backs of faces, because parts of HIGH face inwards and no part of LOW does.
/// \returns the problem and the remedy; empty if HIGH has no such part
Message explain_inside_out(const Mesh& high, const Mesh& low);

/// Tolerances of matching by UVs. A height field's layout always fits, but its surfaces are as far apart as the baked
/// heights, so the heights are added to the tolerances.
UvOptions uv_options(const HighPolyInput& high, UvOptions options = {});
/// Variant of uv_options() for a height field that is given as a mesh.
UvOptions height_field_uv_options(const Mesh& field, UvOptions options = {});

}  // namespace kiln
