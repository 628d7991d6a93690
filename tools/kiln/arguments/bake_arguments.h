// The bake command's options, as written and as the library takes them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "arguments/command_line.h"
#include "arguments/high_poly_input.h"
#include "kiln/kiln.h"
#include "kiln/texture_sets.h"
#include "report/report.h"

namespace kiln::cli {

/// As BakeOptions has them.
std::vector<std::string> default_maps();
std::string default_match();

struct BakeArguments {
  std::set<std::string> given;  ///< Flags, such as "--views", whatever their values
  std::string high, low, out;
  std::string asset;  // the GLB, glTF or OBJ that --out names; `out` is its folder then
  std::vector<std::string> more_high, more_low;  // joined to `high` and `low`
  std::string triangulate = "auto";
  std::string tangents = "file";
  bool split_at_seams = false;
  std::string size = "2048";
  std::vector<std::string> sizes;  // as given: `size`, and NAME=SIZE of texture sets
  std::string sets = "auto";       // or as SetsBy
  std::vector<std::string> maps = default_maps();
  std::string match = default_match();
  std::string max_distance;
  std::string curvature_radius;
  std::vector<std::string> ranges;
  std::string views;
  std::vector<std::string> view;
  std::uint32_t view_size = 0;
  std::string view_criterion = "angle";
  bool no_view_refine = false;
  std::string visibility_at = "texel";
  std::string visibility_test = "auto";
  std::uint32_t directions = 512;
  std::uint32_t visibility_size = 256;
  std::uint32_t visibility_smooth = 4;
  std::uint32_t visibility_clusters = 1;
  double visibility_deviation = 0.8;
  std::string view_weight = "all";
  std::vector<std::string> fallback = {"low"};
  std::uint32_t fallback_blend = 0;
  std::string cage, cage_mesh, save_cage;
  std::string ray = "outermost";
  std::string direction = "auto";
  std::string edge_width;
  std::uint32_t recall = 8192;
  bool reasons = false;
  std::string match_by = "all", match_list;
  std::string uv_copies = "plain";
  std::vector<std::string> low_names = PartNames().low, high_names = PartNames().high;
  bool two_sided = false;
  bool force_uv = false;
  HeightArguments heights;
  std::string traversal = "auto";
  std::string space = "tangent";
  std::string bitangent = "pixel";
  bool flip_y = false;
  bool two_component = false;
  std::string format = "png16";
  bool raw = false;
  bool dither = false;
  std::uint32_t samples = 1;
  std::string gutter = "16";
  bool mips = false;
  std::string ao_by = "rays";
  std::uint32_t ao_views = OcclusionOptions{}.views;
  std::uint32_t ao_rays = 64;
  std::string ao_distance;
  std::string ao_falloff = "none";
  bool ao_ignore_back_faces = false;
  std::vector<std::string> ao_occluders = {"high"};
  double ao_error = 0;  ///< 0: none asked for
  std::string part_occlusion = "all";
  std::vector<std::string> transfers;
  std::string id_by = "part";
  std::string origin;
  std::string light = "0,1,0";
  double light_angle = 0;
  double alpha_test = 0;
  std::vector<std::string> own_maps;
  std::vector<std::string> packs;
  bool layers = false;
  bool report_error = false;
  std::uint32_t faces = 0;
  bool keep_parts = false;
  std::string max_error;
  std::string max_angle;
  std::string screen;
  std::string max_outline;
  std::uint32_t lods = 0;        // 0: one low poly
  double lod_growth = 1;         // of errors, a level
  std::string lod_uvs = "own";   // own, shared
  bool unwrap = false;           // whether --unwrap was given
  std::string unwrap_method;     // charts, pairs; empty: charts
  std::string density = "area";  // area, detail
  std::string save_match, load_match;
  double max_missed_percent = 100;
  bool force = false;
  std::string device, json;
  bool quiet = false;
};

void add_bake_options(Command& command, BakeArguments& arguments);

/// What one option's own check cannot see: contradictions between several. \throws Error(usage)
void check(const BakeArguments& arguments);

BakeOptions bake_options(const BakeArguments& arguments);
SaveImageOptions image_options(const BakeArguments& arguments);
RayTraversal traversal(const BakeArguments& arguments);

/// All files of either side, the positional one first; none for a LOW that Kiln makes.
std::vector<std::string> high_files(const BakeArguments& arguments);
std::vector<std::string> low_files(const BakeArguments& arguments);
/// True if either side has several files: then a file without names is a part of the file's name.
bool has_more_files(const BakeArguments& arguments);

/// Values as they are written on the command line.
std::string map_name(MapKind kind);
std::string match_name(MatchMethod method);
MatchMethod match_method(const std::string& name);
/// Those that need to be told nothing more.
std::vector<std::string> match_names();
/// Those of --ao-occluders that are neither `high` nor `low`.
std::vector<std::string> occluder_files(const BakeArguments& a);
/// How all meshes of a bake are read: --triangulate.
LoadMeshOptions load_options(const BakeArguments& a);
/// As --fallback takes it.
std::string chain_name(const std::vector<MatchMethod>& fallback);
std::string criterion_name(ViewCriterion criterion);

/// Which parts are to be paired, the list's file read. \throws Error(input) for a list that cannot be read
PartNames part_names(const BakeArguments& arguments);

/// True if directions of visibility are asked for.
bool by_visibility(const BakeArguments& arguments);

/// The angle that --match auto is to reach, and how far a low poly that Kiln makes may deviate; empty where
/// nothing is said. --max-error is the second one, but beside --match auto alone the first one's older name.
std::string angle_bound(const BakeArguments& arguments);
std::string deviation_bound(const BakeArguments& arguments);

/// Whether --max-error names maps, the normal map first of all: "normal=DEGREES", an angle between rendered normals.
bool bounds_maps(const BakeArguments& arguments);
/// True if faces, map size and match are chosen together: no LOW, no --faces, but an error to reach.
bool plans_light(const BakeArguments& arguments);

/// Of --size, what is for one texture set alone: its name and its size in texels.
struct SetSize {
  std::string set;
  std::uint32_t width = 0, height = 0;
};
/// Why a bake has one set whatever LOW is; empty: it may have several.
std::string no_sets(const BakeArguments& arguments);
/// Parts an --out that ends in .glb, .gltf or .obj. \throws Error(usage) for what it cannot hold
void take_asset(BakeArguments& arguments);
/// True if the maps go into a glTF or GLB: not beside an OBJ, nor loosely into a folder.
bool writes_gltf(const BakeArguments& arguments);
/// Makes `size` the one of `sizes` that names no set. \throws Error(usage) for several
void take_sizes(BakeArguments& arguments);
/// \throws Error(usage) for a size that is none, or of a set twice
std::vector<SetSize> set_sizes(const BakeArguments& arguments);

/// True if all levels of detail share one layout and its maps.
bool shares_uvs(const BakeArguments& arguments);

/// True if the low poly is a plane of Kiln's, under a height field.
bool onto_plane(const BakeArguments& arguments);

bool is_exr(const SaveImageOptions& options);
/// True if values are written as they are: EXR, and TIFF of floats.
bool holds_floats(const SaveImageOptions& options);
std::string extension(const SaveImageOptions& options);

/// Where a map and the levels of its mip-map go: with PNG a file a level, FOLDER/NAME.png,
/// FOLDER/NAME.mip01.png and so on; with EXR one file for all.
/// \param mips  how many levels below the first there are
std::vector<std::filesystem::path> map_files(const std::filesystem::path& folder,
                                             const std::string& name, std::size_t mips,
                                             const SaveImageOptions& options);

/// Every option in force, for the report.
Json describe(const BakeArguments& arguments, const BakeReport& report);

}  // namespace kiln::cli
