/// \file
/// One call for a whole bake: what `kiln bake` does. A Job says what is read, made, baked and written; run() does it.
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
#include "kiln/image.h"
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

/// A mesh that a job is given: a file, or one in memory.
struct JobInput {
  /// A file: of a mesh, or, as HIGH, an image of heights (PNG, EXR, TIFF).
  JobInput(std::string path) : name(std::move(path)) {}
  /// The same.
  JobInput(const char* path) : name(path) {}
  /// The same.
  JobInput(const std::filesystem::path& path) : name(path.string()) {}
  /// A mesh with its materials and hierarchy. \param called  its name in messages, and in names of files
  JobInput(Asset given, std::string called = "mesh")
      : name(std::move(called)), asset(std::make_shared<const Asset>(std::move(given))) {}
  /// A mesh alone.
  JobInput(Mesh mesh, std::string called = "mesh")
      : JobInput(Asset{std::move(mesh), {}, {}, {}, {}, {}, {}}, std::move(called)) {}
  /// A mesh in the caller's memory, which is copied.
  JobInput(const MeshView& view) : JobInput(to_mesh(view), std::string(view.name)) {}

  std::string name;                    ///< A file's path; else what the mesh is called
  std::shared_ptr<const Asset> asset;  ///< Null: the file is read
  /// Of a low poly that simplify() made of the high poly: the search reaches as far as it deviates. Null: not known.
  std::shared_ptr<const SimplifyReport> simplified;
};

/// How Kiln makes the low poly: with a number of faces; by a bound on its error; or planned with its maps.
struct MakeLow {
  std::uint32_t faces = 0;  ///< 0: none asked for
  bool keep_parts = false;  ///< Every part keeps faces, however small it is
  /// "0.2%" of the diagonal that the surface may deviate; or bounds on rendered errors, "normal=3deg,ao=2/255", which
  /// plan faces, map sizes and match together (plan_low_poly()). Empty: none.
  std::string max_error = {};
  std::string max_angle = {};    ///< Degrees, of the normals alone
  std::string screen = {};       ///< "600px": the largest size on screen
  std::string max_outline = {};  ///< "2%": share of outlines that may differ
  std::uint32_t lods = 0;        ///< Levels of detail, 2 to 8; 0: one low poly
  double lod_growth = 1;         ///< Of errors, a level
  bool lods_share_uvs = false;   ///< All levels have the first one's layout and maps
};

/// The low poly of a job: given, or made from the high poly.
struct JobLow {
  JobLow() = default;  ///< Made; of a height field: a plane under it
  /// Made so.
  JobLow(MakeLow how) : make(std::move(how)) {}
  /// Given.
  JobLow(JobInput input) : given{std::move(input)} {}
  /// Given as a file.
  JobLow(const char* path) : given{path} {}
  /// Given as a file.
  JobLow(std::string path) : given{std::move(path)} {}
  /// Given as a file.
  JobLow(const std::filesystem::path& path) : given{path} {}
  /// Given in memory.
  JobLow(Mesh mesh) : given{JobInput(std::move(mesh), "low")} {}
  /// Given, and joined.
  JobLow(std::initializer_list<JobInput> inputs) : given(inputs) {}

  std::vector<JobInput> given;  ///< Joined where there are several; none: the low poly is made
  MakeLow make;                 ///< Where none is given
};

/// Repairs of the high poly, before all else: see clean().
enum class CleanHigh {
  automatic,  ///< All where Kiln makes the low poly with new UVs, else windings alone
  none,
  all,
};

/// Size of the maps of one texture set, texels.
struct SetSize {
  std::string set;           ///< Its name
  std::uint32_t width = 0;   ///< Texels
  std::uint32_t height = 0;  ///< Texels
};

/// How files are read that do not say it themselves. As written on the command line: VALUE, high=VALUE or low=VALUE.
struct MeshFrameArguments {
  std::vector<std::string> up;      ///< The axis that is up: x, y, z, -x, -y, -z
  std::vector<std::string> unit;    ///< mm, cm, m, in, ft, or metres as a number
  std::vector<std::string> uv_set;  ///< Of several: a number from 0 on, or a name
  bool allow_outside = false;       ///< Files that a file names may lie outside its folder
  ShadingOptions shading;           ///< Normals of the high poly

  /// True if it says something of files.
  bool given() const { return !up.empty() || !unit.empty() || !uv_set.empty() || allow_outside; }
};

/// All that a bake is told. Every member is an option of the option table (kiln/options.h), which also reads and writes
/// it as text and JSON.
struct Job {
  std::vector<JobInput> high = {};  ///< The high poly; several are joined
  JobLow low = {};                  ///< The low poly: given, or how it is made
  /// A folder for the maps, or NAME.glb, NAME.gltf or NAME.obj for low poly and maps in one.
  std::string out = {};
  bool in_memory = false;  ///< Nothing is written: JobResult has what the files would hold

  /// Sizes, match, maps, occlusion and encoding. Without a map of any kind, a folder gets a normal map, and a file of an
  /// asset what the high poly's materials have. What `match.cage_mesh`, `match.saved` and `occlusion.by_others` point to
  /// is used beside the files that other members name, and must outlive run(); to_json() refuses it.
  BakeOptions bake = {.maps = {}};
  LoadMeshOptions load = {};      ///< Triangulation of polygons
  MeshFrameArguments frame = {};  ///< Axes, units and normals of files that do not say them
  SaveImageOptions image = {ImageFormat::png16};  ///< Format of maps; webp is a GLB's, too
  EncodeMapsOptions pictures = {};                ///< Of a GLB or glTF
  MeshCompression mesh_compression = MeshCompression::none;  ///< Of a GLB
  /// The most bytes that a GLB may have; 0: any. Sizes and encodings of its pictures, up to `bake`'s size, follow: the least
  /// rendered error that fits. A low poly that is made without a number of faces, or a bound on its shape, is planned with them.
  std::uint64_t max_bytes = 0;
  RayTraversal traversal = RayTraversal::automatic;  ///< See Source
  HeightFieldOptions heights = {};                   ///< Where the high poly is an image of heights

  bool match_auto =
      false;               ///< The match and the map's size are chosen by error: see bake_planned()
  bool cage_auto = false;  ///< find_cage()
  std::string cage_mesh = {};               ///< File of a cage for the low poly
  std::string save_cage = {};               ///< File to write the found cage to
  std::string save_match = {};              ///< EXR to write the match to
  std::string load_match = {};              ///< EXR of a match to bake by
  std::string match_list = {};              ///< File of PartsBy::list
  std::optional<PartsBy> parts_by = {};     ///< None: all of the high poly
  PartNames part_names = {};                ///< But for `by` and `list`
  std::string view_weights = {};            ///< File of ViewLikelihood::list
  bool reasons = false;                     ///< An image of why samples were missed
  bool keep_hulls = false;                  ///< Collision hulls of the low poly are baked, too
  bool file_tangents = true;                ///< Tangents of the low poly's file; else MikkTSpace's
  bool split_at_seams = false;              ///< Hard edges at UV seams, where that helps
  std::vector<std::string> occluders = {};  ///< Files of meshes that darken ambient occlusion
  std::vector<std::string> own_maps = {};   ///< NAME=FILE of OpenCL
  std::vector<std::string> variants = {};   ///< NAME=MAP:OPTION=VALUE...
  std::vector<std::string> transfers = {};  ///< FILE[:NAME][:KIND], or mtl:SLOT
  std::vector<std::string> ranges = {};     ///< MAP=LOW,HIGH
  std::vector<std::string> packs = {};      ///< NAME=MAP.CHANNEL,...
  double alpha_test = 0;  ///< What is less opaque is cut off the high poly; 0: nothing
  NormalTextureFormat high_normal_map =
      NormalTextureFormat::automatic;  ///< Of the high poly's normal maps
  bool layers = false;                 ///< All maps as layers of one EXR

  CleanHigh clean = CleanHigh::automatic;     ///< Repairs
  bool keep_inner = false;                    ///< Inner parts of the high poly are not left out
  std::optional<SetsBy> sets = {};            ///< Texture sets; none: by what overlaps
  std::vector<SetSize> set_sizes = {};        ///< Of sets whose maps have other sizes
  bool unwrap = false;                        ///< A given low poly is laid out anew
  std::string unwrap_method = {};             ///< charts, pairs, squares; empty: charts
  TexelDensity density = TexelDensity::area;  ///< Of charts that Kiln lays out

  /// Alpha mode of all materials of an asset with opacity. None: that of the high poly's materials; mask where none of
  /// these is transparent.
  std::optional<AlphaMode> alpha = {};
  std::optional<bool> double_sided = {};  ///< Of all materials of an asset; none: as the inputs'

  double max_missed_percent = 100;  ///< The job fails if more samples are missed
  bool force = false;               ///< Files that Kiln did not write may be written over
  std::string device = {};          ///< OpenCL device, where run() is given none
  std::string json = {};            ///< File of the report; empty: none
  bool quiet = false;               ///< For the command

  /// Options that were chosen on purpose, "--views", even where their values are the defaults. Those that differ from
  /// their defaults need not stand here.
  std::set<std::string> given = {};
};

/// A map of a job in memory.
struct JobMap {
  std::string name;  ///< As in files' names: "normal"
  std::string set;   ///< The texture set; empty: there is but one
  std::string tile;  ///< The UDIM tile; empty: none
  BakedMap
      map;  ///< With values as files hold them: colours sRGB-encoded, values in their range moved to [0, 1]
};

/// What a job came to.
struct JobResult {
  std::vector<std::string> files;    ///< Written, in order
  std::vector<std::byte> glb;        ///< With Job::in_memory and NAME.glb: the file
  std::vector<JobMap> maps;          ///< With Job::in_memory, and no NAME.glb
  Mesh low;                          ///< The low poly that the maps are of, in its whole layout
  std::string report;                ///< JSON, as --json writes it
  std::vector<Warning> warnings;     ///< All, in order
  std::vector<Warning> causes;       ///< Of these, those that follow from no other one
  std::vector<std::string> summary;  ///< What was done, a line a topic
  std::string failure;  ///< Empty; or which limit was missed (max_missed_percent, faces, max_error)
  bool cancelled = false;  ///< The callback returned false: nothing more was written
};

/// Runs a job: reads, repairs, makes or reads the low poly, finds texture sets, bakes and writes.
/// \param progress  called with the share done and the stage; returning false cancels
/// \throws Error(usage) for options that contradict each other, before any work; Error(input), Error(output),
///         Error(device). Files that were written before an error stay.
/// Thread safety: jobs may run in several threads at once, each with files of its own.
JobResult run(const Device& device, const Job& job, const Progress& progress = {});

/// Checks options for contradictions, as run() does first. \throws Error(usage)
void check(const Job& job);

}  // namespace kiln
