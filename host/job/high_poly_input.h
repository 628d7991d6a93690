// Reads and prepares the high poly: mesh files or a height field.
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

/// True if an option of height fields is set.
inline bool stretches(const HeightFieldOptions& heights) {
  return heights.height != 1 || heights.width != 0 || heights.no_data || !heights.guess_no_data;
}

/// True if a path's extension is that of a height field: PNG, EXR or TIFF.
bool is_height_field(const std::string& path);

/// File formats of meshes, for help texts: "PLY, OBJ, ...".
std::string mesh_kinds();
/// File formats of the high poly.
std::string high_poly_kinds();

/// A high poly, with its heights if it is a height field.
struct HighPolyInput {
  Mesh mesh;
  std::optional<Image> heights;   ///< Heights; NaN in holes
  Asset beside;                   ///< See MeshFiles::beside
  HeightFieldOptions field = {};  ///< Options, with the file's extent if none was given
  ShadingReport shading;          ///< Result of shade()
};

/// Several files are meshes, and joined. \param named, beside  see load_meshes() \param options  of meshes
/// \param keep_hulls  false removes collision hulls that engines never draw, with a warning; see drop_hidden_hulls()
/// \throws Error(usage) if a mesh has a height or an extent, Error(input) like the readers
HighPolyInput load_high(const std::vector<JobInput>& inputs, const HeightFieldOptions& heights,
                        const LoadMeshOptions& options, bool named, std::vector<Warning>& warnings,
                        bool beside = false, bool keep_hulls = false);
HighPolyInput load_high(const std::string& path, const HeightFieldOptions& heights,
                        std::vector<Warning>& warnings, const LoadMeshOptions& options = {});

/// Sets pixels without a height to NaN, with a warning.
/// \param path  the file's path, or a name, for messages
/// \returns the options, with the file's extent if none is given
HeightFieldOptions prepare_heights(const std::string& path, Heights& read,
                                   const HeightFieldOptions& options,
                                   std::vector<Warning>& warnings);

/// Options of a choice of --clean; nullopt for none. \param whole true if CleanHigh::automatic repairs everything,
/// false for windings alone
/// \param all_parts  true to keep parts of any size
std::optional<CleanOptions> clean_options(CleanHigh choice, bool whole, bool keep_inner,
                                          double fill_holes, bool all_parts);
/// Repairs a high poly, with a warning per repair. \param options nullopt: no repairs
CleanReport clean_high(Mesh& high, const std::optional<CleanOptions>& options,
                       std::vector<Warning>& warnings);

/// Computes HIGH's normals after all repairs: see shade_high(). Height fields have their own.
void shade(const ShadingOptions& options, HighPolyInput& high, std::vector<Warning>& warnings);
ShadingReport shade(const ShadingOptions& options, Mesh& high, std::vector<Warning>& warnings);
/// A summary line about normals that were computed; empty if the file has normals.
Message shading_line(const ShadingReport& shading, const ShadingOptions& options);
Json describe(const ShadingReport& shading);

/// Corrects normals of HIGH or LOW that oppose their faces, with a warning: see agree_normals().
void turn_normals(const std::string& which, Trusted trust, Mesh& mesh,
                  std::vector<Warning>& warnings);

/// Explains if rays from LOW hit only the backs of parts of HIGH, because these face inwards while no part of LOW does.
/// \returns the problem and the remedy; empty if there is none
Message why_inside_out(const Mesh& high, const Mesh& low);

/// Tolerances of matching by UVs. The layout of a height field always agrees, and the distance of its surfaces is the
/// baked height, so the tolerance includes its heights.
UvOptions uv_options(const HighPolyInput& dense, UvOptions options = {});
/// Tolerances for a height field's mesh.
UvOptions uv_options_over(const Mesh& field, UvOptions options = {});

}  // namespace kiln
