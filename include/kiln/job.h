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

  std::string name = {};                    ///< Path of the file; for a mesh in memory its name
  std::shared_ptr<const Asset> asset = {};  ///< The mesh in memory; null: it is read from the file
  /// For a low poly that simplify() made from the high poly: the report of simplify(), which determines the
  /// search distance. Null: not made by simplify()
  std::shared_ptr<const SimplifyReport> simplified = {};
};

/// Settings with which Kiln makes the low poly: a number of faces, a bound of its error, or a plan of
/// low poly and maps together.
struct MakeLow {
  std::uint32_t faces = 0;  ///< Target number of triangles; 0: not given
  bool keep_parts = false;  ///< Keep all parts, including very small ones
  /// Largest deviation of the surface as a share of the diagonal, such as "0.2%"; or bounds of rendered errors,
  /// such as "normal=3deg,ao=2/255", within which plan_low_poly() chooses faces, map sizes and match together.
  /// Empty: no bound.
  std::string max_error = {};
  /// Bound of the error of rendered normals, degrees, like normal= in max_error
  std::string max_angle = {};
  std::string screen = {};       ///< Largest size on screen, such as "600px"
  std::string max_outline = {};  ///< Largest share of the silhouettes that may differ, such as "2%"
  std::uint32_t lods = 0;        ///< Levels of detail, 2 to 8; 0: one low poly
  double lod_growth = 1;         ///< Ratio of the error bounds of consecutive levels
  bool lods_share_uvs = false;   ///< All levels share the first level's layout and maps
  /// Write all levels into one GLB or glTF, by the extension MSFT_lod; else each level is written to
  /// a file of its own
  bool lods_in_one_file = false;
};

/// The low poly of a job: given, or made from the high poly.
struct JobLow {
  JobLow() = default;  ///< A low poly made by Kiln; for a height field, a plane under it
  /// A low poly made by Kiln with these settings.
  JobLow(MakeLow how) : make(std::move(how)) {}
  /// A low poly given as a file or in memory.
  JobLow(JobInput input) : given{std::move(input)} {}
  /// A low poly given as a file.
  JobLow(const char* path) : given{path} {}
  /// A low poly given as a file.
  JobLow(std::string path) : given{std::move(path)} {}
  /// A low poly given as a file.
  JobLow(const std::filesystem::path& path) : given{path} {}
  /// A low poly given in memory.
  JobLow(Mesh mesh) : given{JobInput(std::move(mesh), "low")} {}
  /// Several inputs, which are joined to one low poly.
  JobLow(std::initializer_list<JobInput> inputs) : given(inputs) {}

  /// Inputs, joined if there are several; empty: Kiln makes the low poly
  std::vector<JobInput> given = {};
  MakeLow make = {};  ///< Settings for making the low poly, if `given` is empty
};

/// Repairs of the high poly before all other steps: see clean_mesh().
enum class CleanHigh {
  /// Makes all repairs if Kiln makes the low poly with new UVs; else repairs only inconsistent
  /// windings
  automatic,
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
      {};  ///< UV set to read from files with several sets: an index from 0 on, or a name
  bool allow_outside = false;   ///< Inputs may refer to files outside of their own folders
  ShadingOptions shading = {};  ///< Normals of the high poly

  /// True if any convention is set.
  bool given() const { return !up.empty() || !unit.empty() || !uv_set.empty() || allow_outside; }
};

/// All settings of a bake. Every member is an option of the option table (kiln/options.h), which also converts it from
/// and to text and JSON.
struct Job {
  std::vector<JobInput> high = {};  ///< The high poly; several inputs are joined
  JobLow low = {};                  ///< The low poly that is given, or the settings for making one
  /// A folder for the maps, or NAME.glb, NAME.gltf or NAME.obj for the low poly and its maps in one
  /// asset.
  std::string out = {};
  bool in_memory = false;  ///< Write no files, and return their contents in JobResult

  /// Sizes, match, maps, occlusion and encoding. If no map of any kind is requested, a folder gets a normal map, and an
  /// asset gets the maps that the high poly's materials have. `match.cage_mesh`, `match.saved` and
  /// `occlusion.by_others` may point to objects in memory, in addition to files named by other members; these must
  /// outlive run(), and to_json() refuses them.
  BakeOptions bake = {.maps = {}};
  LoadMeshOptions load = {};  ///< Triangulation of polygons
  /// Axes and units of files that do not state them, and the rule for normals
  MeshFrameArguments frame = {};
  /// File format of maps; webp also applies to the pictures in a GLB
  SaveImageOptions image = {ImageFormat::png16};
  EncodeMapsOptions pictures = {};  ///< Encoding of pictures in a GLB or glTF
  MeshCompression mesh_compression = MeshCompression::none;  ///< Compression of geometry in a GLB
  /// Largest size of a GLB, bytes; 0: unbounded. The sizes (up to that in `bake`) and encodings of its pictures are
  /// chosen for the smallest rendered error within this size. If Kiln makes the low poly, and neither a number of faces
  /// nor a bound on its shape is given, its number of faces is chosen together with them.
  std::uint64_t max_bytes = 0;
  RayTraversal traversal = RayTraversal::automatic;  ///< Kernels for ray casting, see Source
  HeightFieldOptions heights = {};  ///< How an image of heights is read, if the high poly is one

  bool match_auto = false;     ///< Choose the match and the map's size by error: see bake_planned()
  bool cage_auto = false;      ///< Find a cage by find_cage()
  std::string cage_mesh = {};  ///< File of a cage for the low poly
  std::string save_cage = {};  ///< File to write the found cage to
  std::string save_match = {};  ///< File (EXR) to write the match to
  /// File (.kilnsrc) to write the prepared high poly with its search structure to; later jobs can use it as
  /// `high`
  std::string save_source = {};
  /// File (EXR) of a saved match, which replaces the search for points
  std::string load_match = {};
  /// File of pairs for PartsBy::list, with lines of the form LOW = HIGH, HIGH
  std::string match_list = {};
  /// Pairing of parts; none: samples match all of the high poly
  std::optional<PartsBy> parts_by = {};
  /// Patterns of the parts' names. Its members `by` and `list` are ignored: `parts_by` and
  /// `match_list` replace them
  PartNames part_names = {};
  /// File of directions for ViewLikelihood::list, with lines of the form X Y Z WEIGHT
  std::string view_weights = {};
  bool reasons = false;     ///< Also write an image of why samples were missed
  bool keep_hulls = false;  ///< Also bake the collision hulls of the low poly
  /// Use the tangents in the low poly's file; if false, MikkTSpace computes tangents
  bool file_tangents = true;
  /// Make a UV seam of the low poly a hard edge where that reduces the error
  bool split_at_seams = false;
  /// Files of meshes that occlude in the maps ao, bent_normal and shadow
  std::vector<std::string> occluders = {};
  std::vector<std::string> own_maps = {};  ///< User-defined maps in OpenCL C: NAME=FILE.cl
  std::vector<std::string> variants = {};  ///< Variants of maps: NAME=MAP:OPTION=VALUE...
  /// Textures to transfer: FILE[:NAME][:KIND], or mtl:SLOT
  std::vector<std::string> transfers = {};
  /// Ranges of values that integer formats store: MAP=LOW,HIGH
  std::vector<std::string> ranges = {};
  /// Pictures with channels of several maps: NAME=MAP.CHANNEL,...
  std::vector<std::string> packs = {};
  double alpha_test = 0;  ///< Opacity below which parts of the high poly are cut away; 0: off
  NormalTextureFormat high_normal_map =
      NormalTextureFormat::automatic;  ///< Channel convention of the high poly's normal maps
  bool layers = false;                 ///< Write all maps as layers of one EXR

  CleanHigh clean = CleanHigh::automatic;  ///< Repairs of the high poly
  bool keep_inner = false;  ///< Keep parts of the high poly that no view from outside sees
  double fill_holes = 0;    ///< Value of CleanOptions::fill_holes for the high poly
  /// How the low poly is split into texture sets; none: chosen by choose_texture_sets()
  std::optional<SetsBy> sets = {};
  std::vector<SetSize> set_sizes = {};  ///< Map sizes of single texture sets
  bool unwrap = false;                  ///< Make new UVs for a given low poly
  /// Method of unwrapping: charts, pairs or squares; empty: charts
  std::string unwrap_method = {};
  TexelDensity density = TexelDensity::area;  ///< Texel density of charts that Kiln lays out

  /// Alpha mode of all materials of an asset with opacity. None: that of the high poly's materials, or mask if none of
  /// these is transparent.
  std::optional<AlphaMode> alpha = {};
  /// Whether all materials of a written glTF are double-sided. None: as in the inputs. If no input states
  /// it for a material (only glTF does), the material becomes double-sided if views from outside see many
  /// back faces through the borders of an open mesh; the warning "double-sided" reports it.
  std::optional<bool> double_sided = {};

  /// The job fails if more than this percentage of the samples is missed
  double max_missed_percent = 100;
  bool force = false;       ///< Allow overwriting files that Kiln did not write
  std::string device = {};  ///< OpenCL device, if the caller passes none to run()
  std::string json = {};    ///< File of the report; empty: none
  bool quiet = false;       ///< Suppress the command line's output; the library ignores it

  /// Flags that the user gave explicitly, such as "--views". Flags of options whose values are not the defaults may
  /// be left out.
  std::set<std::string> given = {};
};

/// A map that a job returns in memory.
struct JobMap {
  std::string name = {};  ///< Name of the map as in file names, such as "normal"
  std::string set = {};   ///< Name of the texture set; empty if there is only one
  std::string tile = {};  ///< Number of the UDIM tile, such as "1001"; empty: none
  /// The map with values as files store them: colours sRGB-encoded, other values mapped from their
  /// range to [0, 1]
  BakedMap map = {};
};

/// The result of a job.
struct JobResult {
  std::vector<std::string> files = {};  ///< Paths of the written files, in order
  std::vector<std::byte> glb = {};  ///< The GLB, if Job::in_memory is set and Job::out is NAME.glb
  std::vector<JobMap> maps = {};    ///< The maps, if Job::in_memory is set and Job::out is no GLB
  Mesh low = {};  ///< The low poly on which the maps were baked, with the UVs of all texture sets
  std::string report = {};             ///< Report as JSON, as the command's --json writes it
  std::vector<Warning> warnings = {};  ///< All warnings, in the order in which they occurred
  /// Warnings, except those that are consequences of other warnings
  std::vector<Warning> causes = {};
  std::vector<Message> summary = {};  ///< Summary for users, one line per topic
  /// The limit that the result exceeds (max_missed_percent, faces, max_error); empty: none
  Message failure = {};
  bool cancelled = false;  ///< The callback cancelled: no further file was written
};

/// Runs a job: reads, repairs, makes or reads the low poly, finds texture sets, bakes and writes.
/// \param progress  called with the completed share and the name of the stage; if it returns false, the job is
///                  cancelled
/// \throws OptionError (kiln/option_error.h) for options that contradict each other, before any work; Error(input), Error(output),
///         Error(device). Files that were written before an error are kept.
/// Thread safety: jobs may run in several threads at once, each with files of its own.
JobResult run(const Device& device, const Job& job, const Progress& progress = {});

/// Checks options for contradictions, as run() does first. \throws OptionError
void check(const Job& job);

}  // namespace kiln
