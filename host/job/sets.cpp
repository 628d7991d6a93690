// Bakes texture sets: several UV layouts of one low poly, each with maps of its own.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "job/check_result.h"
#include "job/map_words.h"
#include "job/stages.h"
#include "job/transfers.h"
#include "options/parse.h"
#include "source/set_layouts.h"

namespace kiln {
namespace {

// Maximum bytes of a texture set's name within a file name, which may have 255 bytes.
constexpr std::size_t kMaxNameBytes = 100;

/// Truncates a text to kMaxNameBytes without splitting a UTF-8 sequence.
std::string truncate_name(const std::string& text) {
  std::size_t end = std::min(text.size(), kMaxNameBytes);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) {
    --end;
  }
  return text.substr(0, end);
}

/// Names a texture set in messages, such as "Texture set 'glass'".
std::string texture_set_label(const TextureSet& set) {
  std::string name = truncate_name(set.name);
  std::replace(name.begin(), name.end(), '\n', ' ');
  return "Texture set '" + name + (name.size() < set.name.size() ? "...'" : "'") +
         (set.tile.empty() ? "" : ", tile " + set.tile);
}

/// Replaces characters that file systems, MTL files or shells do not accept in file names.
std::string safe_file_name(const std::string& name) {
  constexpr std::string_view kForbiddenCharacters = "/\\:*?\"'`<>|#%&$;!";
  std::string word;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool is_allowed =
        byte > 0x20 && byte != 0x7F && kForbiddenCharacters.find(c) == std::string_view::npos;
    word += is_allowed ? c : '_';
  }
  word = truncate_name(word);
  return word.empty() ? "set" : word;
}

/// Gives each set a name for its files. Names differ in more than case, and no combination of set and map occurs twice,
/// as would "bent_normal" of `wood` and "normal" of `wood_bent`.
void assign_file_names(const Job& job, std::vector<BakedSet>& sets) {
  std::vector<std::string> file_name_endings = {""};
  for (const std::string& map : all_map_names(job)) file_name_endings.push_back("_" + map);
  for (const Pack& pack : parse_packs(job)) file_name_endings.push_back("_" + pack.name);
  std::set<std::string> used_names;
  const BakedSet* last = nullptr;
  for (BakedSet& set : sets) {
    const BakedSet* const previous_set = std::exchange(last, &set);
    if (previous_set != nullptr && !set.set.tile.empty() &&
        previous_set->set.name == set.set.name) {
      set.word = previous_set->word;  // tiles of one set share its name
      continue;
    }
    const std::string safe_name = safe_file_name(set.set.name);
    const auto is_unused = [&](const std::string& ending) {
      return !used_names.contains(lower_case(set.word + ending));
    };
    std::size_t k = 1;
    for (set.word = safe_name;
         !std::all_of(file_name_endings.begin(), file_name_endings.end(), is_unused);) {
      set.word = safe_name + "_" + std::to_string(++k);
    }
    for (const std::string& ending : file_name_endings)
      used_names.insert(lower_case(set.word + ending));
  }
}

void assign_sizes(const Job& job, const BakeOptions& options, std::vector<BakedSet>& sets) {
  for (BakedSet& set : sets) {
    set.width = options.width;
    set.height = options.height;
  }
  for (const SetSize& size : job.set_sizes) {
    bool is_found = false;
    for (BakedSet& set : sets) {
      if (set.set.name != size.set) continue;
      set.width = size.width;
      set.height = size.height;
      is_found = true;
    }
    if (is_found) continue;
    std::string names;
    for (const BakedSet& set : sets) {
      names += (names.empty() ? "'" : ", '") + truncate_name(set.set.name) + "'";
    }
    fail_usage(option("size") + " '" + truncate_name(size.set) +
               "=...' names no texture set of LOW; its sets are " + names + ".");
  }
}

/// Warns of materials or objects without area in UV space, which form no set.
void warn_of_left_out(const Mesh& low, const FoundSets& found, RunLog& log) {
  const SetsBy criterion = found.by;
  if (criterion == SetsBy::udim) return;
  const auto& names = criterion == SetsBy::material ? low.material_names : low.object_names;
  const auto& set_of_triangle = criterion == SetsBy::material ? low.materials : low.objects;
  std::vector<std::uint64_t> triangles(names.size());
  for (const std::uint32_t name : set_of_triangle) ++triangles[name];
  std::set<std::string_view> names_of_sets;
  for (const BakedSet& set : found.sets) names_of_sets.insert(set.set.name);
  std::uint64_t count = 0;
  std::string example;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names_of_sets.contains(names[i]) || triangles[i] == 0) continue;
    if (count++ == 0) example = truncate_name(names[i]);
  }
  if (count == 0) return;
  log.warnings.push_back(
      {"set-without-uvs",
       plural(count, "texture set") + " of LOW, such as '" + example + "', " +
           (count == 1 ? "has" : "have") +
           " no area in UV space and therefore no map. Unwrap its visible faces.",
       count});
}

/// Collects the warnings of all sets. A warning that several sets have with the same text is kept once.
class SetWarnings {
 public:
  void add(const std::string& set, const Warning& warning) {
    const auto [same, is_new] = index_by_text_.emplace(
        std::pair(warning.code, warning.message.text()), set_warnings_.size());
    if (is_new) {
      set_warnings_.push_back({set, warning, 0});
    } else if (SetWarning& entry = set_warnings_[same->second]; entry.set != set) {
      ++entry.further_sets;
    }
  }

  std::vector<Warning> joined_warnings() const {
    std::vector<Warning> result;
    for (const auto& [set, warning, further_sets] : set_warnings_) {
      const std::string others_text =
          further_sets == 0 ? "" : " and " + std::to_string(further_sets) + " more";
      result.push_back({warning.code, set + others_text + ": " + warning.message, warning.count});
    }
    return result;
  }

 private:
  struct SetWarning {
    std::string set;  ///< The first set with the warning
    Warning warning;
    std::size_t further_sets = 0;  ///< Number of further sets with the warning
  };
  std::vector<SetWarning> set_warnings_;
  std::map<std::pair<std::string, std::string>, std::size_t>
      index_by_text_;  ///< Index in set_warnings_, by code and message
};

/// Adds a set's report of the high poly's coverage to the sum. Shares are weighted by the surface that a report covers.
void accumulate(std::optional<HighCoverageReport>& sum,
                const std::optional<HighCoverageReport>& set) {
  if (!set) return;
  if (!sum) sum.emplace();
  const double total_weight = sum->weight + set->weight;
  const auto weighted_mean = [&](double before, double added_value) {
    return total_weight > 0 ? (before * sum->weight + added_value * set->weight) / total_weight : 0;
  };
  const double previous_largest = weighted_mean(sum->largest, 0),
               largest = weighted_mean(0, set->largest);
  if (largest > previous_largest) sum->where = set->where;
  sum->largest = std::max(previous_largest, largest);
  sum->lost = weighted_mean(sum->lost, set->lost);
  sum->by_copies = weighted_mean(sum->by_copies, set->by_copies);
  sum->places += set->places;
  sum->weight = total_weight;
}

/// Adds the report of a set to the sum of all sets.
void accumulate(BakeReport& sum, const BakeReport& report) {
  sum.mean_abs_distance +=  // a sum over matched samples; bake_sets() divides it by the number of these samples
      report.mean_abs_distance * static_cast<double>(report.samples - report.missed);
  for (std::uint64_t BakeReport::*count :
       {&BakeReport::texels, &BakeReport::samples, &BakeReport::outward, &BakeReport::inward,
        &BakeReport::cage, &BakeReport::viewed, &BakeReport::closest, &BakeReport::by_uv,
        &BakeReport::passed_over, &BakeReport::uv_copies, &BakeReport::small_triangles,
        &BakeReport::small_triangles_without_texel, &BakeReport::missed,
        &BakeReport::gutter_texels}) {
    sum.*count += report.*count;
  }
  for (double BakeReport::*seconds :
       {&BakeReport::seconds_build, &BakeReport::seconds_texels, &BakeReport::seconds_match,
        &BakeReport::seconds_detail, &BakeReport::seconds_recall, &BakeReport::seconds_image,
        &BakeReport::seconds_mips, &BakeReport::seconds_errors}) {
    sum.*seconds += report.*seconds;
  }
  sum.max_distance = std::max(sum.max_distance, report.max_distance);
  sum.curvature_radius = std::max(sum.curvature_radius, report.curvature_radius);
  sum.uv_copies_differ = std::max(sum.uv_copies_differ, report.uv_copies_differ);
  sum.peak_device_bytes = std::max(sum.peak_device_bytes, report.peak_device_bytes);
  accumulate(sum.recall, report.recall);
  sum.occlusion = report.occlusion;
  sum.ids = report.ids;
  sum.edges = report.edges;
  sum.cage_mesh = report.cage_mesh;
  sum.views = report.views;
  sum.visibility = report.visibility;
}

/// Describes a texture set for the report. \param first_file  index of the set's first file in JobOutputs::files
Json set_json(const RunContext& run, const BakedSet& set, const BakedLayout& baked,
              const JobOutputs& outputs, std::size_t first_file) {
  const BakeReport& report = baked.result.report;
  const StoredMaps& stored = baked.stored;
  Json json = {{"name", set.set.name},
               {"tile", set.set.tile.empty() ? Json() : Json(set.set.tile)},
               {"by", name_of(Words(kSetsWords), run.job.sets)},
               {"width", set.width},
               {"height", set.height},
               {"triangles", set.set.triangles},
               {"texels", describe_texels(report)},
               {"files", std::vector<std::string>(
                             outputs.files.begin() + static_cast<std::ptrdiff_t>(first_file),
                             outputs.files.end())}};
  if (!stored.ranges.empty()) json["ranges"] = stored.ranges;
  if (!stored.mips.empty()) json["mips"] = stored.mips;
  if (!stored.errors.empty()) json["stored_errors"] = stored.errors;
  if (!report.errors.empty()) json["errors"] = describe(report.errors);
  if (report.recall) json["recall"] = describe(*report.recall);
  if (report.uv_copies > 0) {
    json["uv_copies"] = report.uv_copies;
    json["uv_copies_differ"] = report.uv_copies_differ;
  }
  if (report.transitions) json["switches"] = describe(*report.transitions);
  if (report.small_triangles > 0) {
    json["small_charts"] = {{"triangles", report.small_triangles},
                            {"without_texel", report.small_triangles_without_texel}};
  }
  if (set.planned) json["auto"] = plan_json(*set.planned);
  if (set.reasons) json["reasons"] = reasons_json(*set.reasons);
  return json;
}

/// Makes texture sets by a criterion, and checks them. \param is_user_choice  true if --sets chose the criterion
FoundSets make_sets(const BakeScene& scene, const BakeOptions& options, SetsBy by,
                    bool is_user_choice) {
  RunLog& log = scene.run.log;
  Job job = scene.run.job;
  job.sets = by;
  FoundSets found;
  found.by = by;
  for (TextureSet& set : find_texture_sets(scene.low.mesh, by)) {
    found.sets.emplace_back().set = std::move(set);
  }
  // Each set takes at least 7 ms and a file, so 10,000 take a minute. More sets are most likely a mistake of an
  // exporter.
  constexpr std::size_t kMaxTextureSets = 20000;
  refuse_if(found.sets.size() > kMaxTextureSets,
            "LOW has " + with_commas(found.sets.size()) + " texture sets (" +
                option("sets", name_of(Words(kSetsWords), job.sets)) + "), but at most " +
                with_commas(kMaxTextureSets) + " can be baked: join its " +
                (by == SetsBy::object ? "objects"
                 : by == SetsBy::udim ? "tiles"
                                      : "materials") +
                ", or give " + option("unwrap") + " with " + option("sets", "one") +
                " for new UVs in one atlas.");
  const auto is_moved = [](const BakedSet& set) { return set.set.tile_u + set.set.tile_v > 0; };
  refuse_if(any_match_uses_option(job, "match.uv") &&
                (by == SetsBy::udim || std::any_of(found.sets.begin(), found.sets.end(), is_moved)),
            option("match", match_name(job)) +
                " finds points at the same UV of the unit square, but LOW's UVs lie on several "
                "UDIM tiles: choose another match, or " +
                option("sets", "none") + " for one map of the unit square.");
  warn_of_left_out(scene.low.mesh, found, log);
  assign_sizes(job, options, found.sets);
  assign_file_names(job, found.sets);
  check_outputs(job, found.sets, scene.run.hooks);
  std::erase_if(log.warnings, [](const Warning& w) { return w.code == "files-overlap"; });
  if (!is_user_choice) {
    log.line(std::to_string(found.sets.size()) + " texture sets, one per " +
             (by == SetsBy::udim ? "UDIM tile" : name_of(Words(kSetsWords), job.sets)) +
             ": their UVs overlap (" + option("sets", "none") + " bakes one map)");
  }
  return found;
}

/// Makes a mesh for a trial bake: a few thousand triangles of a large LOW keep their UVs, and so do all triangles whose
/// UVs coincide with theirs in any tile. Its tangents are placeholders, since MikkTSpace is slow.
Mesh keep_trial_uvs(Mesh low) {
  constexpr double kTrialTriangles = 8192;
  // Grid cells along a side of the unit square. A hash selects the cells whose triangles keep their UVs.
  constexpr double kTrialGridCells = 1024;
  constexpr std::uint32_t kHashRange = 1U << 16U;
  const double detail_ratio = kTrialTriangles / static_cast<double>(low.triangles.size());
  const auto nan_uv_index = static_cast<std::uint32_t>(low.uvs.size());
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  low.uvs.push_back({kNaN, kNaN});
  low.tangents.assign(3 * low.triangles.size(), {{1, 0, 0}, 1});
  for (Triangle& corners : low.uv_triangles) {
    double u = 0, v = 0;
    for (const std::uint32_t corner : corners) {
      u += double{low.uvs[corner].x} / 3;
      v += double{low.uvs[corner].y} / 3;
    }
    if (!std::isfinite(u) || !std::isfinite(v)) continue;
    const auto column = static_cast<std::uint32_t>((u - std::floor(u)) * kTrialGridCells);
    const auto row = static_cast<std::uint32_t>((v - std::floor(v)) * kTrialGridCells);
    const std::uint32_t hash = (column * 0x9E3779B1U ^ row * 0x85EBCA77U) * 0xC2B2AE3DU >> 16U;
    if (hash >= detail_ratio * kHashRange) corners = {nan_uv_index, nan_uv_index, nan_uv_index};
  }
  return low;
}

/// True if charts of several UDIM tiles have the same UVs within their tiles, but represent different places of HIGH.
bool tiles_show_different_surfaces(const Mesh& low, const Source& source,
                                   const MatchOptions& match) {
  constexpr double kMaxCopyDifference =
      0.05;  // largest share of the copies' area that may differ; with more, one map would lose visible detail
  constexpr std::uint32_t kTrialMapSize = 16;
  try {
    if (find_texture_sets(low, SetsBy::udim).size() < 2) return false;
    // The trial uses plain rays: the surface that LOW's UVs represent does not depend on the bake's options.
    BakeOptions options;
    options.width = options.height = kTrialMapSize;
    options.match.max_distance = match.max_distance;
    options.match.parts = match.parts;
    options.match.two_sided = match.two_sided;
    options.match.uv_copies = match.uv_copies;
    options.report.recall = 0;
    return bake(source, keep_trial_uvs(low), options).report.uv_copies_differ > kMaxCopyDifference;
  } catch (const Error&) {
    return false;  // the bake itself reports the error
  }
}

/// True if a saved match exists for each tile.
bool has_saved_match_per_tile(const Mesh& low, const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) return false;
  try {
    const std::vector<TextureSet> tiles = find_texture_sets(low, SetsBy::udim);
    return std::filesystem::exists(match_file(path, {"", "", "." + tiles[0].name}), ignored);
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

FoundSets find_sets(const BakeScene& scene, const Source& source, const BakeOptions& options) {
  const Job& job = scene.run.job;
  const Mesh& low = scene.low.mesh;
  const bool is_user_choice = job.sets.has_value();
  SetsBy criterion = SetsBy::none;
  if (explain_single_set(job).empty() && !low.uv_triangles.empty()) {
    criterion = is_user_choice ? *job.sets : choose_texture_sets(low);
    const bool matches_by_uvs = any_match_uses_option(
        job, "match.uv");  // a match by UVs finds points in the unit square alone
    if (!is_user_choice && criterion == SetsBy::none && !matches_by_uvs &&
        (job.load_match.empty() ? tiles_show_different_surfaces(low, source, options.match)
                                : has_saved_match_per_tile(low, job.load_match))) {
      criterion = SetsBy::udim;
    }
  }
  if (criterion != SetsBy::none) return make_sets(scene, options, criterion, is_user_choice);
  refuse_if(!job.set_sizes.empty(), option("size", "NAME=SIZE") +
                                        " is for texture sets, but LOW has only one: give " +
                                        option("sets", "material") +
                                        ", "
                                        "object or udim, or " +
                                        option("size") + " for all.");
  return {};
}

namespace {

/// Bakes one set by bake_layout(); errors name the set.
BakedLayout bake_set(const BakeScene& scene, const Source& source, const BakeOptions& options) {
  const std::string name = texture_set_label(scene.set->set);
  try {
    return bake_layout(scene, source, options);
  } catch (const Cancelled&) {
    throw;
  } catch (const OptionError& error) {
    throw OptionError(name + ": " + error.message(), error.code(), error.id());
  } catch (const Error& error) {
    throw Error(error.code(), name + ": " + error.message());
  }
}

}  // namespace

BakedLayout bake_sets(const RunContext& run, const LoadedHigh& high, const LowMesh& low,
                      std::vector<BakedSet>& sets, const Source& source, const BakeOptions& options,
                      AssetParts& asset, Json& set_reports, JobOutputs& outputs) {
  const std::string file = asset_file(run.job);
  BakedLayout sums{.options = options};
  if (low.made && file.empty()) {
    BakedLayout empty_layout;
    save_low_and_maps({run, high, low, sets}, source, file, nullptr, empty_layout, asset, outputs);
  }
  LowMesh low_of_set = low;
  low_of_set.mesh.tangents = tangents_of(low.mesh);
  low_of_set.made = false;  // the low poly is already written
  SetLayouts layouts(source, low.mesh, low_of_set.mesh);
  BakeReport sum;
  SetWarnings warnings;
  const double set_share = 1.0 / static_cast<double>(sets.size());
  double progress_done = 0;
  for (BakedSet& set : sets) {
    const BakeScene scene{run, high, low_of_set, sets, &set};
    layouts.lay_out(set.set);
    BakeOptions options_of_set = options;
    options_of_set.width = set.width;
    options_of_set.height = set.height;
    options_of_set.progress = bake_progress(run.log, progress_done, set_share);
    const std::size_t first_file = outputs.files.size();
    const auto former_warnings = static_cast<std::ptrdiff_t>(run.log.warnings.size());
    BakedLayout baked = bake_set(scene, source, options_of_set);
    drop_unwritten_maps(run.hooks, baked);
    set.planned = std::move(baked.planned);
    if (set.planned) {
      set.width = set.planned->chosen.width;
      set.height = set.planned->chosen.height;
    }
    save_low_and_maps(scene, source, file, nullptr, baked, asset, outputs);
    save_beside_maps(scene, baked, outputs);
    set.reasons = std::move(baked.reasons);
    set_reports.push_back(set_json(run, set, baked, outputs, first_file));
    std::vector<Warning>& set_warnings = baked.result.report.warnings;
    const auto first = run.log.warnings.begin() + former_warnings;
    set_warnings.insert(set_warnings.end(), first, run.log.warnings.end());
    run.log.warnings.erase(first, run.log.warnings.end());
    for (const Warning& warning : set_warnings) {
      // triangles without UVs belong to other sets
      if (warning.code != "uv-missing") warnings.add(texture_set_label(set.set), warning);
    }
    accumulate(sum, baked.result.report);
    sums.stored.copy_shared_properties(baked.stored);
    progress_done += set_share;
  }
  if (sum.samples > sum.missed) {
    sum.mean_abs_distance /= static_cast<double>(sum.samples - sum.missed);
  }
  sum.warnings = warnings.joined_warnings();
  sums.result.report = std::move(sum);
  return sums;
}

void write_asset_of_sets(const BakeScene& scene, const BakedLayout& sums, const Json& set_reports,
                         AssetParts& asset, JobOutputs& outputs) {
  const std::string file = asset_file(scene.run.job);
  if (file.empty()) return;
  if (writes_gltf(scene.run.job)) {
    write_asset(scene, file, asset_extras(scene, sums.result.report, {}, set_reports), asset,
                outputs);
  } else {
    write_obj_with_mtl(scene, asset, outputs);
  }
}

}  // namespace kiln
