#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

#include "arguments/bake_arguments.h"
#include "arguments/low_record.h"
#include "arguments/option_table.h"
#include "arguments/parse.h"
#include "arguments/paths.h"
#include "commands.h"
#include "interrupt.h"
#include "kiln/kiln.h"
#include "report/causes.h"
#include "report/check_result.h"
#include "report/console.h"
#include "report/missed_patch.h"
#include "report/report.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

/// Shares of the whole work at which the stages begin, for a bar that moves steadily.
constexpr double kAtLow = 0.08, kAtSource = 0.15, kAtBake = 0.3, kAtSave = 0.8;

struct LowMesh {
  Mesh mesh;
  std::string stem;   // of the maps' names
  bool made = false;  // by us, or its UVs: it is written beside the maps
  std::optional<SimplifyReport> simplified;
  std::optional<UnwrapReport> unwrapped;
};

/// The light mesh that is written beside the maps, where one is; and the maps' stem.
std::string low_stem(const BakeArguments& arguments) {
  if (arguments.low.empty()) return fs::path(arguments.high).stem().string() + "_low";
  return fs::path(arguments.low).stem().string() + (arguments.unwrap ? "_unwrapped" : "");
}

/// What the low poly comes from: a file that is read.
const std::string& low_source(const BakeArguments& arguments) {
  return arguments.low.empty() ? arguments.high : arguments.low;
}

/// Reads LOW; or makes one from HIGH; or unwraps the given one.
LowMesh prepare_low(const BakeArguments& arguments, const DenseInput& dense, Console& console,
                    std::vector<Warning>& warnings) {
  const Mesh& high = dense.mesh;
  const auto [width, height] = parse_size(arguments.size);
  UnwrapOptions unwrap_options;
  unwrap_options.size = std::max(16U, std::min(width, height));
  LowMesh low;
  if (!arguments.low.empty()) {
    console.progress(kAtLow, "reading " + arguments.low);
    low.mesh = load_mesh(arguments.low, &warnings);
    if (low.mesh.triangles.size() > high.triangles.size()) {
      warnings.push_back({"low-denser",
                          "LOW '" + arguments.low + "' has more triangles than HIGH '" +
                              arguments.high + "': are they the wrong way round?",
                          1});
    }
    low.stem = low_stem(arguments);
    if (!arguments.unwrap) return low;
  } else if (onto_plane(arguments)) {
    low.mesh = height_field_plane(*dense.heights, height_field_options(arguments.heights));
    low.made = true;
    low.stem = low.mesh.name = low_stem(arguments);
    return low;
  } else {
    console.progress(kAtLow, "simplifying");
    low.simplified.emplace();
    SimplifyOptions options;
    options.faces = arguments.faces;
    options.height_field = dense.heights.has_value();
    // Points at the same UV: the light mesh needs the layout of the dense one.
    options.keep_uvs = arguments.match == "uv" && !dense.heights && !high.uv_triangles.empty();
    if (!arguments.max_error.empty() && arguments.match != "auto") {
      options.max_error = parse_error_bound(arguments.max_error);
    }
    low.mesh = simplify(high, options, &*low.simplified);
    low.stem = low_stem(arguments);
    low.made = true;
    if (dense.heights) {
      lay_out_over_height_field(low.mesh, *dense.heights, height_field_options(arguments.heights));
      low.mesh.name = low.stem;
      return low;
    }
    if (options.keep_uvs) {
      low.mesh.name = low.stem;
      return low;
    }
  }
  low.made = true;
  low.unwrapped.emplace();
  low.mesh = unwrap(low.mesh, unwrap_options, &*low.unwrapped);
  low.mesh.name = low.stem;
  return low;
}

std::string percent(std::uint64_t part, std::uint64_t whole) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f%%",
                whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole));
  return text;
}

/// "outward 60.12%, inward 39.80%": the ways that found something.
std::string shares(const BakeReport& report) {
  std::string text;
  for (const auto& [name, count] :
       {std::pair{"outward", report.outward},
        std::pair{"outward past a nearer face", report.passed_over}, std::pair{"inward", report.inward},
        std::pair{"cage", report.cage}, std::pair{"views", report.viewed},
        std::pair{"closest", report.closest}, std::pair{"UV", report.by_uv}}) {
    if (count == 0) continue;
    text += (text.empty() ? "" : ", ") + std::string(name) + " " + percent(count, report.samples);
  }
  return text.empty() ? "none" : text;
}

/// The levels of a map's mip-map, and the file that each is in.
Json describe_levels(const BakedMap& map, const std::vector<fs::path>& files) {
  Json levels = Json::array();
  for (std::size_t level = 0; level <= map.mips.size(); ++level) {
    const Image& image = level == 0 ? map.image : map.mips[level - 1];
    levels.push_back({{"level", level},
                      {"width", image.width},
                      {"height", image.height},
                      {"file", files[std::min(level, files.size() - 1)].string()}});
  }
  return levels;
}

/// One line about the views.
std::string summary(const ViewReport& views, double diagonal) {
  char text[320];
  const std::size_t count = views.directions.size();
  std::snprintf(text, sizeof text,
                "%zu view%s of %u x %u%s, a pixel is %.3g%% of the diagonal; %.1f%% of the dense "
                "surface has triangles smaller than that",
                count, count == 1 ? "" : "s", views.size, views.size,
                views.height_field ? " (a height field)" : "", 100 * views.pixel / diagonal,
                100 * views.undersampled);
  std::string line = text;
  if (!views.coverage.empty()) {
    line += "; seen after each:";
    for (const double share : views.coverage) {
      std::snprintf(text, sizeof text, " %.1f%%", 100 * share);
      line += text;
    }
  }
  return line;
}

/// One line about visibility.
std::string summary(const VisibilityReport& visibility, std::uint32_t clusters) {
  char text[320];
  std::snprintf(
      text, sizeof text,
      "visibility from %u directions by %s at %s %s in %.2f s; %s seen from none of them "
      "(%s have no neighbour that is seen, and keep the normal); standard deviation %.3f%s",
      visibility.directions, visibility.by_rays ? "rays" : "views",
      with_commas(visibility.places).c_str(), visibility.width != 0 ? "texels" : "vertices",
      visibility.seconds, with_commas(visibility.unseen).c_str(),
      with_commas(visibility.without).c_str(), visibility.mean_deviation,
      clusters > 1 ? ("; " + with_commas(visibility.clustered) + " parted into clusters").c_str()
                   : "");
  return text;
}

/// "rays, 512 x 512".
std::string in_words(const PlanTrial& trial) {
  return match_name(trial.method) + ", " + std::to_string(trial.width) + " x " +
         std::to_string(trial.height);
}

/// One line about a plan.
std::string summary(const PlannedBake& planned) {
  char text[320];
  std::snprintf(
      text, sizeof text,
      "chose %s: rendered normals are %.3g degrees off (mean over %u pictures of %u x %u; 95%%: "
      "%.3g; without the map %.3g; wanted %.3g)",
      in_words(planned.chosen).c_str(), planned.chosen.error.mean_degrees, kPlanViews, kPlanPixels,
      kPlanPixels, planned.chosen.error.p95_degrees, planned.without_map.mean_degrees,
      planned.wanted);
  std::string line = text;
  line += "; tried";
  for (const PlanTrial& trial : planned.trials) {
    std::snprintf(text, sizeof text, "%s %s: %.3g", &trial == planned.trials.data() ? "" : ";",
                  in_words(trial).c_str(), trial.error.mean_degrees);
    line += text;
  }
  line += "; with an endless map";
  for (const PlanLimit& limit : planned.limits) {
    std::snprintf(text, sizeof text, "%s %s: %.3g", &limit == planned.limits.data() ? "" : ";",
                  match_name(limit.method).c_str(), limit.error.mean_degrees);
    line += text;
  }
  if (planned.least > 0) {
    std::snprintf(text, sizeof text, "; any way: at least %.3g", planned.least);
    line += text;
  }
  return line;
}

Warning not_reached(const PlannedBake& planned) {
  char text[320];
  std::snprintf(
      text, sizeof text,
      "No way to match is expected to reach a mean error of %.3g degrees with this light mesh "
      "and maps up to the given --size; the map written reaches %.3g. Give the light mesh more "
      "faces, allow a larger map, or accept more.",
      planned.wanted, planned.chosen.error.mean_degrees);
  return {"error-not-reached", text, 1};
}

Json trial_json(const PlanTrial& trial) {
  return {{"match", match_name(trial.method)},
          {"width", trial.width},
          {"height", trial.height},
          {"mean_angle_degrees", trial.error.mean_degrees},
          {"p95_angle_degrees", trial.error.p95_degrees},
          {"missed_share", trial.missed},
          {"seconds", trial.seconds}};
}

Json plan_json(const PlannedBake& planned) {
  Json trials = Json::array();
  for (const PlanTrial& trial : planned.trials) trials.push_back(trial_json(trial));
  Json limits = Json::array();
  for (const PlanLimit& limit : planned.limits) {
    limits.push_back({{"match", match_name(limit.method)},
                      {"mean_angle_degrees", limit.error.mean_degrees},
                      {"p95_angle_degrees", limit.error.p95_degrees},
                      {"missed_share", limit.missed},
                      {"seconds", limit.seconds}});
  }
  return {{"chosen", trial_json(planned.chosen)},
          {"wanted_degrees", planned.wanted},
          {"reached", planned.reached},
          {"views", kPlanViews},
          {"view_pixels", kPlanPixels},
          {"without_map", cli::describe(planned.without_map)},
          {"seconds_measure", planned.seconds_measure},
          {"least_degrees", planned.least},
          {"limits", limits},
          {"trials", trials}};
}

/// bake(); of layouts that disagree over a height field, it also says what is the likely reason.
BakeResult bake_from(const DenseInput& dense, const Source& source, const Mesh& low,
                     const BakeOptions& options) {
  try {
    return bake(source, low, options);
  } catch (const Error& error) {
    if (!dense.heights || options.method != MatchMethod::uv || error.code() != ErrorCode::input) {
      throw;
    }
    throw Error(ErrorCode::input, std::string(error.what()) +
                                      " HIGH is a height field: --height and --extent must be "
                                      "those that LOW was made for.");
  }
}

/// A list of likely views that says nothing.
void warn_about_weights(const BakeArguments& arguments, const VisibilityOptions& visibility,
                        std::vector<Warning>& warnings) {
  const std::vector<VisibilityOptions::Likelihood>& list = visibility.likelihoods;
  if (list.empty() || std::any_of(list.begin(), list.end(), [&](const auto& entry) {
        return entry.weight != list.front().weight;
      })) {
    return;
  }
  warnings.push_back({"equal-view-weights",
                      "'" + arguments.view_weight +
                          "' gives all views the same weight, as --view-weight all does: each "
                          "direction takes the weight of the line nearest to it, so add lines with "
                          "less for where LOW is not looked at from.",
                      1});
}

/// One line about the layouts.
std::string summary(const UvReport& uv, double diagonal) {
  char text[320];
  std::snprintf(text, sizeof text,
                "layouts: %s of the dense mesh's samples covered twice; surfaces %.3g%% of the "
                "diagonal apart at the same UV on average, 95%% of the samples within %.3g%%",
                percent(uv.overlapping, uv.covered).c_str(), 100 * uv.mean_distance / diagonal,
                100 * uv.p95_distance / diagonal);
  return text;
}

struct Stages {
  double load = 0, low = 0, build = 0, save = 0;
};

Json seconds(const Stages& stages, const BakeReport& report, double total) {
  return {{"load", stages.load},
          {"low", stages.low},
          {"build", stages.build + report.seconds_build},
          {"texels", report.seconds_texels},
          {"match", report.seconds_match},
          {"detail", report.seconds_detail},
          {"image", report.seconds_image},
          {"mips", report.seconds_mips},
          {"save", stages.save},
          {"total", total}};
}

void print_summary(Console& console, const BakeReport& report, std::uint64_t map_texels,
                   const Source::Stats& source, const Stages& stages, double total) {
  char text[512];
  const std::uint64_t found = report.samples - report.missed;
  std::string searched;
  if (report.max_distance > 0) {
    std::snprintf(text, sizeof text, ", search distance %.3g (%.3f%%)", report.max_distance,
                  100 * report.max_distance / source.diagonal);
    searched = text;
  }
  std::snprintf(text, sizeof text,
                "%s of %s texels covered, %s matched (%s), %s samples missed (%s); mean distance "
                "%.3g units (%.3f%% of the diagonal)%s",
                with_commas(report.texels).c_str(), with_commas(map_texels).c_str(),
                percent(found, report.samples).c_str(), shares(report).c_str(),
                with_commas(report.missed).c_str(), percent(report.missed, report.samples).c_str(),
                report.mean_abs_distance, 100 * report.mean_abs_distance / source.diagonal,
                searched.c_str());
  console.line(text);
  std::snprintf(
      text, sizeof text,
      "%.2f s: load %.2f, low mesh %.2f, build %.2f, texels %.2f, match %.2f, detail %.2f, "
      "image %.2f, mip-maps %.2f, save %.2f; peak memory %llu MiB",
      total, stages.load, stages.low, stages.build + report.seconds_build, report.seconds_texels,
      report.seconds_match, report.seconds_detail, report.seconds_image, report.seconds_mips,
      stages.save, static_cast<unsigned long long>(peak_resident_bytes() >> 20));
  console.line(text);
}

constexpr const char* kClusters = "_clusters.exr";

/// Of a map for one of several clusters of directions.
std::string cluster_name(const std::string& map, std::uint32_t cluster) {
  return cluster == 0 ? map : map + "_" + std::to_string(cluster);
}

bool has_clusters(const std::string& map) { return find_map(map).type != MapType::coverage; }

/// Values of a map's channels that lie at 0 and at 1 in a file; none where it holds them as they are.
std::vector<ValueRange> stored_ranges(const BakedMap& map, const BakeResult& result,
                                      const SaveImageOptions& options) {
  std::vector<ValueRange> ranges;
  for (std::uint32_t c = 0; c < map.image.channels && !is_exr(options); ++c) {
    ranges.push_back(value_range(map, result.coverage, c));
    if (ranges[c].low == 0 && ranges[c].high == 1) return {};
  }
  return ranges;
}

/// Moves values into [0, 1].
void store_in(const std::vector<ValueRange>& ranges, Image& image) {
  if (ranges.empty()) return;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const auto [low, high] = ranges[i % image.channels];
    image.pixels[i] = high > low ? (image.pixels[i] - low) / (high - low) : 0.5F;
  }
}

Json range_json(const std::vector<ValueRange>& ranges) {
  Json json = Json::array();
  for (const auto [low, high] : ranges) json.push_back({low, high});
  return json;
}

/// Before any work: nothing that a run reads is written over, nor an OBJ of the user's.
void check_outputs(const BakeArguments& arguments, const SaveImageOptions& save_options) {
  const fs::path folder = arguments.out;
  if (folder.empty()) throw Error(ErrorCode::usage, "--out is empty: give a folder.");
  if (!arguments.save_match.empty() && fs::path(arguments.save_match).extension() != ".exr") {
    throw Error(ErrorCode::usage, "--save-match '" + arguments.save_match +
                                      "': a match is an EXR, so the name must end in .exr.");
  }
  const std::string stem = low_stem(arguments);
  std::vector<fs::path> outputs = {arguments.json, arguments.save_match};
  for (const std::string& map : arguments.maps) {
    outputs.push_back(folder / (stem + "_" + map + extension(save_options)));
    for (std::uint32_t k = 1; k < arguments.visibility_clusters && has_clusters(map); ++k) {
      outputs.push_back(folder / (stem + "_" + cluster_name(map, k) + extension(save_options)));
    }
  }
  if (arguments.visibility_clusters > 1) outputs.push_back(folder / (stem + kClusters));
  if (arguments.low.empty() || arguments.unwrap) outputs.push_back(folder / (stem + ".obj"));
  check_paths({arguments.high, arguments.low, arguments.cage_mesh, arguments.load_match}, outputs);
  if (arguments.low.empty() || arguments.unwrap) {
    check_not_foreign(folder / (stem + ".obj"), arguments.force);
  }
  if (!arguments.force) check_low_record(folder, stem, low_source(arguments));
}

/// Where most is missed.
std::string missed_place(const BakeResult& result, const Mesh& low) {
  const Image& map = result.maps.front().image;
  return describe(largest_missed_patch(result.coverage, map.width, map.height, low));
}

/// The library knows neither the file nor what is asked for beside it.
void name_place_of_misses(BakeResult& result, const Mesh& low, const std::string& path) {
  for (Warning& warning : result.report.warnings) {
    if (warning.code != "many-misses") continue;
    warning.message = "'" + path + "': " + warning.message + " " + missed_place(result, low);
  }
}

/// More was missed than --max-missed allows.
std::string too_many_missed(const BakeArguments& arguments, const BakeResult& result,
                            const Mesh& low, const std::string& path, double missed) {
  char text[128];
  std::snprintf(text, sizeof text, "%.4g%% of the samples were missed, but --max-missed is %.4g. ",
                missed, arguments.max_missed_percent);
  const std::string message = "'" + path + "': " + text + missed_place(result, low);
  if (!arguments.load_match.empty()) {
    return message + " Save the match again with a longer --max-distance.";
  }
  const auto asked = [&](const MatchInfo& match) {
    return arguments.match == match.method.name ||
           std::find(arguments.fallback.begin(), arguments.fallback.end(), match.method.name) !=
               arguments.fallback.end();
  };
  const bool closest = asked(find_match(MatchMethod::closest.name));
  const bool far = arguments.match == "auto" ||
                   std::any_of(matches().begin(), matches().end(), [&](const MatchInfo& match) {
                     return match.looks_far && asked(match);
                   });
  if (!far) return message + " Add --fallback closest.";
  return message + " Raise --max-distance" + (closest ? "." : ", or add --fallback closest.");
}

int run_bake(const BakeArguments& given) {
  BakeArguments arguments = given;
  if (is_height_field(given.high) && !given.given.contains("--match")) arguments.match = "uv";
  check(arguments);
  BakeOptions options = bake_options(arguments);
  const SaveImageOptions save_options = image_options(arguments);
  Console console(arguments.quiet, arguments.json);
  Stopwatch watch;
  Stages stages;
  std::vector<Warning> warnings;
  const fs::path folder = arguments.out;
  check_outputs(arguments, save_options);
  prepare_output_folder(folder);
  prepare_parent(arguments.json);
  prepare_parent(arguments.save_match);

  const Device device = Device::open(arguments.device);
  if (!console.progress(0, "reading " + arguments.high)) return kExitCancelled;
  const DenseInput dense = load_dense(arguments.high, arguments.heights, warnings);
  const Mesh& high = dense.mesh;
  options.uv = uv_options(dense, options.uv);
  const std::size_t warnings_of_high = warnings.size();
  stages.load = watch.lap();
  warn_about_weights(arguments, options.visibility, warnings);
  LowMesh low = prepare_low(arguments, dense, console, warnings);
  const std::string low_path =
      arguments.low.empty() ? (folder / (low.stem + ".obj")).string() : arguments.low;
  (arguments.low.empty() ? stages.low : stages.load) += watch.lap();
  std::optional<Mesh> cage_mesh;
  if (!arguments.cage_mesh.empty()) {
    cage_mesh = load_mesh(arguments.cage_mesh, &warnings);
    options.cage_mesh = &*cage_mesh;
  }
  std::optional<Match> match;
  if (!arguments.load_match.empty()) {
    match = load_match(arguments.load_match);
    options.match = &*match;
  }
  stages.load += watch.lap();

  if (!console.progress(kAtSource, "preparing the dense mesh")) return kExitCancelled;
  const Source source(device, high, traversal(arguments));
  stages.build = watch.lap();

  options.progress = [&](double done, std::string_view stage) {
    return console.progress(kAtBake + (kAtSave - kAtBake) * done, stage);
  };
  std::optional<PlannedBake> planned;
  if (arguments.match == "auto") {
    PlanOptions plan_options;
    plan_options.bake = options;
    if (!arguments.max_error.empty()) {
      plan_options.max_error = parse_degrees("--max-error", arguments.max_error);
    }
    planned = bake_planned(source, low.mesh, plan_options);
    if (planned->result.cancelled) return kExitCancelled;
    if (!planned->reached) warnings.push_back(not_reached(*planned));
  }
  BakeResult result =
      planned ? std::move(planned->result) : bake_from(dense, source, low.mesh, options);
  if (result.cancelled) return kExitCancelled;
  check_result(result.report, high, low.mesh);
  name_place_of_misses(result, low.mesh, low_path);
  watch.lap();

  std::vector<std::string> outputs;
  Json mips, ranges = Json::object();
  const auto saving = [&](const fs::path& path) {
    outputs.push_back(path.string());
    return console.progress(kAtSave, "writing " + path.string());
  };
  if (low.made) {
    const fs::path path = folder / (low.stem + ".obj");
    if (!saving(path)) return kExitCancelled;
    save_obj(low.mesh, path);
  }
  for (BakedMap& map : result.maps) {
    const std::string name = cluster_name(map_name(map.kind), map.cluster);
    if (const std::vector<ValueRange> range = stored_ranges(map, result, save_options);
        !range.empty()) {
      store_in(range, map.image);
      for (Image& level : map.mips) store_in(range, level);
      ranges[name] = range_json(range);
    }
    const std::vector<fs::path> files =
        map_files(folder, low.stem + "_" + name, map.mips.size(), save_options);
    for (std::size_t level = 0; level < files.size(); ++level) {
      if (!saving(files[level])) return kExitCancelled;
      if (options.mips && is_exr(save_options)) {
        save_mipmapped(map.image, map.mips, files[level], save_options);
      } else {
        save_image(level == 0 ? map.image : map.mips[level - 1], files[level], save_options);
      }
    }
    if (options.mips) mips[name] = describe_levels(map, files);
  }
  if (result.clusters) {
    const fs::path path = folder / (low.stem + kClusters);
    if (!saving(path)) return kExitCancelled;
    save_clusters(*result.clusters, path);
  }
  if (!arguments.save_match.empty()) {
    if (!saving(arguments.save_match)) return kExitCancelled;
    save_match(*result.match, arguments.save_match);
  }
  save_low_record(folder, low.stem, low_source(arguments));
  stages.save = watch.lap();

  const auto append = [&](const std::vector<Warning>& list) {
    warnings.insert(warnings.end(), list.begin(), list.end());
  };
  if (low.simplified) append(low.simplified->warnings);
  if (low.unwrapped) append(low.unwrapped->warnings);
  append(source.warnings());
  append(result.report.warnings);
  const BakeReport& report = result.report;
  const double total = watch.total();

  if (!arguments.json.empty()) {
    Json json = {
        {"version", version()},
        {"device", describe(device.info())},
        {"inputs",
         {{"high", describe(high, arguments.high)},
          {"low", describe(low.mesh, arguments.low.empty() ? outputs[0] : arguments.low)}}},
        {"options", describe(arguments, report)},
        {"seconds", seconds(stages, report, total)},
        {"compile_seconds", device.compile_seconds()},
        {"texels", describe_texels(report)},
        {"distance",
         {{"mean", report.mean_abs_distance},
          {"max_allowed", report.max_distance},
          {"diagonal", source.stats().diagonal}}},
        {"source",
         {{"triangles", source.stats().triangles},
          {"skipped", source.stats().skipped_triangles},
          {"device_bytes", source.stats().device_bytes}}},
        {"memory",
         {{"peak_resident_bytes", peak_resident_bytes()},
          {"peak_device_bytes", report.peak_device_bytes}}},
        {"outputs", outputs},
        {"warnings", describe(warnings)}};
    // What 0 and 1 of integer formats stand for, a channel each.
    if (!ranges.empty()) json["ranges"] = ranges;
    if (options.mips) json["mips"] = mips;
    if (planned) json["auto"] = plan_json(*planned);
    if (report.uv) json["uv"] = describe(*report.uv);
    if (report.views) json["views"] = describe(*report.views);
    if (report.switches) json["switches"] = describe(*report.switches);
    if (report.switches_blended) {
      json["switches_blended"] = describe(*report.switches_blended);
      json["switches_blended"]["blended_texels"] = report.blended_texels;
    }
    if (report.visibility) json["visibility"] = describe(*report.visibility);
    if (low.simplified) {
      json["low"] = {{"faces", low.simplified->faces}, {"error", low.simplified->error}};
      json["low"]["flaws"] = {{"mended", low.simplified->mended},
                              {"folded", low.simplified->folded},
                              {"without_area", low.simplified->without_area},
                              {"new_holes", low.simplified->holes}};
      if (low.unwrapped) {
        json["low"]["charts"] = low.unwrapped->charts;
        json["low"]["coverage"] = low.unwrapped->coverage;
        json["low"]["density_spread"] = low.unwrapped->density_spread;
      }
    }
    save_report(arguments.json, json);
  }
  console.progress(1, "done");
  for (const Warning& warning : root_causes(warnings, warnings_of_high)) {
    console.warning(warning.message);
  }
  if (low.simplified) {
    char text[256];
    std::snprintf(text, sizeof text, "low mesh: %s of %s faces, within %.3f%% of the diagonal",
                  with_commas(low.simplified->faces).c_str(),
                  with_commas(low.simplified->input_faces).c_str(), low.simplified->error * 100);
    console.line(text);
  }
  if (planned) console.line(summary(*planned));
  if (report.views) console.line(summary(*report.views, source.stats().diagonal));
  if (report.uv) console.line(summary(*report.uv, source.stats().diagonal));
  if (report.visibility) console.line(summary(*report.visibility, options.visibility.clusters));
  const std::uint64_t map_texels =
      planned ? std::uint64_t{planned->chosen.width} * planned->chosen.height
              : std::uint64_t{options.width} * options.height;
  print_summary(console, report, map_texels, source.stats(), stages, total);
  for (const std::string& output : outputs) console.line("wrote " + output);
  const double missed =
      100.0 * static_cast<double>(report.missed) / static_cast<double>(report.samples);
  if (missed > arguments.max_missed_percent) {
    std::fprintf(stderr, "kiln: %s\n",
                 too_many_missed(arguments, result, low.mesh, low_path, missed).c_str());
    return 1;
  }
  if (planned && !planned->reached && !arguments.max_error.empty()) {
    std::fprintf(stderr, "kiln: the error asked for was not reached.\n");
    return 1;
  }
  return 0;
}

}  // namespace

Run add_bake(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "bake", "Bake the detail of HIGH into textures of LOW (made from HIGH where none is given)");
  auto arguments = std::make_shared<BakeArguments>();
  add_bake_options(*command, *arguments);
  return [command, arguments] {
    arguments->given = given_flags(*command);
    return run_bake(*arguments);
  };
}

}  // namespace kiln::cli
