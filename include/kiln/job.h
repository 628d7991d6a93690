/// \file
/// One call for a whole bake: the equivalent of `kiln bake`. A Job describes the inputs, the meshes to make,
/// the maps to bake and the files to write; run() executes it.
///
///     kiln::Job job{.high = {"statue.glb"}, .low = kiln::MakeLow{.faces = 5000}, .out = "game.glb"};
///     const kiln::JobResult result = kiln::run(kiln::Device::open(), job);
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/asset.h"
#include "kiln/bake.h"
#include "kiln/device.h"
#include "kiln/export.h"
#include "kiln/height_field.h"
#include "kiln/image_format.h"
#include "kiln/match.h"
#include "kiln/material.h"
#include "kiln/mesh.h"
#include "kiln/mesh_view.h"
#include "kiln/normals.h"
#include "kiln/progress.h"
#include "kiln/simplify.h"
#include "kiln/source.h"
#include "kiln/texture.h"
#include "kiln/texture_sets.h"
#include "kiln/types.h"
#include "kiln/unwrap.h"

namespace KILN_PUBLIC kiln {

/// A mesh as the input of a job: a file, or a mesh in memory.
struct JobInput {
  /// A file of a mesh, or, as the high poly, of an image of heights (PNG, EXR, TIFF).
  JobInput(std::string path) : name(std::move(path)) {}
  /// A file of a mesh or of heights.
  JobInput(const char* path) : name(path) {}
  /// A file of a mesh or of heights.
  JobInput(const std::filesystem::path& path) : name(path.string()) {}
  /// A mesh in memory with its materials and hierarchy. \param called  its name in messages and file
  /// names
  JobInput(Asset given, std::string called = "mesh")
      : name(std::move(called)), asset(std::make_shared<const Asset>(std::move(given))) {}
  /// A mesh in memory.
  JobInput(Mesh mesh, std::string called = "mesh")
      : JobInput(Asset{std::move(mesh), {}, {}, {}, {}, {}, {}}, std::move(called)) {}
  /// A mesh in the caller's memory, which is copied.
  JobInput(const MeshView& view) : JobInput(to_mesh(view), std::string(view.name)) {}

  std::string name = {};                    ///< Path of the file; else the mesh's name
  std::shared_ptr<const Asset> asset = {};  ///< The mesh in memory; null: the file is read
  /// For a low poly that simplify() made of the high poly: its report, from which the search distance is derived.
  /// Null: unknown.
  std::shared_ptr<const SimplifyReport> simplified = {};
};

/// How Kiln makes the low poly: with a number of faces; with a bound of its error; or planned together
/// with its maps.
struct MakeLow {
  std::uint32_t faces = 0;  ///< Target number of triangles; 0: not given
  bool keep_parts = false;  ///< Keep all parts, including very small ones
  /// "0.2%": largest deviation of the surface, as a share of the diagonal. Or bounds of rendered errors,
  /// "normal=3deg,ao=2/255", by which plan_low_poly() chooses faces, map sizes and match together. Empty: none.
  std::string max_error = {};
  std::string max_angle = {};    ///< Bound of the rendered normals alone, degrees
  std::string screen = {};       ///< "600px": the largest size on screen
  std::string max_outline = {};  ///< "2%": largest share of silhouettes that may differ
  std::uint32_t lods = 0;        ///< Levels of detail, 2 to 8; 0: one low poly
  double lod_growth = 1;         ///< Factor by which the error bound grows from level to level
  bool lods_share_uvs = false;   ///< All levels share the first level's layout and maps
  /// A GLB or glTF holds all levels, by the extension MSFT_lod; else each level is a file of its own
  bool lods_in_one_file = false;
};

/// The low poly of a job: given, or made from the high poly.
struct JobLow {
  JobLow() = default;  ///< Made by Kiln; for a height field: a plane under it
  /// Made by Kiln with these settings.
  JobLow(MakeLow how) : make(std::move(how)) {}
  /// Given as a file or in memory.
  JobLow(JobInput input) : given{std::move(input)} {}
  /// Given as a file.
  JobLow(const char* path) : given{path} {}
  /// Given as a file.
  JobLow(std::string path) : given{std::move(path)} {}
  /// Given as a file.
  JobLow(const std::filesystem::path& path) : given{path} {}
  /// Given in memory.
  JobLow(Mesh mesh) : given{JobInput(std::move(mesh), "low")} {}
  /// Several inputs, which are joined.
  JobLow(std::initializer_list<JobInput> inputs) : given(inputs) {}

  /// Inputs, joined if there are several; empty: Kiln makes the low poly
  std::vector<JobInput> given = {};
  MakeLow make = {};  ///< Settings if `given` is empty
};

/// Repairs of the high poly before all other steps: see clean_mesh().
enum class CleanHigh {
  automatic,  ///< All repairs if Kiln makes the low poly with new UVs, else windings alone
  none,
  all,
};

/// Size of the maps of one texture set, texels.
struct SetSize {
  std::string set = {};      ///< Name of the texture set
  std::uint32_t width = 0;   ///< Width, texels
  std::uint32_t height = 0;  ///< Height, texels
};

/// Conventions of mesh files that do not state them. Values as on the command line: VALUE, high=VALUE or low=VALUE.
struct MeshFrameArguments {
  std::vector<std::string> up = {};    ///< Up axis: x, y, z, -x, -y, -z
  std::vector<std::string> unit = {};  ///< Unit: mm, cm, m, in, ft, or metres as a number
  std::vector<std::string> uv_set =
      {};                       ///< UV set of files with several: a number from 0 on, or a name
  bool allow_outside = false;   ///< Files referenced by an input may lie outside its folder
  ShadingOptions shading = {};  ///< Normals of the high poly

  /// True if any convention is set.
  bool given() const { return !up.empty() || !unit.empty() || !uv_set.empty() || allow_outside; }
};

/// All settings of a bake. Every member is an option of the option table (kiln/options.h), which also converts it from
/// and to text and JSON.
struct Job {
  std::vector<JobInput> high = {};  ///< The high poly; several inputs are joined
  JobLow low = {};                  ///< The low poly: given, or how it is made
  /// A folder for the maps, or NAME.glb, NAME.gltf or NAME.obj for the low poly and its maps in one
  /// asset.
  std::string out = {};
  bool in_memory = false;  ///< Write no files: JobResult holds their content

  /// Sizes, match, maps, occlusion and encoding. If no map of any kind is requested, a folder gets a normal map, and an
  /// asset gets the maps that the high poly's materials have. `match.cage_mesh`, `match.saved` and
  /// `occlusion.by_others` may point to objects in memory, in addition to files named by other members; these must
  /// outlive run(), and to_json() refuses them.
  BakeOptions bake = {.maps = {}};
  LoadMeshOptions load = {};      ///< Triangulation of polygons
  MeshFrameArguments frame = {};  ///< Axes, units and normals of files that do not state them
  /// Format of maps; webp also applies to a GLB's pictures
  SaveImageOptions image = {ImageFormat::png16};
  EncodeMapsOptions pictures = {};  ///< Encoding of pictures in a GLB or glTF
  MeshCompression mesh_compression = MeshCompression::none;  ///< Compression of geometry in a GLB
  /// Largest size of a GLB, bytes; 0: unbounded. The sizes, up to that of `bake`, and encodings of its pictures are chosen
  /// for the least rendered error that fits. A low poly that is made without a number of faces or a bound on its shape is
  /// planned with them.
  std::uint64_t max_bytes = 0;
  RayTraversal traversal = RayTraversal::automatic;  ///< See Source
  HeightFieldOptions heights = {};                   ///< If the high poly is an image of heights

  bool match_auto = false;     ///< Choose the match and the map's size by error: see bake_planned()
  bool cage_auto = false;      ///< Find a cage by find_cage()
  std::string cage_mesh = {};  ///< File of a cage for the low poly
  std::string save_cage = {};  ///< File to write the found cage to
  std::string save_match = {};  ///< EXR to write the match to
  /// File (.kilnsrc) to write the high poly to, as it was read, with its search structure: `high` of later jobs
  std::string save_source = {};
  std::string load_match = {};  ///< EXR of a match to bake by
  std::string match_list = {};  ///< File of pairs for PartsBy::list: lines LOW = HIGH, HIGH
  /// Pairing of parts; none: samples match all of the high poly
  std::optional<PartsBy> parts_by = {};
  /// Patterns of names; `by` and `list` are set by the members above
  PartNames part_names = {};
  std::string view_weights = {};  ///< File for ViewLikelihood::list: lines X Y Z WEIGHT
  bool reasons = false;           ///< Also write an image of why samples were missed
  bool keep_hulls = false;        ///< Bake collision hulls of the low poly, too
  /// Use tangents of the low poly's file; else MikkTSpace's
  bool file_tangents = true;
  /// Make UV seams hard edges where that reduces the error
  bool split_at_seams = false;
  /// Files of meshes that occlude in the maps ao, bent_normal and shadow
  std::vector<std::string> occluders = {};
  std::vector<std::string> own_maps = {};   ///< NAME=FILE.cl: maps of the caller's own, in OpenCL C
  std::vector<std::string> variants = {};   ///< NAME=MAP:OPTION=VALUE...
  std::vector<std::string> transfers = {};  ///< FILE[:NAME][:KIND], or mtl:SLOT
  std::vector<std::string> ranges = {};     ///< MAP=LOW,HIGH
  std::vector<std::string> packs = {};      ///< NAME=MAP.CHANNEL,...
  double alpha_test = 0;  ///< Opacity threshold below which the high poly is cut away; 0: off
  NormalTextureFormat high_normal_map =
      NormalTextureFormat::automatic;  ///< Channels of the high poly's normal maps
  bool layers = false;                 ///< Write all maps as layers of one EXR

  CleanHigh clean = CleanHigh::automatic;     ///< Repairs of the high poly
  bool keep_inner = false;                    ///< Keep inner parts of the high poly
  double fill_holes = 0;                      ///< CleanOptions::fill_holes for the high poly
  std::optional<SetsBy> sets = {};            ///< Texture sets; none: chosen by overlaps of UVs
  std::vector<SetSize> set_sizes = {};        ///< Map sizes of single texture sets
  bool unwrap = false;                        ///< Make new UVs for a given low poly
  std::string unwrap_method = {};             ///< charts, pairs or squares; empty: charts
  TexelDensity density = TexelDensity::area;  ///< Texel density of charts that Kiln lays out

  /// Alpha mode of all materials of an asset with opacity. None: that of the high poly's materials, or mask if none of
  /// these is transparent.
  std::optional<AlphaMode> alpha = {};
  /// Applies to all materials of a glTF. None: as in the inputs. Where no glTF states it, a material becomes
  /// double-sided if views from outside see many back faces through the borders of an open mesh; the warning
  /// "double-sided" reports it.
  std::optional<bool> double_sided = {};

  double max_missed_percent = 100;  ///< The job fails if more samples are missed
  bool force = false;               ///< Allow overwriting files that Kiln did not write
  std::string device = {};          ///< OpenCL device, if run() is given none
  std::string json = {};            ///< File of the report; empty: none
  bool quiet = false;               ///< Used by the command line

  /// Flags that the user set explicitly, such as "--views", even if their values are the defaults. Options with other
  /// values need not be listed.
  std::set<std::string> given = {};
};

/// A map that a job returns in memory.
struct JobMap {
  std::string name = {};  ///< Name as in file names: "normal"
  std::string set = {};   ///< Texture set; empty if there is only one
  std::string tile = {};  ///< UDIM tile; empty: none
  /// Values as files hold them: colours sRGB-encoded, other values mapped from their range to [0, 1]
  BakedMap map = {};
};

/// The result of a job.
struct JobResult {
  std::vector<std::string> files = {};  ///< Paths of the written files, in order
  std::vector<std::byte> glb = {};      ///< The GLB, for Job::in_memory and out = NAME.glb
  std::vector<JobMap> maps = {};        ///< The maps, for Job::in_memory and other outputs
  Mesh low = {};                        ///< The low poly of the maps, in its whole layout
  std::string report = {};              ///< JSON, as written by --json
  std::vector<Warning> warnings = {};   ///< All warnings, in order
  std::vector<Warning> causes = {};     ///< Warnings that are not consequences of other warnings
  std::vector<Message> summary = {};    ///< Summary for users, one line per topic
  /// Empty, or the limit that was exceeded (max_missed_percent, faces, max_error)
  Message failure = {};
  bool cancelled = false;  ///< The callback cancelled: nothing more was written
};

/// Runs a job: reads, repairs, makes or reads the low poly, finds texture sets, bakes and writes.
/// \param progress  called with the share done and the stage; returning false cancels
/// \throws OptionError (kiln/option_error.h) for options that contradict each other, before any work; Error(input), Error(output),
///         Error(device). Files that were written before an error are kept.
/// Thread safety: jobs may run in several threads at once, each with files of its own.
JobResult run(const Device& device, const Job& job, const Progress& progress = {});

/// Checks options for contradictions, as run() does first. \throws OptionError
void check(const Job& job);

}  // namespace kiln
