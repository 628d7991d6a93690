// Texture sets: several layouts of one low poly, each with maps of its own.
#include <algorithm>
#include <cstdint>
#include <set>

#include "arguments/parse.h"
#include "command/bake_run.h"
#include "report/check_result.h"

namespace kiln::cli {
namespace {

/// A name as files may have it on any system.
std::string file_word(const std::string& name) {
  constexpr std::string_view kForbidden = "/\\:*?\"<>|";
  constexpr std::size_t kMost = 100;  // bytes, of the 255 that a name may have
  std::string word;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = byte > 0x20 && byte != 0x7F && kForbidden.find(c) == std::string_view::npos;
    word += plain ? c : '_';
  }
  std::size_t end = std::min(word.size(), kMost);
  while (end > 0 && end < word.size() && (static_cast<unsigned char>(word[end]) & 0xC0U) == 0x80U) {
    --end;  // not within a letter of UTF-8
  }
  word.resize(end);
  return word.empty() ? "set" : word;
}

/// Names that differ, whatever a file system takes for the same.
void name_files(std::vector<BakedSet>& sets) {
  std::set<std::string> taken;
  for (BakedSet& set : sets) {
    const std::string plain = file_word(set.set.name);
    for (std::size_t k = 1;; ++k) {
      set.word = k == 1 ? plain : plain + "_" + std::to_string(k);
      if (taken.insert(lower_case(set.word)).second) break;
    }
  }
}

void size_sets(const BakeRun& run, std::vector<BakedSet>& sets) {
  for (BakedSet& set : sets) {
    set.width = run.options.width;
    set.height = run.options.height;
  }
  for (const SetSize& size : run.arguments.set_sizes) {
    const auto found = std::find_if(sets.begin(), sets.end(),
                                    [&](const BakedSet& set) { return set.set.name == size.set; });
    if (found == sets.end()) {
      std::string names;
      for (const BakedSet& set : sets) names += (names.empty() ? "'" : ", '") + set.set.name + "'";
      fail_usage("--size '" + size.set + "=...' names no texture set of LOW; they are " + names +
                 ".");
    }
    found->width = size.width;
    found->height = size.height;
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
  std::uint64_t count = 0;
  std::string example;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool there = std::any_of(run.sets.begin(), run.sets.end(),
                                   [&](const BakedSet& set) { return set.set.name == names[i]; });
    if (there || triangles[i] == 0) continue;
    if (count++ == 0) example = names[i];
  }
  if (count == 0) return;
  run.warnings.push_back({"set-without-uvs",
                          plural(count, "texture set") + " of LOW, such as '" + example + "', " +
                              (count == 1 ? "has" : "have") +
                              " no area in UV space and so no map. Unwrap what is seen of it.",
                          count});
}

/// What all sets come to.
void add_to(BakeReport& sum, const BakeReport& report) {
  for (std::uint64_t BakeReport::*count :
       {&BakeReport::texels, &BakeReport::samples, &BakeReport::outward, &BakeReport::inward,
        &BakeReport::cage, &BakeReport::viewed, &BakeReport::closest, &BakeReport::by_uv,
        &BakeReport::passed_over, &BakeReport::uv_copies, &BakeReport::small_triangles,
        &BakeReport::small_without_texel, &BakeReport::missed, &BakeReport::gutter_texels}) {
    sum.*count += report.*count;
  }
  for (double BakeReport::*seconds :
       {&BakeReport::seconds_build, &BakeReport::seconds_texels, &BakeReport::seconds_match,
        &BakeReport::seconds_detail, &BakeReport::seconds_image, &BakeReport::seconds_mips,
        &BakeReport::seconds_errors}) {
    sum.*seconds += report.*seconds;
  }
  sum.max_distance = std::max(sum.max_distance, report.max_distance);
  sum.curvature_radius = std::max(sum.curvature_radius, report.curvature_radius);
  sum.uv_copies_differ = std::max(sum.uv_copies_differ, report.uv_copies_differ);
  sum.peak_device_bytes = std::max(sum.peak_device_bytes, report.peak_device_bytes);
}

}  // namespace

void find_sets(BakeRun& run) {
  BakeJob& arguments = run.arguments;
  const bool chosen = arguments.sets.has_value();
  SetsBy by = SetsBy::none;
  if (no_sets(arguments).empty() && !run.low.mesh.uv_triangles.empty()) {
    by = chosen ? *arguments.sets : choose_texture_sets(run.low.mesh);
  }
  arguments.sets = by;
  if (by != SetsBy::none) {
    for (TextureSet& set : find_texture_sets(run.low.mesh, by)) {
      run.sets.push_back({std::move(set), 0, 0, ""});
    }
  }
  if (run.sets.empty() && !arguments.set_sizes.empty()) {
    fail_usage(
        "--size NAME=SIZE is for texture sets, but LOW has one alone: give --sets material, "
        "object or udim, or --size for all.");
  }
  if (run.sets.empty()) return;
  warn_of_left_out(run, by);
  size_sets(run, run.sets);
  name_files(run.sets);
  check_outputs(arguments, run.save_options, run.sets);
  std::erase_if(run.warnings, [](const Warning& w) { return w.code == "files-overlap"; });
  if (!chosen) {
    run.console.line(std::to_string(run.sets.size()) + " texture sets, a " +
                     (by == SetsBy::udim ? "UDIM tile" : name_of(Words(kSets), arguments.sets)) +
                     " each: their UVs overlap (--sets none bakes one map)");
  }
}

bool bake_sets(BakeRun& run, const Source& source) {
  const LowMesh whole = run.low;
  const BakeOptions options = run.options;
  BakeReport sum;
  double done = 0;
  run.result = {};
  if (whole.made && run.arguments.asset.empty() && !save_low_and_maps(run)) return false;
  Mesh low = whole.mesh;
  low.tangents = tangents_of(low);
  for (const BakedSet& set : run.sets) {
    const SetNames names = names_of(run.arguments, set);
    run.low.mesh = low_of_set(low, set.set);
    run.low.stem = names.stem;
    run.low.made = false;  // it was written already
    run.tile = names.tile;
    run.options = options;
    run.options.width = set.width;
    run.options.height = set.height;
    run.options.report.recall = 0;  // HIGH's surface is shared out among the sets
    const double share = 1.0 / static_cast<double>(run.sets.size());
    run.options.progress = [&](double part, std::string_view stage) {
      return run.console.progress(kAtBake + (kAtSave - kAtBake) * (done + share * part), stage);
    };
    try {
      bake_maps(run, source);
    } catch (const Error& error) {
      throw Error(error.code(), "Texture set '" + set.set.name + "': " + error.what());
    }
    if (run.result.cancelled) return false;
    std::erase_if(run.result.report.warnings,
                  [](const Warning& warning) { return warning.code == "uv-missing"; });
    for (Warning& warning : run.result.report.warnings) {
      warning.message = "Texture set '" + set.set.name + "': " + warning.message;
    }
    const std::size_t before = run.outputs.size();
    run.ranges = Json::object();
    run.stored_errors = Json::object();
    run.mips = {};
    if (!save_low_and_maps(run)) return false;
    const BakeReport& report = run.result.report;
    Json json = {{"name", set.set.name},
                 {"by", name_of(Words(kSets), run.arguments.sets)},
                 {"width", set.width},
                 {"height", set.height},
                 {"triangles", set.set.triangles},
                 {"texels", describe_texels(report)},
                 {"files", std::vector<std::string>(
                               run.outputs.begin() + static_cast<std::ptrdiff_t>(before),
                               run.outputs.end())}};
    if (!run.ranges.empty()) json["ranges"] = run.ranges;
    if (!run.mips.empty()) json["mips"] = run.mips;
    if (!run.stored_errors.empty()) json["stored_errors"] = run.stored_errors;
    if (!report.errors.empty()) json["errors"] = describe(report.errors);
    run.set_reports.push_back(std::move(json));
    sum.mean_abs_distance +=
        report.mean_abs_distance * static_cast<double>(report.samples - report.missed);
    add_to(sum, report);
    sum.warnings.insert(sum.warnings.end(), report.warnings.begin(), report.warnings.end());
    sum.occlusion = report.occlusion;
    sum.ids = report.ids;
    sum.edges = report.edges;
    sum.cage_mesh = report.cage_mesh;
    sum.views = report.views;
    sum.visibility = report.visibility;
    done += share;
  }
  if (sum.samples > sum.missed) {
    sum.mean_abs_distance /= static_cast<double>(sum.samples - sum.missed);
  }
  run.low = whole;
  run.options = options;
  run.tile.clear();
  run.result = {};
  run.result.report = std::move(sum);
  if (run.arguments.asset.empty()) return true;
  return writes_gltf(run.arguments) ? save_asset(run) : save_obj_with_mtl(run);
}

}  // namespace kiln::cli
