// Queries about a job's options: which match, which maps, which files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "job/describe.h"
#include "job/high_poly_input.h"
#include "job/mesh_files.h"
#include "kiln/bake.h"
#include "kiln/normals.h"
#include "kiln/texture_sets.h"
#include "options/option_table.h"
#include "options/words.h"

namespace kiln {

constexpr const char* kAutomatic = "auto";  ///< The value "auto" of --match, --cage and --views

/// Flags of all options that were set, or whose value differs from the default.
std::set<std::string> options_given(const Job& job);

/// The table of all options of a bake.
std::span<const OptionRow> bake_rows();
/// Finds an option by its flag's name, "max_distance", or its member, "match.max_distance", with or without "bake."
/// before it. Null if there is none. --high and --low have no names of their own.
const OptionRow* find_option(std::string_view name);

/// Completes a job with the values that its options and inputs imply, and records all given options.
/// \throws Error(usage) if options contradict each other
Job resolve_job(const Job& job);
/// Checks a job that resolve_job() returned, or the options of another command, for contradictions.
/// \throws Error(usage)
void check_resolved_job(const Job& job);
/// Rejects options that were given but affect none of the requested matches and maps. \throws Error(usage)
void check_applicable(const Job& job);
/// False if only certain matches or maps use an option, and a job of resolve_job() has none of these.
bool is_applicable(const OptionRow& row, const Job& job);

/// Converts the options to the library's, and reads the files that they name: own maps, weights of views. \throws
/// Error(usage), Error(input)
BakeOptions options_of(const Job& job);

/// All options and their values in effect, for the report.
Json describe(const Job& job, const BakeReport& report);

/// The NAME.glb, NAME.gltf or NAME.obj that --out names; empty if --out is a folder of maps.
std::string asset_file(const Job& job);
/// The folder for all output files.
std::string out_folder(const Job& job);

/// True if the job writes a low poly: it makes one, changes the given one, or writes an asset.
bool writes_low(const Job& job);
/// Stem of the names of the maps, and of the low poly beside them.
std::string low_stem(const Job& job);
/// Stem of the file names of a level of detail.
std::string lod_stem(const Job& job, std::size_t level);
/// The file that the low poly is read from, or made from.
const std::string& low_source(const Job& job);
/// The name of the first input of HIGH or LOW: a file's path, or the name of a mesh in memory. Empty if there is none.
const std::string& high_name(const Job& job);
const std::string& low_name(const Job& job);
/// Sets the first input of HIGH or LOW; further inputs stay.
void set_first_input(std::vector<JobInput>& inputs, const std::string& name);
/// Names of all inputs of HIGH or LOW except the first.
std::vector<std::string> further_input_names(const std::vector<JobInput>& inputs);
/// True if the high poly is a height field, that is, an image.
bool has_heights(const Job& job);
/// Names of all inputs of HIGH or LOW, the positional one first; empty for a LOW that Kiln makes.
std::vector<std::string> high_files(const Job& job);
std::vector<std::string> low_files(const Job& job);
/// True if HIGH or LOW consists of several files. Then a file without groups becomes one group with the file's name.
bool has_more_files(const Job& job);

/// True if the match is a saved one, from a file or from memory.
bool has_saved_match(const Job& job);
/// True if a mesh is the cage, from a file or from memory.
bool has_cage_mesh(const Job& job);

/// The name of the match that a job uses by default.
inline std::string default_match() { return std::string(MatchOptions().method.name); }
/// Names of the matches that work without a direction.
std::vector<std::string> match_names();
/// Names of the matches that need nothing but HIGH's surface. The list begins with `first`.
std::vector<std::string> surface_match_names(const char* first);
/// The first match of the registry that uses an option, such as "match.views.count". There must be one.
MatchMethod first_match(std::string_view option);
/// The name of the match that searches only by distance, so that it finds a point wherever HIGH is near.
MatchMethod distance_match();

/// The names of parts to pair, with the file of --match-list read. \throws Error(input) if that file cannot be read
PartNames part_names(const Job& job);

/// The name of the match, or "auto".
std::string match_name(const Job& job);
/// True if the job requests a match, as its match or as one of the fallbacks.
bool requests_match(const Job& job, MatchMethod method);
/// True if the requested match uses an option, such as "match.uv"; false for auto.
bool match_uses_option(const Job& job, std::string_view option);
/// True if the requested match or one of its fallbacks uses an option.
bool any_match_uses_option(const Job& job, std::string_view option);
/// True if a requested map uses an option.
bool any_map_uses_option(const Job& job, std::string_view option);

/// The maps in Job::bake.maps; if the job has no maps of any kind, the default ones.
std::vector<MapKind> maps_or_default(const Job& job);
/// The map that renderers shade by, and whose error plans measure: the normal map.
MapKind shading_map();
/// True if the job bakes shading_map().
bool bakes_shading_map(const Job& job);

/// The bound in degrees for the error of rendered normals, as text; empty if none was given. It is the item normal= of
/// --max-error; without that, --max-angle. With --match auto, a --max-error without items is an older spelling of
/// --max-angle.
std::string angle_bound(const Job& job);
std::string deviation_bound(const Job& job);

/// True if --max-error bounds maps, as in "normal=DEGREES", instead of the low poly's deviation.
bool bounds_map_errors(const Job& job);
/// True if the job plans faces, map size and match together: LOW and --faces are not given, but a bound for the error
/// is.
bool plans_low_poly(const Job& job);
/// True if Kiln unwraps LOW, and --sets requests a layout for each of its materials or objects.
bool unwraps_sets(const Job& job);
/// The reason why a bake has one texture set for any LOW; empty if it may have several.
std::string explain_single_set(const Job& job);
/// Checks what an asset that --out names can hold, and sets the format of its pictures. \throws Error(usage)
void resolve_asset_output(Job& job);
/// Sets the default maps of an asset: normal and ao. The maps of HIGH's materials are added once they are read.
void set_default_asset_maps(Job& job);
/// True if the output is a glTF or GLB, not an OBJ or a folder of maps.
bool writes_gltf(const Job& job);
/// Makes a glTF bake smoothed ambient occlusion unless an option states how it is gathered. A quarter of the rays,
/// smoothed, has less error on most meshes than all rays without smoothing, in less than half the time.
void enable_occlusion_smoothing(Job& job);
/// True if one GLB or glTF holds all levels of detail.
bool writes_lods_into_one_file(const Job& job);
/// True if all levels of detail share the first one's layout and maps.
bool shares_uvs(const Job& job);
/// Options of HIGH's repairs; nullopt if HIGH is not repaired.
std::optional<CleanOptions> clean_options(const Job& job);
/// True if the low poly is a plane that Kiln makes under a height field.
bool bakes_onto_plane(const Job& job);

bool is_exr(const SaveImageOptions& options);
/// True if the format stores a map and all of its mip levels in one file.
bool stores_mips_in_one_file(const SaveImageOptions& options);
/// True if a file of the format has at most 8 bits per channel.
bool stores_8_bits(const SaveImageOptions& options);
/// What a map's values represent, which decides how a file format encodes them.
TextureUse texture_use(const BakedMap& map, const BakeOptions& options);
/// True if a file of the format holds floats: EXR, and TIFF of floats.
bool holds_floats(const SaveImageOptions& options);
std::string extension(const SaveImageOptions& options);

/// Path of a mip level that has a file of its own: NAME.mip01.png and so on.
std::filesystem::path mip_level_file(const std::filesystem::path& path, std::size_t level);
/// Paths of a map and its mip levels. PNG has one file per level: FOLDER/NAME.png, FOLDER/NAME.mip01.png and so on. EXR
/// has one file for all.
/// \param mips  number of levels below the first
std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options);

}  // namespace kiln
