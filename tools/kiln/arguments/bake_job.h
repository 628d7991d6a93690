// The options of a bake: the library's, and the command's own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "arguments/command_line.h"
#include "arguments/high_poly_input.h"
#include "arguments/mesh_files.h"
#include "arguments/option_table.h"
#include "arguments/words.h"
#include "kiln/kiln.h"
#include "kiln/normals.h"
#include "kiln/texture_sets.h"
#include "report/report.h"

namespace kiln::cli {

/// --size of one texture set alone: its name and its size in texels.
struct SetSize {
  std::string set;
  std::uint32_t width = 0, height = 0;
};

/// Rows of bake_rows() say what its members are.
struct BakeJob {
  std::set<std::string> given;  ///< Flags, such as "--views", whatever their values
  std::string high, low, out;
  std::string asset;  // the GLB, glTF or OBJ that --out names; `out` is its folder then
  std::vector<std::string> more_high, more_low;  // joined to `high` and `low`

  BakeOptions options;   ///< But for what is read of files: see options_of()
  LoadMeshOptions load;  ///< How polygons become triangles; else see load_options()
  MeshFrameArguments frame;
  SaveImageOptions image = {ImageFormat::png16};
  RayTraversal traversal = RayTraversal::automatic;
  HeightFieldOptions heights;

  bool match_auto = false, cage_auto = false;
  std::string cage_mesh, save_cage, save_match, load_match, match_list;
  std::optional<PartsBy> parts_by;  // none: all of HIGH
  PartNames part_names;             // but for `by` and `list`
  std::string view_weights;         // a file, where likelihood is `list`
  bool reasons = false;
  bool keep_hulls = false;
  bool file_tangents = true, split_at_seams = false;
  std::vector<std::string> occluders;  // files
  std::vector<std::string> own_maps;   // of --maps: NAME=FILE
  std::vector<std::string> variants;   // of --maps: NAME=MAP:OPTION=VALUE...
  std::vector<std::string> transfers, ranges, packs;
  double alpha_test = 0;  // 0: none
  bool layers = false;

  std::uint32_t faces = 0;  // 0: none asked for
  bool keep_parts = false;
  CleanHigh clean = CleanHigh::automatic;
  bool keep_inner = false;
  std::optional<SetsBy> sets;  // none: by what overlaps
  std::vector<SetSize> set_sizes;
  std::string max_error, max_angle, screen, max_outline;
  std::uint32_t lods = 0;  // 0: one low poly
  double lod_growth = 1;   // of errors, a level
  bool lods_share_uvs = false;
  bool unwrap = false;        // whether --unwrap was given
  std::string unwrap_method;  // given, charts, pairs, squares; empty: charts
  TexelDensity density = TexelDensity::area;

  double max_missed_percent = 100;
  bool force = false;
  std::string device, json;
  bool quiet = false;
};

constexpr const char* kAutomatic = "auto";  ///< Of --match, --cage and --views

/// Every option of a bake.
std::span<const OptionRow> bake_rows();

/// Checks for contradictions between several options. \throws Error(usage)
void check(const BakeJob& job);
/// Refuses flags that were given but serve none of the matches or maps asked for. \throws Error(usage)
void check_served(const BakeJob& job);

/// The options as the library takes them, with the files that they name: own maps, likely views.
/// \throws Error(usage), Error(input)
BakeOptions options_of(const BakeJob& job);

/// Every option in force, for the report.
Json describe(const BakeJob& job, const BakeReport& report);

/// All files of either side, the positional one first; none for a LOW that Kiln makes.
std::vector<std::string> high_files(const BakeJob& job);
std::vector<std::string> low_files(const BakeJob& job);
/// True if either side has several files: then a file without names is a part of the file's name.
bool has_more_files(const BakeJob& job);

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
PartNames part_names(const BakeJob& job);

/// "auto", or the match's name.
std::string match_word(const BakeJob& job);
/// True if a match is the one asked for, or one of its fallbacks.
bool matches_by(const BakeJob& job, MatchMethod method);
/// True if --match obeys an option, such as "match.uv"; never for auto.
bool match_obeys(const BakeJob& job, std::string_view option);
/// True if --match or one of its fallbacks obeys it.
bool chain_obeys(const BakeJob& job, std::string_view option);
/// True if a map of --maps obeys an option.
bool maps_obey(const BakeJob& job, std::string_view option);

/// The map that plans measure, which renderers shade by: that of a bake that was told none.
MapKind shading_map();
/// True if --maps has it.
bool bakes_shading_map(const BakeJob& job);

/// The angle that --match auto is to reach, and how far a low poly that Kiln makes may deviate; empty where
/// nothing is said. --max-error is the second one, but beside --match auto alone the first one's older name.
std::string angle_bound(const BakeJob& job);
std::string deviation_bound(const BakeJob& job);

/// True if --max-error names maps, the normal map first of all: "normal=DEGREES", an angle between rendered normals.
bool bounds_maps(const BakeJob& job);
/// True if faces, map size and match are chosen together: no LOW, no --faces, but an error to reach.
bool plans_low_poly(const BakeJob& job);
/// True if Kiln lays LOW out and --sets asks for a square for each of its materials or objects.
bool lays_out_sets(const BakeJob& job);
/// Why a bake has one texture set whatever LOW is; empty: it may have several.
std::string no_sets(const BakeJob& job);
/// Parts an --out that ends in .glb, .gltf or .obj. \throws Error(usage) for what it cannot hold
void take_asset(BakeJob& job);
/// True if the maps go into a glTF or GLB: not beside an OBJ, nor loosely into a folder.
bool writes_gltf(const BakeJob& job);
/// Smooths the ambient occlusion of a file that engines open, where no flag says how it is gathered: a quarter of the
/// rays, smoothed, are nearer to many than all of them on most meshes, in less than half the time.
void smooth_occlusion(BakeJob& job);
/// True if all levels of detail share one layout and its maps.
bool shares_uvs(const BakeJob& job);
/// Repairs of HIGH; none: nothing is repaired.
std::optional<CleanOptions> clean_options(const BakeJob& job);
/// True if the low poly is a plane of Kiln's, under a height field.
bool onto_plane(const BakeJob& job);

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

/// Paths of a map and the levels of its mip-map: with PNG a file a level, FOLDER/NAME.png,
/// FOLDER/NAME.mip01.png and so on; with EXR one file for all.
/// \param mips  how many levels below the first there are
std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options);

}  // namespace kiln::cli
