// One run of a job: what its stages hand on.
#pragma once

#include <array>
#include <deque>
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

/// Shares of the whole work at which the stages begin, for a bar that moves steadily.
inline constexpr double kAtLow = 0.08, kAtSource = 0.15, kAtBake = 0.3, kAtSave = 0.8;

/// Polygons of a LOW that was read.
struct PolygonCounts {
  std::uint64_t quads = 0, larger = 0;  ///< Of four corners, and of more
};

struct LowMesh {
  Mesh mesh;
  Asset beside;       // MeshFiles::beside of one that was read
  Mesh hulls;         // MeshFiles::hulls of it
  std::string stem;   // of the maps' names
  bool made = false;  // by us, or its UVs: it is written beside the maps
  PolygonCounts polygons;
  std::uint64_t soft_seams = 0;         // before they were split
  std::optional<Mesh> whole;            // before they were split
  std::optional<Warning> seam_warning;  // that is given where splitting them helps
  std::optional<SimplifyReport> simplified;
  std::optional<UnwrapReport> unwrapped;
};

/// Seconds of stages that are not the library's.
struct Stages {
  double load = 0, low = 0, build = 0, cage = 0, plan = 0, save = 0;
};

/// One of LOW's texture sets: its triangles, the size of its maps, and what their names have for it.
struct BakedSet {
  TextureSet set;
  std::uint32_t width = 0, height = 0;
  std::string word;                    ///< In files' names
  std::optional<PlannedBake> planned;  ///< With --match auto; without its maps
  std::optional<Reasons> reasons;      ///< With --reasons
};

/// Beginning and end of names of files of a set, or of the only layout.
struct SetNames {
  std::string stem;   ///< "low_glass" of a material or object
  std::string tile;   ///< ".1001" of a UDIM tile
  std::string match;  ///< "_glass" or ".1001", of a saved match
};

/// A high poly that is on the device already, as it is baked: repaired, and with its normals.
struct PreparedHigh {
  const Source& source;
  const Mesh& mesh;
  std::span<const Material> materials =
      {};                      ///< Of the mesh; empty: read from the file that Job::high names
  bool height_field = false;   ///< The mesh is that of one
  bool faces_inwards = false;  ///< inward_parts() found some
};

struct HighPolyView;

/// How the pictures of a GLB within Job::max_bytes may be stored, and how they are.
struct FittedPictures {
  std::vector<PictureLadder> ladders;         ///< Of all sets
  std::vector<std::size_t> sets;              ///< Per ladder
  std::vector<AssetPictures> described;       ///< Per set, without pictures
  std::optional<double> surface;              ///< Area of LOW, once a set needs it
  std::shared_ptr<const HighPolyView> shown;  ///< To measure rendered normals by
  std::vector<TrialPicture> pictures;         ///< That were chosen, a ladder each
  std::uint64_t bytes = 0;                    ///< Of the file
  double error = 0;                           ///< Steps of 1/255
};

struct BakeRun;

/// What a door does beside a run: the command draws plans, Python bakes from its sources and samples functions.
struct RunHooks {
  std::function<std::vector<std::string>(const std::string& stem)>
      plan_files;                  ///< That it may write
  std::function<void()> on_start;  ///< Options are checked, and nothing is read yet
  std::function<void(const LowPolyPlan&, const std::string& stem)>
      on_plan;  ///< As soon as it is known
  /// \returns false where it was cancelled
  std::function<bool(const LowPolyPlan&, const std::string& folder, const std::string& stem,
                     std::vector<std::string>& outputs, std::vector<Warning>& warnings)>
      draw_plan;
  std::function<void(const Message&)> line;  ///< A line of the summary that is known early
  /// Makes the source of a high poly, or has one of the same mesh from another run. Empty: it is made
  std::function<Source(const Device&, const Mesh&, RayTraversal)> make_source;

  const PreparedHigh* high = nullptr;  ///< In place of Job::high, which then names it alone
  /// Images of the caller's own, by the names of their slots in a material, which replace the maps of these names.
  /// Called once, with the points of the high poly that the texels stand for. Values are as files hold them.
  std::function<std::map<std::string, Image>(const Match&, const Mesh& high)> sample;
  std::set<std::string> not_written;  ///< Maps that are baked, but get no place in the asset
  bool needs_uvs = false;  ///< The low poly is unwrapped even where its plan needs no map
  bool writes = true;      ///< False: on_baked takes the maps
  std::function<void(BakeRun&)> on_baked;  ///< Before anything is written; of one texture set alone
};

/// Progress of a run, and the lines that say what it did.
class RunLog {
 public:
  RunLog(Progress progress, std::function<void(const Message&)> tell)
      : progress_(std::move(progress)), tell_(std::move(tell)) {}
  /// \returns false where it was cancelled
  bool progress(double share, std::string_view stage) const {
    return !progress_ || progress_(share, stage);
  }
  void line(const Message& text) {
    if (tell_) tell_(text);
    lines.push_back(text);
  }

  std::vector<Message> lines;

 private:
  Progress progress_;
  std::function<void(const Message&)> tell_;
};

struct BakeRun {
  BakeRun(const Job& given, const Progress& progress, const RunHooks& with)
      : arguments(given), hooks(with), console(progress, with.line) {}

  /// The high poly as it is baked.
  const Mesh& high_mesh() const { return hooks.high != nullptr ? hooks.high->mesh : high.mesh; }

  Job arguments;
  const RunHooks& hooks;
  BakeOptions options;
  SaveImageOptions save_options;
  RunLog console;
  Stopwatch watch;
  Stages stages;
  std::vector<Warning> warnings;
  std::size_t warnings_of_high = 0;  // the first of them
  HighPolyInput high;                // without a mesh where it was prepared
  CleanReport cleaned;               // what was repaired in it
  LowMesh low;
  std::string low_path;
  std::optional<Mesh> cage_mesh;  // that was loaded
  std::optional<FoundCage> cage;  // that was found
  std::deque<Mesh> occluders;
  std::optional<Parts> parts;
  std::optional<Match> match;  // that was loaded
  std::optional<Reasons> reasons;
  std::optional<PlannedBake> planned;
  std::optional<LowPolyPlan> plan;       // its mesh and maps are `low` and `result`
  const Source* source = nullptr;        // as long as stages run
  std::optional<BytePlan> byte_plan;     // its trials; its low poly and maps are `plan`
  std::optional<FittedPictures> fitted;  // of Job::max_bytes
  std::optional<LodChain> lods;          // its first level is `low`
  Json lod_levels = Json::array();
  std::vector<BakedSet> sets;     // none: one layout for all
  const BakedSet* set = nullptr;  // of `sets`, that is baked and written; null: all in one
  Json set_reports = Json::array();
  BakeResult result;
  std::vector<std::string> outputs;
  std::vector<std::byte> glb;                                  // of a job in memory
  std::vector<JobMap> stored_maps;                             // likewise: as files hold them
  std::vector<std::shared_ptr<const AssetPictures>> pictures;  // of a GLB, one a set
  /// For a GLB, per triangle of LOW: the material of HIGH that it shows where that is transparent or double-sided.
  std::vector<std::uint32_t> materials_hit;
  static constexpr std::uint32_t kNoMaterial = 0xFFFFFFFFU;
  std::map<std::string, Image> own_images;  // RunHooks::sample
  std::set<std::string> not_written;        // RunHooks::not_written
  bool has_opacity = false;                 // of the asset's pictures
  Json mips, ranges = Json::object();
  Json variant_ids = Json::object();            // legends, by the maps' names
  Json stored_errors = Json::object();          // of maps that were written in 8 bits
  std::optional<std::array<double, 3>> origin;  // of maps of places
};

// ---- low.cpp ----

/// The maps' stem; and of the low poly that is written beside them, where one is.
std::string low_stem(const Job& arguments);
/// Stem of the files of a level of detail.
std::string lod_stem(const Job& arguments, std::size_t level);
/// The file that the low poly comes from.
const std::string& low_source(const Job& arguments);
/// Reads LOW; or makes one from HIGH; or unwraps the given one.
/// \param dense  facts about the high poly beside its mesh
LowMesh prepare_low(const Job& arguments, const Mesh& high, const HighPolyInput& dense,
                    RunLog& console, std::vector<Warning>& warnings);

/// Says so where a low poly has more than half of the high poly's vertices.
void warn_of_heavy_low(const Mesh& low, const Mesh& high, std::vector<Warning>& warnings);

// ---- plan.cpp ----

/// Options of the plan.
LowPolyPlanOptions low_poly_options(const BakeRun& run);
/// Warnings for maps that a plan's largest size does not do for.
Warning bounds_not_reached(const std::vector<MapReached>& bounds, std::uint32_t size);

/// Plans the low poly, its map and the match together, and makes them. \returns false where it was cancelled
bool make_plan(BakeRun& run, const Source& source);
/// Takes what was planned for the run's mesh and maps.
void take_plan(BakeRun& run, LowPolyPlan planned);
/// \param place  which of several low polys, as in "at 600 pixels "; may be empty
Warning plan_not_reached(const LowPolyPlan& plan, const std::string& place = {});
/// Tells where pictures show that outlines differ much.
void warn_of_outline(const LowPolyPlan& plan, const std::string& place,
                     std::vector<Warning>& warnings);
/// The trade that the plan made, as lines of a table.
std::vector<std::string> trade_table(const LowPolyPlan& plan);
Json low_poly_plan_json(const LowPolyPlan& plan, std::uint32_t screen);
/// Tells a plan to whoever draws it, as soon as it is known.
void watch_plan(BakeRun& run, LowPolyPlanOptions& options);

// ---- bytes.cpp ----

/// make_plan() within Job::max_bytes. \returns false where it was cancelled. \throws Error(usage) where nothing fits
bool make_byte_plan(BakeRun& run, const Source& source);
/// Encodes maps of the next set, or of the only one, in all ways that may be chosen.
void fit_asset_maps(BakeRun& run, const AssetMaps& maps);
/// Chooses the pictures of all sets. \param file_bytes  of the asset with BakeRun::pictures
/// \throws Error(usage) where even the smallest are too large
void fit_pictures(BakeRun& run, const std::function<std::uint64_t()>& file_bytes);
Json bytes_json(const BakeRun& run);
/// What was tried and chosen, as lines.
std::vector<std::string> bytes_table(const BakeRun& run);

// ---- lods.cpp ----

/// Plans and makes a chain of low polys; the first is the run's. \returns false where it was cancelled
bool make_lods(BakeRun& run, const Source& source);
/// Writes all levels, and NAME_lods.json. \returns false where it was cancelled
bool save_lods(BakeRun& run);
/// The GLB or glTF of a level.
std::string lod_asset(const Job& arguments, std::size_t level);
/// The levels, as lines of a table.
std::vector<std::string> lod_table(const LodChain& chain);
/// NAME_lods.json.
std::string lods_file(const Job& arguments);

// ---- sets.cpp ----

/// Parts LOW into its texture sets; none where it has but one. \throws Error(usage), Error(input)
void find_sets(BakeRun& run, const Source& source);
/// Plans or bakes the run's low poly; what is missed, and a map with nothing in it, is told.
/// \param done, share  of all baking: what was done before, and what this is
/// \returns false where it was cancelled. \throws Error
bool make_maps(BakeRun& run, const Source& source, double done = 0, double share = 1);
/// Bakes and writes one set after the other. \returns false where it was cancelled
bool bake_sets(BakeRun& run, const Source& source);

// ---- asset.cpp ----

/// LOW as it is written, with the collision hulls that were taken off.
Mesh with_hulls(const Mesh& low, const Mesh& hulls);

/// Maps of a GLB, glTF or OBJ without --maps: normal and ao...
void start_asset_maps(Job& arguments);
/// ... and those that HIGH's materials and colours have.
void choose_asset_maps(BakeRun& run);
/// For a GLB: lets the bake keep its match where LOW's materials do not tell which of HIGH's they show.
void keep_asset_match(BakeRun& run);
/// Encodes the run's maps as the pictures of the next set, or of the only one.
void encode_asset_maps(BakeRun& run);
/// Notes, for each triangle of LOW that has texels, which special material of HIGH they show; where the match is kept.
void note_materials_hit(BakeRun& run);
/// JSON that says of the asset how it was made.
std::string asset_extras(const BakeRun& run);
/// Bytes of a low poly's GLB with the run's materials, without pictures and asset_extras().
std::uint64_t bytes_without_pictures(const BakeRun& run, const Mesh& low);
/// Writes the run's low poly with all sets' pictures as one asset. \returns false where it was cancelled
bool save_asset(BakeRun& run);
/// Writes the run's low poly with an MTL that names its maps. \returns false where it was cancelled
bool save_obj_with_mtl(BakeRun& run);

// ---- output.cpp ----

/// The legend of a map of names.
inline Json ids_json(const std::vector<IdEntry>& ids) {
  Json json = Json::array();
  for (const IdEntry& id : ids) {
    json.push_back({{"name", id.name}, {"color", id.color}, {"triangles", id.triangles}});
  }
  return json;
}

/// \returns false where it was cancelled
bool announce(BakeRun& run, const std::filesystem::path& path);
/// From values to what a file of the format holds of them.
void store(BakeRun& run, BakedMap& map, const std::string& name);
/// True if texels far from charts are filled by pad_for_mips(): in GLBs and in maps of a low poly that Kiln lays out,
/// unless a padding was chosen.
bool pads_for_mips(const BakeRun& run);

/// Before any work: nothing that a run reads is written over, nor an OBJ of the user's.
/// \param sets  LOW's texture sets, once they are known
void check_outputs(const Job& arguments, const SaveImageOptions& save_options,
                   std::span<const BakedSet> sets = {}, const RunHooks& hooks = {});
SetNames names_of(const Job& arguments, const BakedSet& set);
SetNames names_of(const BakeRun& run);
/// A saved match's file: of a set MATCH_SET.exr, or MATCH.1001.exr.
std::string match_file(const std::string& path, const SetNames& names);
/// Writes the run's low poly, if it was made, with its maps. \returns false where it was cancelled
bool save_low_and_maps(BakeRun& run);
/// Writes what is asked for beside the maps: reasons and the match. \returns false where it was cancelled
bool save_beside_maps(BakeRun& run);
/// Writes what --cage auto found, where that is asked for. \returns false where it was cancelled
bool save_found_cage(BakeRun& run);
/// Writes all files. \returns false where it was cancelled
bool save_outputs(BakeRun& run);

// ---- report.cpp ----

Json report_json(const BakeRun& run, const Device& device, const Source& source, double total);
Json plan_json(const PlannedBake& planned);
Json reasons_json(const Reasons& reasons);

// ---- summary.cpp ----

/// Says what was done, a line a topic.
void add_summary(BakeRun& run, const Source::Stats& source, double total);

// ---- run.cpp ----

/// run() with what the command adds. \param device  opened once the options are checked
JobResult run_job(const std::function<Device()>& device, const Job& job, const Progress& progress,
                  const RunHooks& hooks);

}  // namespace kiln
