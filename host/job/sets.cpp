// Texture sets: several layouts of one low poly, each with maps of its own.
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
#include "job/run.h"
#include "job/transfers.h"
#include "options/parse.h"

namespace kiln {
namespace {

constexpr std::size_t kMostOfName = 100;  // bytes, of the 255 that a file's name may have

/// The beginning of a long text, not cut within a letter of UTF-8.
std::string beginning(const std::string& text) {
  std::size_t end = std::min(text.size(), kMostOfName);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) {
    --end;
  }
  return text.substr(0, end);
}

/// "Texture set 'glass'", for messages.
std::string set_in_words(const TextureSet& set) {
  std::string name = beginning(set.name);
  std::replace(name.begin(), name.end(), '\n', ' ');
  return "Texture set '" + name + (name.size() < set.name.size() ? "...'" : "'") +
         (set.tile.empty() ? "" : ", tile " + set.tile);
}

/// A name as files may have it on any system, and MTL files and shells may name them.
std::string file_word(const std::string& name) {
  constexpr std::string_view kForbidden = "/\\:*?\"'`<>|#%&$;!";
  std::string word;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = byte > 0x20 && byte != 0x7F && kForbidden.find(c) == std::string_view::npos;
    word += plain ? c : '_';
  }
  word = beginning(word);
  return word.empty() ? "set" : word;
}

/// Names that differ, whatever a file system takes for the same: also where the map `bent_normal` of the set `wood`
/// and the map `normal` of `wood_bent` would have one.
void name_files(const Job& job, std::vector<BakedSet>& sets) {
  std::vector<std::string> endings = {""};
  for (const std::string& map : all_maps(job)) endings.push_back("_" + map);
  for (const Pack& pack : parse_packs(job)) endings.push_back("_" + pack.name);
  std::set<std::string> taken;
  const BakedSet* last = nullptr;
  for (BakedSet& set : sets) {
    const BakedSet* const before = std::exchange(last, &set);
    if (before != nullptr && !set.set.tile.empty() && before->set.name == set.set.name) {
      set.word = before->word;  // another tile of the same
      continue;
    }
    const std::string plain = file_word(set.set.name);
    const auto is_free = [&](const std::string& ending) {
      return !taken.contains(lower_case(set.word + ending));
    };
    std::size_t k = 1;
    for (set.word = plain; !std::all_of(endings.begin(), endings.end(), is_free);) {
      set.word = plain + "_" + std::to_string(++k);
    }
    for (const std::string& ending : endings) taken.insert(lower_case(set.word + ending));
  }
}

void size_sets(const BakeRun& run, std::vector<BakedSet>& sets) {
  for (BakedSet& set : sets) {
    set.width = run.options.width;
    set.height = run.options.height;
  }
  for (const SetSize& size : run.arguments.set_sizes) {
    bool found = false;
    for (BakedSet& set : sets) {
      if (set.set.name != size.set) continue;
      set.width = size.width;
      set.height = size.height;
      found = true;
    }
    if (found) continue;
    std::string names;
    for (const BakedSet& set : sets) {
      names += (names.empty() ? "'" : ", '") + beginning(set.set.name) + "'";
    }
    fail_usage(option("size") + " '" + beginning(size.set) +
               "=...' names no texture set of LOW; they are " + names + ".");
  }
}

/// Says which materials or objects have no area in UV space, and so no set.
void warn_of_left_out(BakeRun& run, SetsBy by) {
  if (by == SetsBy::udim) return;
  const Mesh& low = run.low.mesh;
  const auto& names = by == SetsBy::material ? low.material_names : low.object_names;
  const auto& of = by == SetsBy::material ? low.materials : low.objects;
  std::vector<std::uint64_t> triangles(names.size());
  for (const std::uint32_t name : of) ++triangles[name];
  std::set<std::string_view> there;
  for (const BakedSet& set : run.sets) there.insert(set.set.name);
  std::uint64_t count = 0;
  std::string example;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (there.contains(names[i]) || triangles[i] == 0) continue;
    if (count++ == 0) example = beginning(names[i]);
  }
  if (count == 0) return;
  run.warnings.push_back({"set-without-uvs",
                          plural(count, "texture set") + " of LOW, such as '" + example + "', " +
                              (count == 1 ? "has" : "have") +
                              " no area in UV space and so no map. Unwrap what is seen of it.",
                          count});
}

/// Warnings of all sets: one that several have in the same words stands once.
class SetWarnings {
 public:
  void add(const std::string& set, const Warning& warning) {
    const auto [same, is_new] =
        index_.emplace(std::pair(warning.code, warning.message.text()), list_.size());
    if (is_new) {
      list_.push_back({set, warning, 0});
    } else if (Entry& entry = list_[same->second]; entry.set != set) {
      ++entry.more;
    }
  }

  std::vector<Warning> joined() const {
    std::vector<Warning> result;
    for (const auto& [set, warning, more] : list_) {
      const std::string others = more == 0 ? "" : " and " + std::to_string(more) + " more";
      result.push_back({warning.code, set + others + ": " + warning.message, warning.count});
    }
    return result;
  }

 private:
  struct Entry {
    std::string set;  ///< The first that has it
    Warning warning;
    std::size_t more = 0;  ///< Sets that have it, too
  };
  std::vector<Entry> list_;
  std::map<std::pair<std::string, std::string>, std::size_t>
      index_;  ///< In list_, by code and message.
};

/// Each set tells of the surface near its own triangles.
void add_to(std::optional<HighCoverageReport>& sum, const std::optional<HighCoverageReport>& set) {
  if (!set) return;
  if (!sum) sum.emplace();
  const double all = sum->weight + set->weight;
  const auto join = [&](double before, double more) {
    return all > 0 ? (before * sum->weight + more * set->weight) / all : 0;
  };
  const double kept = join(sum->largest, 0), largest = join(0, set->largest);
  if (largest > kept) sum->where = set->where;
  sum->largest = std::max(kept, largest);
  sum->lost = join(sum->lost, set->lost);
  sum->by_copies = join(sum->by_copies, set->by_copies);
  sum->places += set->places;
  sum->weight = all;
}

/// Sums over all sets.
void add_to(BakeReport& sum, const BakeReport& report) {
  sum.mean_abs_distance +=  // times samples, until all are there
      report.mean_abs_distance * static_cast<double>(report.samples - report.missed);
  for (std::uint64_t BakeReport::*count :
       {&BakeReport::texels, &BakeReport::samples, &BakeReport::outward, &BakeReport::inward,
        &BakeReport::cage, &BakeReport::viewed, &BakeReport::closest, &BakeReport::by_uv,
        &BakeReport::passed_over, &BakeReport::uv_copies, &BakeReport::small_triangles,
        &BakeReport::small_without_texel, &BakeReport::missed, &BakeReport::gutter_texels}) {
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
  add_to(sum.recall, report.recall);
  sum.occlusion = report.occlusion;
  sum.ids = report.ids;
  sum.edges = report.edges;
  sum.cage_mesh = report.cage_mesh;
  sum.views = report.views;
  sum.visibility = report.visibility;
}

Json set_json(const BakeRun& run, const BakedSet& set, std::size_t first_file) {
  const BakeReport& report = run.result.report;
  Json json = {{"name", set.set.name},
               {"tile", set.set.tile.empty() ? Json() : Json(set.set.tile)},
               {"by", name_of(Words(kSets), run.arguments.sets)},
               {"width", set.width},
               {"height", set.height},
               {"triangles", set.set.triangles},
               {"texels", describe_texels(report)},
               {"files", std::vector<std::string>(
                             run.outputs.begin() + static_cast<std::ptrdiff_t>(first_file),
                             run.outputs.end())}};
  if (!run.ranges.empty()) json["ranges"] = run.ranges;
  if (!run.mips.empty()) json["mips"] = run.mips;
  if (!run.stored_errors.empty()) json["stored_errors"] = run.stored_errors;
  if (!report.errors.empty()) json["errors"] = describe(report.errors);
  if (report.recall) json["recall"] = describe(*report.recall);
  if (report.uv_copies > 0) {
    json["uv_copies"] = report.uv_copies;
    json["uv_copies_differ"] = report.uv_copies_differ;
  }
  if (report.transitions) json["switches"] = describe(*report.transitions);
  if (report.small_triangles > 0) {
    json["small_charts"] = {{"triangles", report.small_triangles},
                            {"without_texel", report.small_without_texel}};
  }
  if (set.planned) json["auto"] = plan_json(*set.planned);
  if (set.reasons) json["reasons"] = reasons_json(*set.reasons);
  return json;
}

/// \param chosen  by --sets, and not by what overlaps
void take_sets(BakeRun& run, SetsBy by, bool chosen) {
  Job& arguments = run.arguments;
  arguments.sets = by;
  for (TextureSet& set : find_texture_sets(run.low.mesh, by)) {
    run.sets.emplace_back().set = std::move(set);
  }
  const auto is_moved = [](const BakedSet& set) { return set.set.tile_u + set.set.tile_v > 0; };
  refuse_if(chain_obeys(arguments, "match.uv") &&
                (by == SetsBy::udim || std::any_of(run.sets.begin(), run.sets.end(), is_moved)),
            option("match", match_word(arguments)) +
                " finds points at the same UV of the unit square, but LOW's UVs lie on several "
                "UDIM tiles: choose another match, or " +
                option("sets", "none") + " for one map of the unit square.");
  warn_of_left_out(run, by);
  size_sets(run, run.sets);
  name_files(arguments, run.sets);
  check_outputs(arguments, run.save_options, run.sets, run.hooks);
  std::erase_if(run.warnings, [](const Warning& w) { return w.code == "files-overlap"; });
  if (!chosen) {
    run.console.line(std::to_string(run.sets.size()) + " texture sets, a " +
                     (by == SetsBy::udim ? "UDIM tile" : name_of(Words(kSets), arguments.sets)) +
                     " each: their UVs overlap (" + option("sets", "none") + " bakes one map)");
  }
}

/// A mesh for a trial: keeps the UVs of a few thousand triangles of a large LOW, and of all triangles whose UVs coincide
/// with theirs in any tile. Its tangents are placeholders, since MikkTSpace takes long.
Mesh thinned(Mesh low) {
  constexpr double kTriangles = 8192;
  constexpr double kCells = 1024;  // a side of the unit square: those of a part of them are kept
  constexpr std::uint32_t kOrders = 1U << 16U;
  const double share = kTriangles / static_cast<double>(low.triangles.size());
  const auto nowhere = static_cast<std::uint32_t>(low.uvs.size());
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
    const auto column = static_cast<std::uint32_t>((u - std::floor(u)) * kCells);
    const auto row = static_cast<std::uint32_t>((v - std::floor(v)) * kCells);
    const std::uint32_t order = (column * 0x9E3779B1U ^ row * 0x85EBCA77U) * 0xC2B2AE3DU >> 16U;
    if (order >= share * kOrders) corners = {nowhere, nowhere, nowhere};
  }
  return low;
}

/// True if charts of several tiles have the same UVs there, but stand for other places of HIGH.
bool are_tiles(const BakeRun& run, const Source& source) {
  constexpr double kMostDiffer =
      0.05;  // of their area: from there on a warning would say what is lost
  constexpr std::uint32_t kTrialSize = 16;
  try {
    if (find_texture_sets(run.low.mesh, SetsBy::udim).size() < 2) return false;
    // By plain rays: what LOW's layout is does not depend on how it is baked.
    const MatchOptions& match = run.options.match;
    BakeOptions options;
    options.width = options.height = kTrialSize;
    options.match.max_distance = match.max_distance;
    options.match.parts = match.parts;
    options.match.two_sided = match.two_sided;
    options.match.uv_copies = match.uv_copies;
    options.report.recall = 0;
    return bake(source, thinned(run.low.mesh), options).report.uv_copies_differ > kMostDiffer;
  } catch (const Error&) {
    return false;  // The bake itself will say what is wrong.
  }
}

/// True if a match was saved for each tile.
bool has_matches_of_tiles(const BakeRun& run) {
  const std::string& path = run.arguments.load_match;
  std::error_code none;
  if (std::filesystem::exists(path, none)) return false;
  try {
    const std::vector<TextureSet> tiles = find_texture_sets(run.low.mesh, SetsBy::udim);
    return std::filesystem::exists(match_file(path, {"", "", "." + tiles[0].name}), none);
  } catch (const Error&) {
    return false;
  }
}

}  // namespace

void find_sets(BakeRun& run, const Source& source) {
  Job& arguments = run.arguments;
  const bool chosen = arguments.sets.has_value();
  SetsBy by = SetsBy::none;
  if (no_sets(arguments).empty() && !run.low.mesh.uv_triangles.empty()) {
    by = chosen ? *arguments.sets : choose_texture_sets(run.low.mesh);
    const bool by_uvs = chain_obeys(arguments, "match.uv");  // those of the unit square
    if (!chosen && by == SetsBy::none && !by_uvs &&
        (arguments.load_match.empty() ? are_tiles(run, source) : has_matches_of_tiles(run))) {
      by = SetsBy::udim;
    }
  }
  arguments.sets = by;
  if (by != SetsBy::none) return take_sets(run, by, chosen);
  refuse_if(!arguments.set_sizes.empty(), option("size", "NAME=SIZE") +
                                              " is for texture sets, but LOW has one alone: give " +
                                              option("sets", "material") +
                                              ", "
                                              "object or udim, or " +
                                              option("size") + " for all.");
}

bool bake_sets(BakeRun& run, const Source& source) {
  const LowMesh whole = run.low;
  const BakeOptions options = run.options;
  BakeReport sum;
  SetWarnings warnings;
  double done = 0;
  run.result = {};
  if (whole.made && asset_file(run.arguments).empty() && !save_low_and_maps(run)) return false;
  run.low.mesh.tangents = tangents_of(whole.mesh);
  run.low.made = false;  // it was written already
  for (BakedSet& set : run.sets) {
    run.set = &set;
    lay_out_set(whole.mesh, set.set, run.low.mesh);
    run.options = options;
    run.options.width = set.width;
    run.options.height = set.height;
    const double share = 1.0 / static_cast<double>(run.sets.size());
    const std::size_t files = run.outputs.size(), told = run.warnings.size();
    run.ranges = Json::object();
    run.stored_errors = Json::object();
    run.mips = {};
    try {
      if (!make_maps(run, source, done, share)) return false;
    } catch (const OptionError& error) {
      throw OptionError(set_in_words(set.set) + ": " + error.message(), error.code(), error.id());
    } catch (const Error& error) {
      throw Error(error.code(), set_in_words(set.set) + ": " + error.message());
    }
    set.planned = std::exchange(run.planned, std::nullopt);
    if (set.planned) {
      set.width = set.planned->chosen.width;
      set.height = set.planned->chosen.height;
    }
    if (!save_low_and_maps(run) || !save_beside_maps(run)) return false;
    set.reasons = std::exchange(run.reasons, std::nullopt);
    run.set_reports.push_back(set_json(run, set, files));
    const auto first = run.warnings.begin() + static_cast<std::ptrdiff_t>(told);
    std::vector<Warning>& own = run.result.report.warnings;
    own.insert(own.end(), first, run.warnings.end());
    run.warnings.erase(first, run.warnings.end());
    for (const Warning& warning : own) {
      if (warning.code != "uv-missing")
        warnings.add(set_in_words(set.set), warning);  // of other sets
    }
    add_to(sum, run.result.report);
    done += share;
  }
  if (sum.samples > sum.missed) {
    sum.mean_abs_distance /= static_cast<double>(sum.samples - sum.missed);
  }
  sum.warnings = warnings.joined();
  run.set = nullptr;
  run.low = whole;
  run.options = options;
  run.result = {};
  run.result.report = std::move(sum);
  if (asset_file(run.arguments).empty()) return true;
  return writes_gltf(run.arguments) ? save_asset(run) : save_obj_with_mtl(run);
}

}  // namespace kiln
