// The options of a bake: the library's, and the command's own.
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
#include "kiln/kiln.h"
#include "kiln/normals.h"
#include "kiln/texture_sets.h"
#include "options/option_table.h"
#include "options/words.h"

namespace kiln {

constexpr const char* kAutomatic = "auto";  ///< Of --match, --cage and --views

/// The flags of all options that were given, or that have another value than a job that was told nothing.
std::set<std::string> options_given(const Job& job);

/// Every option of a bake.
std::span<const OptionRow> bake_rows();
/// The option of a flag's name, "max_distance", or of a member, "match.max_distance", with or without "bake." before it;
/// null: there is none. More files, --high and --low, have no name of their own.
const OptionRow* find_option(std::string_view name);

/// The job with what follows from its options and inputs, and with all that were given, whatever their values.
/// \throws Error(usage) where options contradict each other
Job settled(const Job& job);
/// Checks a job of settled(), or options of other commands, for contradictions. \throws Error(usage)
void check_settled(const Job& job);
/// Refuses flags that were given but serve none of the matches or maps asked for. \throws Error(usage)
void check_served(const Job& job);
/// True unless an option is of matches or maps alone, and a job of settled() has none of these.
bool is_served(const OptionRow& row, const Job& job);

/// The options as the library takes them, with the files that they name: own maps, likely views.
/// \throws Error(usage), Error(input)
BakeOptions options_of(const Job& job);

/// Every option in force, for the report.
Json describe(const Job& job, const BakeReport& report);

/// NAME.glb, NAME.gltf or NAME.obj that --out names; empty: it is a folder of maps.
std::string asset_file(const Job& job);
/// The folder that files go to.
std::string out_folder(const Job& job);

/// Stem of the maps' names, and of the low poly that is written beside them.
std::string low_stem(const Job& job);
/// Stem of the files of a level of detail.
std::string lod_stem(const Job& job, std::size_t level);
/// The file that the low poly comes from.
const std::string& low_source(const Job& job);
/// The first of either side: a file's path, or what a mesh in memory is called; empty: there is none.
const std::string& high_name(const Job& job);
const std::string& low_name(const Job& job);
/// Names the first of a side; others stay.
void set_first(std::vector<JobInput>& inputs, const std::string& name);
/// All but the first.
std::vector<std::string> more_names(const std::vector<JobInput>& inputs);
/// True if the high poly is a height field: an image.
bool has_heights(const Job& job);
/// All files of either side, the positional one first; none for a LOW that Kiln makes.
std::vector<std::string> high_files(const Job& job);
std::vector<std::string> low_files(const Job& job);
/// True if either side has several files: then a file without names is a part of the file's name.
bool has_more_files(const Job& job);

/// True if points come from a match that was saved, in a file or in memory.
bool has_saved_match(const Job& job);
/// True if a mesh is the cage: a file's, or one in memory.
bool has_cage_mesh(const Job& job);

/// The match of a bake that was told none.
inline std::string default_match() { return std::string(MatchOptions().method.name); }
/// Matches that need to be told nothing more.
std::vector<std::string> match_names();
/// A word, and the matches that need nothing of the high poly but its surface.
std::vector<std::string> surface_matches(const char* first);
/// The first match that obeys an option, such as "match.views.count". One must.
MatchMethod first_match(std::string_view option);
/// The match that goes by a distance alone, so that it finds a point wherever HIGH is near.
MatchMethod nearest_match();

/// Which parts are to be paired, the list's file read. \throws Error(input) for a list that cannot be read
PartNames part_names(const Job& job);

/// "auto", or the match's name.
std::string match_word(const Job& job);
/// True if a match is the one asked for, or one of its fallbacks.
bool matches_by(const Job& job, MatchMethod method);
/// True if --match obeys an option, such as "match.uv"; never for auto.
bool match_obeys(const Job& job, std::string_view option);
/// True if --match or one of its fallbacks obeys it.
bool chain_obeys(const Job& job, std::string_view option);
/// True if a map of --maps obeys an option.
bool maps_obey(const Job& job, std::string_view option);

/// Job::bake.maps; where it has no maps of any kind, those of a bake that was told none.
std::vector<MapKind> named_maps(const Job& job);
/// The map that plans measure, which renderers shade by: that of a bake that was told none.
MapKind shading_map();
/// True if --maps has it.
bool bakes_shading_map(const Job& job);

/// The angle that --match auto is to reach, and how far a low poly that Kiln makes may deviate; empty where
/// nothing is said. --max-error is the second one, but beside --match auto alone the first one's older name.
std::string angle_bound(const Job& job);
std::string deviation_bound(const Job& job);

/// True if --max-error names maps, the normal map first of all: "normal=DEGREES", an angle between rendered normals.
bool bounds_maps(const Job& job);
/// True if faces, map size and match are chosen together: no LOW, no --faces, but an error to reach.
bool plans_low_poly(const Job& job);
/// True if Kiln lays LOW out and --sets asks for a square for each of its materials or objects.
bool lays_out_sets(const Job& job);
/// Why a bake has one texture set whatever LOW is; empty: it may have several.
std::string no_sets(const Job& job);
/// Of an --out that ends in .glb, .gltf or .obj: checks what it can hold, and sets the format of its pictures.
/// \throws Error(usage)
void settle_asset(Job& job);
/// Sets the maps of an asset without --maps: normal and ao. Those of HIGH's materials are added once it is read.
void start_asset_maps(Job& job);
/// True if the maps go into a glTF or GLB: not beside an OBJ, nor loosely into a folder.
bool writes_gltf(const Job& job);
/// Smooths the ambient occlusion of a file that engines open, where no flag says how it is gathered: a quarter of the
/// rays, smoothed, are nearer to many than all of them on most meshes, in less than half the time.
void smooth_occlusion(Job& job);
/// True if a GLB or glTF holds all levels of detail.
bool joins_lods(const Job& job);
/// True if all levels of detail share one layout and its maps.
bool shares_uvs(const Job& job);
/// Repairs of HIGH; none: nothing is repaired.
std::optional<CleanOptions> clean_options(const Job& job);
/// True if the low poly is a plane of Kiln's, under a height field.
bool onto_plane(const Job& job);

bool is_exr(const SaveImageOptions& options);
/// True if files hold mip-maps, too.
bool holds_mips(const SaveImageOptions& options);
/// True if files hold 8 bits a channel, or blocks of them.
bool holds_bytes(const SaveImageOptions& options);
/// Kind of a map's values, for a file's format.
TextureUse texture_use(const BakedMap& map, const BakeOptions& options);
/// True if values are written as they are: EXR, and TIFF of floats.
bool holds_floats(const SaveImageOptions& options);
std::string extension(const SaveImageOptions& options);

/// Path of a level of a mip-map beside the map's own: NAME.mip01.png and so on.
std::filesystem::path level_file(const std::filesystem::path& path, std::size_t level);
/// Paths of a map and the levels of its mip-map: with PNG a file a level, FOLDER/NAME.png,
/// FOLDER/NAME.mip01.png and so on; with EXR one file for all.
/// \param mips  how many levels below the first there are
std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options);

}  // namespace kiln
