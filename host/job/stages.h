// The stages of a run as functions, and the values that they pass on: see run.cpp for their order.
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

#include "job/describe.h"
#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "job/match_inputs.h"
#include "job/run.h"
#include "kiln/asset.h"
#include "kiln/cage.h"
#include "kiln/kiln.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/reasons.h"
#include "kiln/simplify.h"
#include "kiln/texture_sets.h"
#include "kiln/unwrap.h"
#include "plan/byte_plan.h"

namespace kiln {

/// Shares of the whole work at which stages begin, for a steady progress bar.
inline constexpr double kAtLow = 0.08, kAtSource = 0.15, kAtBake = 0.3, kAtSave = 0.8;

/// Inputs of every stage. run_stages() refines the job between stages; no stage changes it.
struct RunContext {
  const Job& job;
  const RunHooks& hooks;
  RunLog& log;
};

/// The high poly as it is baked: read, repaired and shaded, or prepared by the caller.
struct LoadedHigh {
  HighPolyInput input;  ///< Without a mesh where it was prepared
  CleanReport cleaned;  ///< Repairs of input.mesh
  const PreparedHigh* prepared = nullptr;

  const Mesh& mesh() const { return prepared != nullptr ? prepared->mesh : input.mesh; }
  bool is_height_field() const {
    return prepared != nullptr ? prepared->height_field : input.heights.has_value();
  }
  bool may_face_inwards() const {
    return prepared != nullptr ? prepared->faces_inwards : !cleaned.faces_outwards;
  }
};

/// Numbers of polygons of a low poly's files.
struct PolygonCounts {
  std::uint64_t quads = 0, larger = 0;
};

/// The low poly: read, made from the high poly, or planned.
struct LowMesh {
  Mesh mesh;
  std::string path;   ///< Of its file, for messages
  std::string stem;   ///< Of the maps' names
  Asset beside;       ///< MeshFiles::beside of one that was read
  Mesh hulls;         ///< MeshFiles::hulls of one that was read
  bool made = false;  ///< Kiln made it, or its UVs or normals: it is written beside the maps
  PolygonCounts polygons;
  std::uint64_t soft_seams = 0;  ///< Before any were split
  std::optional<Mesh> unsplit;   ///< The mesh before seams were split, until judge_seams()
  std::optional<Warning>
      seam_warning;  ///< To be given where splitting seams helps, by judge_seams()
  std::optional<SimplifyReport> simplified;
  std::optional<UnwrapReport> unwrapped;
};

/// Times of stages outside the library's own reports, seconds.
struct StageSeconds {
  double load = 0, low = 0, build = 0, cage = 0, plan = 0, save = 0;
};

/// One of LOW's texture sets, the size of its maps, and what was found while they were baked.
struct BakedSet {
  TextureSet set;
  std::uint32_t width = 0, height = 0;
  std::string word;                    ///< In names of files
  std::optional<PlannedBake> planned;  ///< With --match auto; without its maps
  std::optional<Reasons> reasons;      ///< With --reasons
};

/// Beginning and end of names of files of a set, or of the only layout.
struct SetNames {
  std::string stem;   ///< "low_glass" of a material or object
  std::string tile;   ///< ".1001" of a UDIM tile
  std::string match;  ///< "_glass" or ".1001", of a saved match
};

/// The meshes and the texture sets of a bake. A view: all members outlive it.
struct BakeScene {
  const RunContext& run;
  const LoadedHigh& high;
  const LowMesh& low;
  std::span<const BakedSet> sets = {};  ///< Empty: one layout
  const BakedSet* set = nullptr;  ///< Of `sets`, that is baked and written; null: the only layout

  SetNames names() const;  ///< Of the files of `set`
};

/// Facts of written maps, by their names.
struct StoredMaps {
  Json mips;                                    ///< Levels and their files
  Json ranges = Json::object();                 ///< Values at 0 and 1 of integer formats
  Json variant_ids = Json::object();            ///< Legends
  Json errors = Json::object();                 ///< Of formats of 8 bits, and of lossy pictures
  std::optional<std::array<double, 3>> origin;  ///< Of maps of positions

  /// Adds what holds for the maps of all layouts.
  void add_common(const StoredMaps& other);
};

/// Maps of one layout: of the whole low poly, of a texture set, or of a level of detail.
struct BakedLayout {
  BakeOptions options;
  /// The match that options.match.saved points to; null if none was loaded
  std::shared_ptr<const Match> saved_match;
  BakeResult result;
  std::map<std::string, Image> own_images;  ///< Of RunHooks::sample
  bool own_images_alone = false;       ///< The maps of `result` serve these, and are not written
  std::optional<PlannedBake> planned;  ///< With --match auto; without its maps
  std::optional<Reasons> reasons;      ///< With --reasons
  StoredMaps stored;
};

/// A low poly that was planned together with its maps.
struct PlannedLow {
  LowPolyPlan plan;                      ///< Its mesh and maps are moved out by take_plan()
  std::optional<BytePlan> within_bytes;  ///< Its trials, for Job::max_bytes; its plan is `plan`
  std::optional<LodChain> lods;          ///< Its first level's plan is `plan`
  Json lod_levels = Json::array();       ///< Levels that were written
};

struct HighPolyView;

/// Encodings of the pictures of a GLB within Job::max_bytes: all that may be chosen, and the choice.
struct FittedPictures {
  std::vector<PictureLadder> ladders;         ///< Of all sets
  std::vector<std::size_t> sets;              ///< Per ladder
  std::vector<AssetPictures> described;       ///< Per set, without pictures
  std::optional<double> surface;              ///< Area of LOW, once a set needs it
  std::shared_ptr<const HighPolyView> shown;  ///< For errors of rendered normals
  std::vector<TrialPicture> pictures;         ///< The choice, a ladder each
  std::uint64_t bytes = 0;                    ///< Of the file
  double error = 0;                           ///< Steps of 1/255
};

/// Parts of an asset, collected from its texture sets.
struct AssetParts {
  std::vector<std::shared_ptr<const AssetPictures>> pictures;  ///< One a set
  /// Per triangle of LOW, the material of HIGH that its texels match where that is transparent or double-sided, or
  /// kNoMaterial. Empty: not known.
  std::vector<std::uint32_t> materials_hit;
  static constexpr std::uint32_t kNoMaterial = 0xFFFFFFFFU;
  bool has_opacity = false;              ///< Of the pictures
  bool own_opacity = false;              ///< An image of RunHooks::sample is the opacity
  std::optional<FittedPictures> fitted;  ///< With Job::max_bytes
};

/// What a run has written, or holds in memory.
struct JobOutputs {
  std::vector<std::string> files;
  std::vector<std::byte> glb;  ///< With Job::in_memory
  std::vector<JobMap> maps;    ///< With Job::in_memory; values as files hold them
};

/// Everything that the report and the summary describe. A view: all members outlive it.
struct RunOutcome {
  const BakeScene& scene;
  const MatchInputs& match_inputs;
  const BakedLayout& baked;   ///< Of several sets: their sums
  const PlannedLow* planned;  ///< Null: the low poly was not planned
  const AssetParts& asset;
  const Json& set_reports;
  const JobOutputs& outputs;
  const StageSeconds& seconds;
  double total_seconds;
};

/// Progress of a bake that is a share of all baking. \param done  share before it
inline Progress bake_progress(const RunLog& log, double done = 0, double share = 1) {
  return [&log, done, share](double part, std::string_view stage) {
    return log.goes_on(kAtBake + (kAtSave - kAtBake) * (done + share * part), stage);
  };
}

/// Removes maps that were baked for other maps alone.
void drop_unwritten(const RunHooks& hooks, BakedLayout& baked);

// ---- high.cpp ----

/// Reads HIGH. \param job  gets the extent of a height field that its file states
LoadedHigh read_high(Job& job, RunLog& log);
/// Repairs HIGH and gives it normals.
void repair_high(const Job& job, LoadedHigh& high, RunLog& log);
/// Reads the textures that the maps need, and cuts HIGH where --alpha-test finds it transparent.
void read_textures(const Job& job, LoadedHigh& high, BakeOptions& options, RunLog& log);

// ---- low.cpp ----

/// Reads LOW, makes it from HIGH, or unwraps a given one.
LowMesh prepare_low(const Job& job, const LoadedHigh& high, RunLog& log);
/// Warns of a low poly that has more than half of the high poly's vertices.
void warn_of_heavy_low(const Mesh& low, const Mesh& high, std::vector<Warning>& warnings);

// ---- seams.cpp ----

/// Splitting seams changes the normals of corners. The former normals may suit better, as weighted normals of bevels
/// do: the smaller error of rendered normals decides.
void judge_seams(const BakeScene& scene, const Source& source, const BakeOptions& options,
                 LowMesh& low);

// ---- maps.cpp ----

/// Bakes the maps of a layout, and judges them. \param options  with size and progress
BakedLayout bake_layout(const BakeScene& scene, const Source& source, BakeOptions options);
/// bake(). Where layouts disagree over a height field, the error states the likely reason.
BakeResult bake_from(const HighPolyInput& high, const Source& source, const Mesh& low,
                     const BakeOptions& options);
/// Plans the low poly with its maps. \param low  gets the mesh of the plan; scene.low is `low`
/// \param planned  gets what was tried
BakedLayout bake_planned_low(const BakeScene& scene, const Source& source, BakeOptions options,
                             LowMesh& low, PlannedLow& planned);

// ---- plan.cpp ----

/// Options of the plan.
LowPolyPlanOptions low_poly_options(const BakeScene& scene, const BakeOptions& options);
/// Warning about maps whose errors exceed their bounds even at the plan's largest size.
Warning bounds_not_reached(const std::vector<MapReached>& bounds, std::uint32_t size);
/// Chooses the low poly, its map and the match together.
PlannedLow make_plan(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Moves the mesh and the maps of a plan out of it. \returns the maps
BakeResult take_plan(PlannedLow& planned, LowMesh& low);
/// \param place  which of several low polys, as in "at 600 pixels "; may be empty
Warning plan_not_reached(const LowPolyPlan& plan, const std::string& place = {});
/// Warns where pictures show that outlines differ much.
void warn_of_outline(const LowPolyPlan& plan, const std::string& place,
                     std::vector<Warning>& warnings);
/// Trade-offs between faces and texels, as lines of a table.
std::vector<std::string> trade_table(const LowPolyPlan& plan);
Json low_poly_plan_json(const LowPolyPlan& plan, std::uint32_t screen);
/// Reports a plan to RunHooks::on_plan as soon as it is chosen.
void watch_plan(const BakeScene& scene, LowPolyPlanOptions& options);

// ---- bytes.cpp ----

/// make_plan() within Job::max_bytes. \throws Error(usage) where nothing fits
PlannedLow make_byte_plan(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Encodes the maps of a set, or of the only layout, in all ways that may be chosen.
/// \param planned  the low poly's plan; null: it was not planned
void fit_asset_maps(const BakeScene& scene, const Source& source, const AssetMaps& maps,
                    const BakeOptions& options, const PlannedLow* planned, AssetParts& asset);
/// Chooses the pictures of all sets. \param file_bytes  of the asset with AssetParts::pictures
/// \throws Error(usage) where even the smallest are too large
void fit_pictures(const Job& job, const std::function<std::uint64_t()>& file_bytes,
                  AssetParts& asset);
Json bytes_json(const RunOutcome& outcome);
/// Trials and the choice, as lines.
std::vector<std::string> bytes_table(const RunOutcome& outcome);

// ---- lods.cpp ----

/// Plans and bakes a chain of low polys; the first is the run's.
PlannedLow make_lods(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Writes all levels, in a file each or in one, and NAME_lods.json. \param first  the first level's maps
void save_lods(const BakeScene& scene, const Source& source, PlannedLow& planned,
               BakedLayout& first, AssetParts& asset, JobOutputs& outputs);
/// The GLB or glTF of a level.
std::string lod_asset(const Job& job, std::size_t level);
/// For each level the share of the view's height, at and below which it replaces the one before; 1 for the first. A view
/// has the height of the first level's size on screen, but at least 1080 pixels. A level whose measured error is above its
/// bound is used that much farther away. Never rises.
std::vector<double> lod_coverages(const LodChain& chain);
/// The levels, as lines of a table.
std::vector<std::string> lod_table(const LodChain& chain);
/// NAME_lods.json.
std::string lods_file(const Job& job);

// ---- sets.cpp ----

/// The texture sets of LOW.
struct FoundSets {
  SetsBy by = SetsBy::none;
  std::vector<BakedSet> sets;  ///< Empty: one layout
};
/// Parts LOW into its texture sets. \throws Error(usage), Error(input)
FoundSets find_sets(const BakeScene& scene, const Source& source, const BakeOptions& options);
/// Bakes one set after the other, and writes all but an asset. \param set_reports  gets the report of each
/// \returns sums over all sets
BakedLayout bake_sets(const RunContext& run, const LoadedHigh& high, const LowMesh& low,
                      std::vector<BakedSet>& sets, const Source& source, const BakeOptions& options,
                      AssetParts& asset, Json& set_reports, JobOutputs& outputs);
/// Writes the asset of all sets, where one is asked for. \param sums  of bake_sets()
void write_asset_of_sets(const BakeScene& scene, const BakedLayout& sums, const Json& set_reports,
                         AssetParts& asset, JobOutputs& outputs);

// ---- asset.cpp ----

/// LOW as it is written, with the collision hulls that were taken off.
Mesh with_hulls(const Mesh& low, const Mesh& hulls);
/// Adds to the maps of an asset without --maps those that HIGH's materials and colours have. \returns true if the job changed
bool add_material_maps(Job& job, const LoadedHigh& high, RunLog& log);
/// True if a GLB's materials need the match: LOW's do not name those of HIGH that they show.
bool needs_asset_match(const BakeScene& scene);
/// Encodes the maps of a set, or of the only layout, as pictures. \param planned  see fit_asset_maps()
void encode_asset_maps(const BakeScene& scene, const Source& source, const PlannedLow* planned,
                       BakedLayout& baked, AssetParts& asset);
/// Finds AssetParts::materials_hit of the triangles that have texels, where the match was kept.
void find_materials_hit(const BakeScene& scene, const BakeResult& result, AssetParts& asset);
/// JSON that states how an asset was made. \param errors  see StoredMaps
std::string asset_extras(const BakeScene& scene, const BakeReport& report, const Json& errors,
                         const Json& set_reports);
/// Bytes of a GLB with a low poly and the scene's materials, without pictures and asset_extras().
std::uint64_t bytes_without_pictures(const BakeScene& scene, const Mesh& low);
/// Writes LOW with all sets' pictures as one asset. \param file  NAME.glb or NAME.gltf \param extras  of asset_extras()
/// \param levels  coarser levels in the same file
void write_asset(const BakeScene& scene, const std::string& file, const std::string& extras,
                 AssetParts& asset, JobOutputs& outputs, std::vector<AssetLevel> levels = {});
/// A coarser level of an asset, without its coverage. \param scene  its low poly is the level's
/// \param number  of the level, for names of its pictures
AssetLevel make_asset_level(const BakeScene& scene, const AssetParts& asset, std::size_t number);
/// Writes LOW with an MTL that names its maps.
void write_obj_with_mtl(const BakeScene& scene, const AssetParts& asset, JobOutputs& outputs);

// ---- output.cpp ----

/// The legend of a map of names.
inline Json ids_json(const std::vector<IdEntry>& ids) {
  Json json = Json::array();
  for (const IdEntry& id : ids) {
    json.push_back({{"name", id.name}, {"color", id.color}, {"triangles", id.triangles}});
  }
  return json;
}

/// Notes a file that is written next. \throws Cancelled
void announce(const RunContext& run, const std::filesystem::path& path, JobOutputs& outputs);
/// True if a width of the padding was chosen, whose copies pad_for_mips() keeps.
bool chooses_padding(const Job& job);
/// True if maps are padded by pad_for_mips(): those of a glTF, and those of UVs that Kiln lays out unless a padding was
/// chosen.
bool pads_for_mips(const Job& job);
/// Converts a map from values to what a file of the format holds. Pads it, except those of a glTF, which
/// encode_asset_maps() pads.
void store(const BakeScene& scene, BakedMap& map, const std::string& name, BakedLayout& baked);
/// Before any work: refuses to write over an input, or over an OBJ of the user's.
/// \param sets  LOW's texture sets, once they are known
void check_outputs(const Job& job, std::span<const BakedSet> sets = {}, const RunHooks& hooks = {});
SetNames names_of(const Job& job, const BakedSet& set);
/// A saved match's file: of a set MATCH_SET.exr, or MATCH.1001.exr.
std::string match_file(const std::string& path, const SetNames& names);
/// Writes LOW, if Kiln made it, with the maps of a layout. Several sets share one asset, which is written after them.
/// \param file  the asset of a GLB or glTF \param planned  see fit_asset_maps()
void save_low_and_maps(const BakeScene& scene, const Source& source, const std::string& file,
                       const PlannedLow* planned, BakedLayout& baked, AssetParts& asset,
                       JobOutputs& outputs);
/// Writes what is asked for beside the maps of a layout: reasons and the match.
void save_beside_maps(const BakeScene& scene, const BakedLayout& baked, JobOutputs& outputs);
/// Writes the cage that --cage auto found, where that is asked for.
void save_found_cage(const BakeScene& scene, const MatchInputs& inputs, JobOutputs& outputs);

// ---- report.cpp ----

Json report_json(const RunOutcome& outcome, const Device& device, const Source& source);
Json plan_json(const PlannedBake& planned);
Json reasons_json(const Reasons& reasons);

// ---- summary.cpp ----

/// Adds lines on the result, a line a topic.
void add_summary(const RunOutcome& outcome, const Source::Stats& source);

}  // namespace kiln
