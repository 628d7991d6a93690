// Declares the stages of a run as functions, and the values that they pass on. run.cpp shows their order.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "io/file/atomic_file.h"
#include "job/describe.h"
#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "job/map_rows_file.h"
#include "job/match_inputs.h"
#include "job/run.h"
#include "kiln/asset.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/reasons.h"
#include "kiln/simplify.h"
#include "kiln/texture_sets.h"
#include "kiln/unwrap.h"
#include "mesh/mesh_stream.h"
#include "plan/byte_plan.h"

namespace kiln {

class ChunkedMesh;

/// Progress of the whole run, 0 to 1, at which each stage begins.
inline constexpr double kProgressAtLow = 0.08, kProgressAtSource = 0.15, kProgressAtBake = 0.3,
                        kProgressAtSave = 0.8;

/// Inputs of every stage. run_stages() completes the job between stages; the stages themselves never change it.
struct RunContext {
  const Job& job;
  const RunHooks& hooks;
  RunLog& log;
};

/// The high poly in its final form: read, repaired and shaded, or prepared by the caller.
struct LoadedHigh {
  HighPolyInput input;  ///< Has no mesh if `prepared` is set
  CleanReport repairs;  ///< Repairs of input.mesh
  const PreparedHigh* prepared = nullptr;
  /// HIGH if it is larger than memory, otherwise null. If it is set, input.mesh is a sample of its triangles, for
  /// messages
  std::shared_ptr<const MeshStream> streamed;
  /// The chunks of `streamed`, if LOW was made from them; otherwise null, and the bake sorts the high poly into chunks
  /// itself
  std::shared_ptr<const ChunkedMesh> chunks;

  const Mesh& mesh() const { return prepared != nullptr ? prepared->mesh : input.mesh; }
  std::size_t triangle_count() const {
    return streamed != nullptr ? streamed->triangle_count() : mesh().triangles.size();
  }
  bool is_height_field() const {
    return prepared != nullptr ? prepared->height_field : input.heights.has_value();
  }
  bool may_face_inwards() const {
    if (streamed != nullptr) return false;  // the stream's normals were not examined
    return prepared != nullptr ? prepared->faces_inwards : !repairs.faces_outwards;
  }
};

/// Numbers of quads and larger polygons in the files of a low poly.
struct PolygonCounts {
  std::uint64_t quads = 0, larger_polygons = 0;
};

/// The low poly: read, made from the high poly, or planned.
struct LowMesh {
  Mesh mesh;
  std::string path;           ///< Path of the mesh's file, for messages
  std::string stem;           ///< Stem of the file names of the mesh's maps
  Asset nodes_and_materials;  ///< MeshFiles::nodes_and_materials of a low poly that was read
  Mesh hulls;                 ///< MeshFiles::hulls of a low poly that was read
  /// True if Kiln made the mesh, its UVs or its normals, so that it is written beside the maps
  bool made = false;
  PolygonCounts polygons;
  std::uint64_t soft_seams = 0;  ///< Number of soft seams before any split
  /// The mesh before its seams were split; choose_seam_normals() may restore it
  std::optional<Mesh> mesh_before_split;
  /// A warning that choose_seam_normals() gives if a split at seams reduces the error
  std::optional<Warning> soft_seam_warning;
  std::optional<SimplifyReport> simplified;
  std::optional<UnwrapReport> unwrapped;
};

/// Seconds of those stages whose time is in no report of the library.
struct StageSeconds {
  double load = 0, low = 0, build = 0, cage = 0, plan = 0, save = 0;
};

/// A texture set of LOW with the size of its maps, and results of its bake.
struct BakedSet {
  TextureSet set;
  std::uint32_t width = 0, height = 0;
  std::string word;                    ///< The text that stands for the set in file names
  std::optional<PlannedBake> planned;  ///< The plan of --match auto, without its maps
  std::optional<Reasons> reasons;  ///< Why samples have a match or none; nullopt without --reasons
};

/// Parts of the names of a set's files, or of the only layout's.
struct SetNames {
  std::string stem;   ///< Stem with the material or object: "low_glass"
  std::string tile;   ///< Suffix for a UDIM tile, such as ".1001"
  std::string match;  ///< Suffix for a saved match, such as "_glass" or ".1001"
};

/// The meshes and texture sets of a bake. A view: all members outlive it.
struct BakeScene {
  const RunContext& run;
  const LoadedHigh& high;
  const LowMesh& low;
  std::span<const BakedSet> sets = {};  ///< Empty if LOW has one layout
  /// The element of `sets` that is being baked; null for the only layout
  const BakedSet* set = nullptr;

  SetNames names() const;  ///< Parts of the file names of `set`
};

/// Properties of written maps by the maps' names, for the report.
struct StoredMaps {
  Json mips;                          ///< Mip levels and their files
  Json ranges = Json::object();       ///< The values that integer formats store as 0 and 1
  Json variant_ids = Json::object();  ///< Legends of variants of the map id
  Json errors = Json::object();  ///< Rounding errors of formats of 8 bits and of lossy pictures
  std::optional<std::array<double, 3>> origin;  ///< The origin of position maps

  /// Copies the origin and the legends of ids, which all layouts of a bake share, from the maps of another layout.
  void copy_shared_properties(const StoredMaps& other);
};

/// The baked maps of one layout: of the whole low poly, of a texture set, or of a level of detail.
struct BakedLayout {
  BakeOptions options;
  /// The match that options.match.saved points to; null if none was loaded
  std::shared_ptr<const Match> saved_match;
  BakeResult result;
  std::map<std::string, Image>
      sampled_images;  ///< Images of RunHooks::sample, by the name of a map
  /// True if `sampled_images` replace all maps. `result` may then contain one map that exists only because transfers
  /// need the bake of a map; it is not written.
  bool has_only_sampled_images = false;
  std::optional<PlannedBake> planned;  ///< The plan of --match auto, without its maps
  std::optional<Reasons> reasons;  ///< Why samples have a match or none; nullopt without --reasons
  /// Files of maps that are written during the bake; `result` has these maps without pixels
  std::vector<std::unique_ptr<MapFile>> files;
  StoredMaps stored;

  /// The file of a map; null if the map's pixels are in `result`
  MapFile* file_of(const BakedMap& map) const;
};

/// A low poly that was planned together with its maps.
struct PlannedLow {
  LowPolyPlan plan;  ///< The plan, whose mesh and maps move_plan_result() moves out
  /// Trials of a plan within Job::max_bytes; `plan` is its result
  std::optional<BytePlan> byte_plan_result;
  std::optional<LodChain> lods;  ///< All levels of detail; `plan` is the first level's plan
  Json lod_descriptions =
      Json::array();  ///< Descriptions of the written levels of detail, for the report
};

struct HighPolyView;

/// The encoding of a GLB's pictures within Job::max_bytes: the candidates and the choice.
struct FittedPictures {
  std::vector<PictureEncodings>
      encodings_by_picture;  ///< Per picture of each set: its encodings of all sizes and qualities
  std::vector<std::size_t>
      sets;  ///< Per element of `encodings_by_picture`: the index of its texture set
  std::vector<AssetPictures> unencoded_pictures;  ///< Pictures of each set, without their data
  std::optional<double> surface;  ///< Surface area of LOW; computed when a set needs it
  /// Views of the high poly, to measure errors of rendered normals
  std::shared_ptr<const HighPolyView> high_views;
  std::vector<TrialPicture>
      pictures;             ///< For each element of `encodings_by_picture`: the chosen encoding
  std::uint64_t bytes = 0;  ///< Size of the GLB
  double error = 0;         ///< Error of the chosen pictures, in steps of 1/255
};

/// Parts of an asset, collected from its texture sets.
struct AssetParts {
  std::vector<std::shared_ptr<const AssetPictures>> pictures;  ///< Encoded pictures of each set
  /// Per triangle of LOW: the transparent or double-sided material of HIGH that its texels match, else kNoMaterial.
  /// Empty if the materials are unknown.
  std::vector<std::uint32_t> materials_hit;
  static constexpr std::uint32_t kNoMaterial = 0xFFFFFFFFU;
  bool has_opacity = false;         ///< True if the pictures have opacity
  bool opacity_is_sampled = false;  ///< True if an image of RunHooks::sample is the opacity
  /// Candidates and choice of encodings within Job::max_bytes
  std::optional<FittedPictures> fitted;
};

/// The outputs of a run, on disk or in memory.
struct JobOutputs {
  std::vector<std::string> files;
  std::vector<std::byte> glb;  ///< The encoded GLB of a job in memory
  std::vector<JobMap> maps;    ///< The maps of a job in memory, with values as files store them
};

/// All results that the report and the summary describe. A view: all members outlive it.
struct RunOutcome {
  const BakeScene& scene;
  const MatchInputs& match_inputs;
  const BakedLayout& baked;   ///< The baked layout; for several sets, the sums of their reports
  const PlannedLow* planned;  ///< The plan of the low poly; null if it was not planned
  const AssetParts& asset;
  const Json& set_reports;
  const JobOutputs& outputs;
  const StageSeconds& seconds;
  double total_seconds;
};

/// Reports the progress of one of several bakes as progress of the run.
/// \param done   share of all baking that is complete before it
/// \param share  the bake's own share
inline Progress bake_progress(const RunLog& log, double done = 0, double share = 1) {
  return [&log, done, share](double part, std::string_view stage) {
    return log.report_progress(
        kProgressAtBake + (kProgressAtSave - kProgressAtBake) * (done + share * part), stage);
  };
}

/// Removes maps that were baked only because other maps need them.
void drop_unwritten_maps(const RunHooks& hooks, BakedLayout& baked);

// ---- high.cpp ----

/// Reads the meshes or the height field of HIGH. \param job  gets the extent that the file of a height field states
LoadedHigh read_high(Job& job, RunLog& log);
/// Repairs HIGH, and computes its normals.
void repair_high(const Job& job, LoadedHigh& high, RunLog& log);
/// Reads the textures that the maps need, and removes faces of HIGH by --alpha-test.
void read_textures(const Job& job, LoadedHigh& high, BakeOptions& options, RunLog& log);

// ---- saved_source.cpp ----

/// Creates the file of --save-source, and writes HIGH to it as it was read. \throws Error(output)
std::unique_ptr<AtomicFile> begin_saved_source(const Job& job, const LoadedHigh& high, RunLog& log);
/// Completes the file with the source's search structure. \throws Error(output)
void save_source(const RunContext& run, const Source& source, AtomicFile& file,
                 JobOutputs& outputs);
/// If HIGH's file is a saved source, makes `source` read the search structure from it. \throws Error(input)
void attach_saved_tree(const Job& job, const Source& source);

// ---- streaming.cpp ----

/// Opens a HIGH that is larger than memory. Null if HIGH fits into memory, or if it may fit and the job needs the whole
/// mesh.
/// \throws OptionError
std::shared_ptr<const MeshStream> open_streamed_high(const Job& job, const BakeOptions& options,
                                                     const RunHooks& hooks, RunLog& log);
/// Where the job leaves the maps of an asset to Kiln, adds the colours of a HIGH that is larger than memory to those of
/// set_default_asset_maps(). \returns false if the job names its maps
bool choose_streamed_asset_maps(Job& job, const MeshStream& high);
/// Sorts the triangles of a streamed HIGH into chunks, or opens the chunks of an earlier run.
/// \param progress the run's progress, which is reported meanwhile
std::shared_ptr<const ChunkedMesh> sort_into_chunks(const LoadedHigh& high, double progress,
                                                    RunLog& log);
/// Makes a source of the chunks of a streamed HIGH, which are sorted unless LoadedHigh::chunks has them.
Source make_streamed_source(const Device& device, const Job& job, const LoadedHigh& high,
                            RunLog& log);

// ---- low.cpp ----

/// Reads LOW, makes it from HIGH, or unwraps a given one, as the job says.
LowMesh prepare_low(const Job& job, const LoadedHigh& high, RunLog& log);
/// Warns of a low poly with more than half as many vertices as the high poly.
void warn_of_heavy_low(const Mesh& low, const Mesh& high, std::vector<Warning>& warnings);

// ---- seams.cpp ----

/// Chooses between the normals before and after a split at UV seams. A split changes the normals of corners, and the
/// former ones may suit better, as weighted normals of bevels do; the smaller error of rendered normals decides.
void choose_seam_normals(const BakeScene& scene, const Source& source, const BakeOptions& options,
                         LowMesh& low);

// ---- maps.cpp ----

/// Bakes the maps of a layout, and checks them. \param options  including size and progress
BakedLayout bake_layout(const BakeScene& scene, const Source& source, BakeOptions options);
/// Calls bake(), or bake_rows() if `open_rows` is not null. If the layouts of LOW and a height field disagree, the error
/// states the likely reason.
BakeResult bake_high(const HighPolyInput& high, const Source& source, const Mesh& low,
                     const BakeOptions& options, const OpenMapRows* open_rows = nullptr);
/// Plans the low poly together with its maps.
/// \param low  gets the planned mesh; scene.low must be this object
/// \param planned  gets the plan and its trials
BakedLayout bake_planned_low(const BakeScene& scene, const Source& source, BakeOptions options,
                             LowMesh& low, PlannedLow& planned);

// ---- plan.cpp ----

/// Converts the job's options to those of a plan.
LowPolyPlanOptions low_poly_options(const BakeScene& scene, const BakeOptions& options);
/// The warning about maps whose errors exceed their bounds even at the plan's largest size.
Warning map_bounds_warning(const std::vector<MapReached>& bounds, std::uint32_t size);
/// Plans the low poly, its map and the match together.
PlannedLow make_plan(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Moves the mesh and the maps out of a plan. \returns the maps
BakeResult move_plan_result(PlannedLow& planned, LowMesh& low);
/// The warning about a plan that does not reach its bounds. \param place  identifies one of several low polys, such as
/// "at 600 pixels "; may be empty
Warning plan_bound_warning(const LowPolyPlan& plan, const std::string& place = {});
/// Warns if the outlines of low poly and high poly differ by more than 5% of their pixels.
void warn_of_outline(const LowPolyPlan& plan, const std::string& place,
                     std::vector<Warning>& warnings);
/// A table of the plan's candidates, one per line: numbers of faces and texels against bytes and error.
std::vector<std::string> plan_table_lines(const LowPolyPlan& plan);
Json low_poly_plan_json(const LowPolyPlan& plan, std::uint32_t screen);
/// Makes a plan call RunHooks::on_plan as soon as it is chosen.
void forward_plan_to_hook(const BakeScene& scene, LowPolyPlanOptions& options);

// ---- bytes.cpp ----

/// Runs make_plan() within Job::max_bytes. \throws Error(usage) if no plan fits
PlannedLow make_byte_plan(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Encodes the maps of a set, or of the only layout, in all allowed formats, sizes and qualities.
/// \param planned  the low poly's plan; null if it was not planned
void fit_asset_maps(const BakeScene& scene, const Source& source, const AssetMaps& maps,
                    const BakeOptions& options, const PlannedLow* planned, AssetParts& asset);
/// Chooses the encodings of the pictures of all sets.
/// \param file_bytes  returns the size of the asset with AssetParts::pictures
/// \throws Error(usage) if even the smallest pictures exceed the limit
void fit_pictures(const Job& job, const std::function<std::uint64_t()>& file_bytes,
                  AssetParts& asset);
Json bytes_json(const RunOutcome& outcome);
/// A table of the trials within Job::max_bytes, one per line, and of the chosen one.
std::vector<std::string> bytes_table(const RunOutcome& outcome);

// ---- lods.cpp ----

/// Plans and bakes a chain of low polys. The first one is the low poly of the run.
PlannedLow make_lods(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Writes all levels of detail, in one file or a file each, and NAME_lods.json. \param first  maps of the first level
void save_lods(const BakeScene& scene, const Source& source, PlannedLow& planned,
               BakedLayout& first, AssetParts& asset, JobOutputs& outputs);
/// Path of the GLB or glTF of a level.
std::string lod_asset(const Job& job, std::size_t level);
/// For each level, the share of the view's height at and below which it replaces the previous one; 1 for the first. A
/// view has the height of the first level's size on screen, but at least 1080 pixels. If the measured error of a level
/// exceeds its bound, the level is used from a proportionally larger distance on. The shares never increase.
std::vector<double> lod_coverages(const LodChain& chain);
/// A table of the levels of detail, one per line.
std::vector<std::string> lod_table(const LodChain& chain);
/// Name of the file that lists the levels: NAME_lods.json.
std::string lods_file(const Job& job);

// ---- sets.cpp ----

/// The texture sets of LOW, and the criterion that separates them.
struct FoundSets {
  SetsBy by = SetsBy::none;
  std::vector<BakedSet> sets;  ///< Empty if LOW has one layout
};
/// Splits LOW into its texture sets. \throws Error(usage), Error(input)
FoundSets find_sets(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Bakes one set after the other, and writes all files except the asset.
/// \param set_reports  gets one report per set
/// \returns sums over all sets
BakedLayout bake_sets(const RunContext& run, const LoadedHigh& high, const LowMesh& low,
                      std::vector<BakedSet>& sets, const Source& source, const BakeOptions& options,
                      AssetParts& asset, Json& set_reports, JobOutputs& outputs);
/// Writes the asset of all sets, if the output is one. \param sums  the result of bake_sets()
void write_asset_of_sets(const BakeScene& scene, const BakedLayout& sums, const Json& set_reports,
                         AssetParts& asset, JobOutputs& outputs);

// ---- asset.cpp ----

/// Returns LOW together with its collision hulls.
Mesh join_collision_hulls(const Mesh& low, const Mesh& hulls);
/// Adds the maps of HIGH's materials and vertex colours to an asset's maps, unless --maps is given.
/// \returns true if the job changed
bool add_material_maps(Job& job, const LoadedHigh& high, RunLog& log);
/// True if the materials of a GLB depend on the match, because LOW's materials do not have the names of HIGH's.
bool needs_asset_match(const BakeScene& scene);
/// Encodes the maps of a set, or of the only layout, as pictures. \param planned  see fit_asset_maps()
void encode_asset_maps(const BakeScene& scene, const Source& source, const PlannedLow* planned,
                       BakedLayout& baked, AssetParts& asset);
/// Computes AssetParts::materials_hit for the triangles with texels, if the match was kept.
void find_materials_hit(const BakeScene& scene, const BakeResult& result, AssetParts& asset);
/// Returns JSON that states how an asset was made. \param errors  StoredMaps::errors
std::string asset_extras(const BakeScene& scene, const BakeReport& report, const Json& errors,
                         const Json& set_reports);
/// Size in bytes of a GLB with a low poly and the scene's materials, without pictures and asset_extras().
std::uint64_t bytes_without_pictures(const BakeScene& scene, const Mesh& low);
/// Writes LOW with the pictures of all sets as one asset.
/// \param file    NAME.glb or NAME.gltf
/// \param extras  the result of asset_extras()
/// \param levels  coarser levels for the same file
void write_asset(const BakeScene& scene, const std::string& file, const std::string& extras,
                 AssetParts& asset, JobOutputs& outputs, std::vector<AssetLevel> levels = {});
/// Makes a coarser level of an asset, without its coverage.
/// \param scene   a scene whose low poly is that of the level
/// \param number  of the level, for the names of its pictures
AssetLevel make_asset_level(const BakeScene& scene, const AssetParts& asset, std::size_t number);
/// Writes LOW as OBJ, with an MTL that names its maps.
void write_obj_with_mtl(const BakeScene& scene, const AssetParts& asset, JobOutputs& outputs);

// ---- output.cpp ----

/// Converts the legend of the map id to JSON.
inline Json ids_json(const std::vector<IdEntry>& ids) {
  Json json = Json::array();
  for (const IdEntry& id : ids) {
    json.push_back({{"name", id.name}, {"color", id.color}, {"triangles", id.triangles}});
  }
  return json;
}

/// Appends the file to the outputs before it is written, and reports progress. \throws Cancelled
void register_output(const RunContext& run, const std::filesystem::path& path, JobOutputs& outputs);
/// True if the job states the width of the padding, which pad_for_mips() then respects.
bool chooses_padding(const Job& job);
/// True if pad_for_mips() pads the maps: those of a glTF, and those of UVs that Kiln makes, unless a padding was given.
bool pads_for_mips(const Job& job);
/// Rejects outputs that would overwrite an input or a foreign OBJ, before any work.
/// \param sets  LOW's texture sets, once they are known
void check_outputs(const Job& job, std::span<const BakedSet> sets = {}, const RunHooks& hooks = {});
SetNames names_of(const Job& job, const BakedSet& set);
/// Path of a saved match, which for a texture set is MATCH_SET.exr or MATCH.1001.exr.
std::string match_file(const std::string& path, const SetNames& names);
/// Writes the maps of a layout, and LOW if Kiln made it. Several sets share one asset, which is written after them.
/// \param file  path of a GLB or glTF
/// \param planned  see fit_asset_maps()
void save_low_and_maps(const BakeScene& scene, const Source& source, const std::string& file,
                       const PlannedLow* planned, BakedLayout& baked, AssetParts& asset,
                       JobOutputs& outputs);
/// Writes the requested files beside the maps of a layout: reasons and the match.
void save_beside_maps(const BakeScene& scene, const BakedLayout& baked, JobOutputs& outputs);
/// Writes the cage that --cage auto found, if --save-cage requests it.
void save_found_cage(const BakeScene& scene, const MatchInputs& inputs, JobOutputs& outputs);

// ---- stored_map.cpp ----

/// Converts a map to the values that its file format stores, and records their properties. Pads maps except those of a
/// glTF, which encode_asset_maps() pads.
void convert_to_stored(const BakeScene& scene, BakedMap& map, const std::string& name,
                       BakedLayout& baked);
/// True if the files of a layout's maps can be written while the maps are baked: nothing but the file needs the pixels.
bool writes_map_rows(const BakeScene& scene, const BakeOptions& options);
/// Begins the file of a map, for bake_rows().
MapRows& begin_map_file(const BakeScene& scene, const BakedMap& map, BakedLayout& baked);
/// Completes the file of a map, and records the properties of its values.
void finish_map_file(const BakeScene& scene, const BakedMap& map, const std::string& name,
                     MapFile& file, BakedLayout& baked, JobOutputs& outputs);

// ---- report.cpp ----

Json report_json(const RunOutcome& outcome, const Device& device, const Source& source);
Json plan_json(const PlannedBake& planned);
Json reasons_json(const Reasons& reasons);

// ---- summary.cpp ----

/// Adds the lines of the summary to the log.
void add_summary(const RunOutcome& outcome, const Source::Stats& source);

}  // namespace kiln
