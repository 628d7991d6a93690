// The high poly as commands take it: a mesh file, or a height field.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "kiln/asset.h"
#include "kiln/clean.h"
#include "kiln/height_field.h"
#include "kiln/job.h"
#include "kiln/kiln.h"
#include "kiln/normals.h"
#include "options/option_table.h"

namespace kiln {

/// True if something says what a height field is stretched to.
inline bool stretches(const HeightFieldOptions& heights) {
  return heights.height != 1 || heights.width != 0 || heights.no_data || !heights.guess_no_data;
}

/// True if a path names a height field: a PNG, EXR or TIFF, by its ending.
bool is_height_field(const std::string& path);

/// File formats of meshes, for help texts: "PLY, OBJ, ...".
std::string mesh_kinds();
/// File formats of the high poly.
std::string high_poly_kinds();

/// A high poly, and what it was made of where it is a height field.
struct HighPolyInput {
  Mesh mesh;
  std::optional<Image> heights;   ///< NaN where there is none
  Asset beside;                   ///< See MeshFiles::beside
  HeightFieldOptions field = {};  ///< With the extent that the file says, where none was given
  ShadingReport shading;          ///< Of shade()
};

/// Several files are meshes, and joined. \param named, beside  see load_meshes() \param options  of meshes
/// \param keep_hulls  false: collision hulls that engines never draw are left out, with a warning; see drop_hidden_hulls()
/// \throws Error(usage) where a mesh was given a height or an extent, Error(input) as the readers
HighPolyInput load_high(const std::vector<JobInput>& inputs, const HeightFieldOptions& heights,
                        const LoadMeshOptions& options, bool named, std::vector<Warning>& warnings,
                        bool beside = false, bool keep_hulls = false);
HighPolyInput load_high(const std::string& path, const HeightFieldOptions& heights,
                        std::vector<Warning>& warnings, const LoadMeshOptions& options = {});

/// Makes pixels without a height NaN, and says so.
/// \param path  of the file, or a name, for messages
/// \returns the options, with the extent that the file says where none is given
HeightFieldOptions prepare_heights(const std::string& path, Heights& read,
                                   const HeightFieldOptions& options,
                                   std::vector<Warning>& warnings);

/// As a choice of the command has it. \param whole  what CleanHigh::automatic repairs: all, or windings alone
/// \param all_parts  whether no part may be left out for its size
std::optional<CleanOptions> clean_options(CleanHigh choice, bool whole, bool keep_inner,
                                          bool all_parts);
/// Repairs a high poly, and says what was done. \param options  none: nothing
CleanReport clean_high(Mesh& high, const std::optional<CleanOptions>& options,
                       std::vector<Warning>& warnings);

/// Gives HIGH its normals, once it is as clean as it will be: see shade_high(). Height fields have theirs.
void shade(const ShadingOptions& options, HighPolyInput& high, std::vector<Warning>& warnings);
ShadingReport shade(const ShadingOptions& options, Mesh& high, std::vector<Warning>& warnings);
/// A line on the normals of a file that has none; empty where it has.
Message shading_line(const ShadingReport& shading, const ShadingOptions& options);
Json describe(const ShadingReport& shading);

/// Sets right normals that oppose their faces, of HIGH or LOW, with a warning: see agree_normals().
void turn_normals(const std::string& which, Trusted trust, Mesh& mesh,
                  std::vector<Warning>& warnings);

/// True if rays from LOW meet but the backs of parts of HIGH: these face inwards, and no part of LOW does.
/// \returns what is the matter, and the remedy; empty where nothing is
Message why_inside_out(const Mesh& high, const Mesh& low);

/// The degree to which matching by UVs trusts the layouts of a high poly and of a low poly. Those of a height field
/// agree by make; how far the surfaces are apart is what is baked, so its heights are allowed for.
UvOptions uv_options(const HighPolyInput& dense, UvOptions options = {});
/// That of a height field's mesh.
UvOptions uv_options_over(const Mesh& field, UvOptions options = {});

}  // namespace kiln
