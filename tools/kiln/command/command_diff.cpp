#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <vector>

#include "arguments/command_options.h"
#include "base/counted.h"
#include "batch/checks.h"
#include "batch/content_hash.h"
#include "command/render_parts.h"
#include "commands.h"
#include "job/describe.h"
#include "job/files.h"
#include "job/map_file.h"
#include "kiln/files.h"
#include "kiln/image.h"
#include "kiln/version.h"
#include "options/option_table.h"
#include "options/parse.h"
#include "picture/sheet.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

/// Formats an error with 6 significant digits, since values in files reach 1e38.
std::string error_text(double value) { return formatted(value < 1e6 ? "%.6f" : "%.6g", value); }

struct DiffArguments {
  std::string a, b, mask, out, json, junit;
  std::optional<double> max_mean_angle, max_angle, max_error;
};

bool is_exr(const std::string& path) { return std::filesystem::path(path).extension() == ".exr"; }

void check_diff(const DiffArguments& arguments) {
  check_paths({arguments.a, arguments.b, arguments.mask}, {arguments.out, arguments.json});
  prepare_parent(arguments.json);
  if (arguments.out.empty()) return;
  refuse_if(!is_exr(arguments.out) && std::filesystem::path(arguments.out).extension() != ".png",
            "--out '" + arguments.out +
                "': the name must end in .png for a picture, or in .exr for a texture of the "
                "differences.");
  prepare_parent(arguments.out);
}

/// Saves the difference of two maps: a picture with a colour scale (PNG), or the values themselves (EXR). Consumes both
/// maps.
void save_difference(const DiffArguments& arguments, Image& a, Image& b, const Image* mask) {
  constexpr Colour kMasked = {0.55F, 0.60F, 0.68F};
  const bool by_channel =
      a.channels < 3 || (arguments.max_error && !arguments.max_angle && !arguments.max_mean_angle);
  const Image differences = image_differences(a, b, mask, by_channel);
  a = b = {};
  if (is_exr(arguments.out)) {
    save_image(differences, arguments.out, {ImageFormat::exr_float});
    return;
  }
  std::vector<double> values;
  values.reserve(differences.pixels.size());
  for (const float value : differences.pixels) {
    if (value >= 0) values.push_back(value);
  }
  Scale scale{
      round_scale_end(std::move(values)), by_channel ? "channel difference" : "degrees", {}};
  if (mask != nullptr) scale.others = {{kMasked, "masked"}};
  std::vector<Panel> panels(1);
  panels[0].image = map_to_colours(differences, scale, [&](float value) -> std::optional<Colour> {
    if (value >= 0) return std::nullopt;
    return kMasked;
  });
  save_image(make_sheet(panels, scale), arguments.out, {ImageFormat::png8});
}

/// How a file differs between two folders.
struct FileDifference {
  std::string file;   ///< Path of the file, relative to each of the two folders
  const char* state;  ///< State of the file: equal, within, beyond, missing or new
  std::string problem;
  std::optional<ImageDifference> image_difference;
};

bool is_problem(const FileDifference& file) { return !file.problem.empty(); }

/// Lists the relative paths of all regular files below a folder, sorted, except names that begin with a dot.
std::set<std::string> files_below(const std::filesystem::path& folder, const std::string& name) {
  namespace fs = std::filesystem;
  std::set<std::string> files;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    if (entry->path().filename().string().starts_with('.')) {
      entry.disable_recursion_pending();
      continue;
    }
    std::error_code ignored_error;
    if (entry->is_regular_file(ignored_error))
      files.insert(entry->path().lexically_relative(folder).generic_string());
  }
  if (error) {
    throw Error(ErrorCode::input,
                name + " '" + folder.string() + "' cannot be read: " + error.message() + ".");
  }
  return files;
}

/// Compares a map with its golden file, by the limits of its kind: angles for direction maps, channel differences for
/// others.
FileDifference compare_maps(const DiffArguments& arguments, const std::string& file) {
  const std::filesystem::path golden = std::filesystem::path(arguments.a) / file,
                              produced = std::filesystem::path(arguments.b) / file;
  FileDifference result{file, "equal", {}, {}};
  if (file_hash(golden) == file_hash(produced)) return result;
  if (!is_map_file(golden)) {
    result.state = "beyond";
    result.problem = "its bytes differ";
    return result;
  }
  const Image a = load_image(golden), b = load_image(produced);
  std::optional<Image> mask;
  if (const auto mask_file = find_mask_beside(golden); !mask_file.empty()) {
    mask = load_mask(mask_file);
    if (mask->width != a.width || mask->height != a.height) mask.reset();
  }
  ImageDifference image_difference;
  try {
    image_difference = compare_images(a, b, mask ? &*mask : nullptr);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::input) throw;
    result.state = "beyond";
    result.problem = error.what();
    if (result.problem.ends_with('.')) result.problem.pop_back();
    return result;
  }
  result.image_difference = image_difference;
  if (image_difference.max_error == 0) return result;
  const auto check_limit = [&](const std::optional<double>& limit, double value, const char* what) {
    if (!limit || value <= *limit) return;
    result.problem += (result.problem.empty() ? "" : ", ") + std::string(what) + " " +
                      error_text(value) + formatted(" (allowed: %g)", *limit);
  };
  const bool directions = holds_directions(golden) && a.channels >= 3;
  const bool limited = directions ? arguments.max_mean_angle || arguments.max_angle
                                  : arguments.max_error.has_value();
  if (directions) {
    check_limit(arguments.max_mean_angle, image_difference.mean_angle_degrees, "mean angle");
    check_limit(arguments.max_angle, image_difference.max_angle_degrees, "greatest angle");
  } else {
    check_limit(arguments.max_error, image_difference.max_error, "greatest error");
  }
  if (!limited) {
    result.problem = directions ? "it differs by up to " +
                                      error_text(image_difference.max_angle_degrees) + " degrees"
                                : "it differs by up to " + error_text(image_difference.max_error);
  }
  result.state = result.problem.empty() ? "within" : "beyond";
  return result;
}

Json difference_json(const FileDifference& file) {
  Json json = {{"file", file.file},
               {"state", file.state},
               {"problem", file.problem.empty() ? Json() : Json(file.problem)}};
  if (!file.image_difference) return json;
  json["compared"] = file.image_difference->compared_texels;
  json["mean_angle_degrees"] = file.image_difference->mean_angle_degrees;
  json["max_angle_degrees"] = file.image_difference->max_angle_degrees;
  json["mean_error"] = file.image_difference->mean_error;
  json["max_error"] = file.image_difference->max_error;
  json["worst"] = {file.image_difference->worst_x, file.image_difference->worst_y};
  return json;
}

/// Compares a folder with a folder of golden files.
int diff_folders(const DiffArguments& arguments) {
  refuse_if(!arguments.mask.empty(),
            "--mask works only with two map files: in folders, the map 'mask' beside a golden map "
            "selects "
            "the texels.");
  refuse_if(
      !arguments.out.empty(),
      "--out works only with two map files, not with folders: compare two maps to see where they "
      "differ.");
  check_paths({}, {arguments.json, arguments.junit});
  if (arguments.json != "-") prepare_parent(arguments.json);
  prepare_parent(arguments.junit);
  const std::set<std::string> golden = files_below(arguments.a, "GOLDEN"),
                              produced = files_below(arguments.b, "OUT");
  if (golden.empty()) {
    throw Error(ErrorCode::input,
                "'" + arguments.a + "' contains no files: name the folder of golden maps.");
  }
  std::vector<FileDifference> files;
  for (const std::string& file : golden) {
    if (produced.count(file) == 0) {
      files.push_back({file, "missing", "the golden file exists, but the output does not", {}});
    } else {
      files.push_back(compare_maps(arguments, file));
    }
  }
  for (const std::string& file : produced) {
    if (golden.count(file) == 0)
      files.push_back({file, "new", "there is no golden file with this name", {}});
  }
  std::map<std::string, std::size_t> counts;
  Json described = Json::array(), cases = Json::array();
  std::FILE* const stream = arguments.json == "-" ? stderr : stdout;
  for (const FileDifference& file : files) {
    ++counts[file.state];
    described.push_back(difference_json(file));
    Json one = {{"asset", file.file}, {"state", file.state}, {"seconds", 0.0}, {"error", Json()}};
    if (is_problem(file))
      one["error"] = {{"message", file.problem}, {"id", file.state}, {"code", 1}};
    cases.push_back(std::move(one));
    if (is_problem(file)) print_line(stream, file.file + ": " + file.problem);
  }
  const bool is_within = std::none_of(files.begin(), files.end(), is_problem);
  print_line(stream,
             formatted("%s: %zu equal, %zu within the limits, %zu beyond, %zu missing, %zu new",
                       counted(files.size(), "file").c_str(), counts["equal"], counts["within"],
                       counts["beyond"], counts["missing"], counts["new"]));
  if (!arguments.json.empty()) {
    save_report(arguments.json, Json{{"version", version()},
                                     {"a", arguments.a},
                                     {"b", arguments.b},
                                     {"files", described},
                                     {"within", is_within}});
  }
  if (!arguments.junit.empty()) save_text(arguments.junit, format_junit("diff", cases));
  return is_within ? 0 : 1;
}

int run_diff(const DiffArguments& arguments) {
  namespace fs = std::filesystem;
  std::error_code error;
  const bool folder_a = fs::is_directory(arguments.a, error),
             folder_b = fs::is_directory(arguments.b, error);
  const std::string &folder = folder_a ? arguments.a : arguments.b,
                    &other = folder_a ? arguments.b : arguments.a;
  if (folder_a != folder_b && !fs::exists(other, error)) {
    throw Error(ErrorCode::input, "There is no folder '" + other + "' to compare with '" + folder +
                                      "': check the path.");
  }
  refuse_if(folder_a != folder_b, "'" + folder + "' is a folder and '" + other +
                                      "' a file: give two files or two folders.");
  if (folder_a && folder_b) return diff_folders(arguments);
  refuse_if(!arguments.junit.empty(), "--junit is for two folders: leave it out.");
  check_diff(arguments);
  Image a = load_normal_map(arguments.a);
  // Memory is needed for the second map, and for one angle per texel.
  require_pictures({.width = a.width, .height = a.height}, 2);
  Image b = load_normal_map(arguments.b);
  std::optional<Image> mask;
  if (!arguments.mask.empty()) mask = load_mask(arguments.mask);
  refuse_if(a.channels < 3 && (arguments.max_angle || arguments.max_mean_angle),
            "'" + arguments.a + "' has " + std::to_string(a.channels) +
                " channels, so it has no angles to limit: use --max-error.");
  const ImageDifference difference = compare_images(a, b, mask ? &*mask : nullptr);

  if (difference.compared_texels == 0) {
    throw Error(ErrorCode::input,
                "'" + arguments.mask + "' excludes all texels: give another mask.");
  }
  const bool has_limit = arguments.max_mean_angle || arguments.max_angle || arguments.max_error;
  bool is_within = true;
  if (arguments.max_mean_angle && difference.mean_angle_degrees > *arguments.max_mean_angle)
    is_within = false;
  if (arguments.max_angle && difference.max_angle_degrees > *arguments.max_angle) is_within = false;
  if (arguments.max_error && difference.max_error > *arguments.max_error) is_within = false;
  if (!has_limit && difference.max_error > 0) is_within = false;

  const std::string text = formatted(
      "%s texels: angle mean %.4f, 95%% %.4f, 99%% %.4f, max %.4f degrees; "
      "channel error mean %s, max %s, worst at (%u, %u)",
      std::to_string(difference.compared_texels).c_str(), difference.mean_angle_degrees,
      difference.p95_angle_degrees, difference.p99_angle_degrees, difference.max_angle_degrees,
      error_text(difference.mean_error).c_str(), error_text(difference.max_error).c_str(),
      difference.worst_x, difference.worst_y);
  std::FILE* const stream = arguments.json == "-" ? stderr : stdout;
  print_line(stream, text);
  print_line(stream, is_within ? "within" : has_limit ? "beyond the limits" : "different");
  if (!arguments.out.empty()) save_difference(arguments, a, b, mask ? &*mask : nullptr);
  if (!arguments.json.empty()) {
    const Json report = {
        {"version", version()},
        {"a", arguments.a},
        {"b", arguments.b},
        {"compared", difference.compared_texels},
        {"mean_angle_degrees", difference.mean_angle_degrees},
        {"p95_angle_degrees", difference.p95_angle_degrees},
        {"p99_angle_degrees", difference.p99_angle_degrees},
        {"max_angle_degrees", difference.max_angle_degrees},
        {"mean_error", difference.mean_error},
        {"max_error", difference.max_error},
        {"worst", {difference.worst_x, difference.worst_y}},
        {"outputs", arguments.out.empty() ? Json::array() : Json::array({arguments.out})},
        {"within", is_within}};
    save_report(arguments.json, report);
  }
  return is_within ? 0 : 1;
}

}  // namespace

Run add_diff(Command& app) {
  Command* command = app.add_command("diff",
                                     "Compare two maps, or two folders of maps; exit code 0 within "
                                     "the limits, 1 beyond them (without limits: 0 only if equal)");
  auto arguments = std::make_shared<DiffArguments>();
#define AT(member) KILN_MEMBER(DiffArguments, member)
  const OptionRow rows[] = {
      {.flag = "A",
       .value = text(AT(a)),
       .help = "A map (PNG or EXR), or a folder of golden files",
       .required = true},
      {.flag = "B",
       .value = text(AT(b)),
       .help = "Another map of the same size, or a folder of the same files",
       .required = true},
      {.flag = "--max-mean-angle",
       .value = number(AT(max_mean_angle), 0, 180).in("degrees"),
       .help = "Largest mean angle between normals, in degrees"},
      {.flag = "--max-angle",
       .value = number(AT(max_angle), 0, 180).in("degrees"),
       .help = "Largest angle at any texel, in degrees"},
      {.flag = "--max-error",
       .value = number(AT(max_error), 0, HUGE_VAL),
       .help = "Largest channel difference, 0 to 1"},
      {.flag = "--mask",
       .value = text(AT(mask)),
       .help = "Exclude texels that are 0 in this image, such as the map mask of a bake, or that "
               "have no point in this saved match"},
      {.flag = "--out",
       .value = text(AT(out)),
       .help = "Also write the differences as a picture with a scale (.png) or as a texture "
               "(.exr): angles in degrees; channel differences if only --max-error is given, or if "
               "there are fewer than 3 channels; -1 at masked texels"},
      {.flag = "--json",
       .value = text(AT(json)),
       .help = "Write the figures to this file, or - for standard output"},
      {.flag = "--junit",
       .value = text(AT(junit), "FILE"),
       .help = "For two folders: write the result as JUnit XML, with one test case per file"},
  };
#undef AT
  add_options(*command, rows, arguments.get());
  return [arguments] { return run_diff(*arguments); };
}

}  // namespace kiln::cli
