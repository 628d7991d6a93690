#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "arguments/command_options.h"
#include "command/render_parts.h"
#include "commands.h"
#include "job/describe.h"
#include "job/files.h"
#include "job/map_file.h"
#include "kiln/kiln.h"
#include "options/option_table.h"
#include "options/parse.h"
#include "picture/sheet.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

/// Values of files reach 1e38, whose digits nobody reads.
std::string error_text(double value) { return formatted(value < 1e6 ? "%.6f" : "%.6g", value); }

struct DiffArguments {
  std::string a, b, mask, out, json;
  std::optional<double> max_mean_angle, max_angle, max_error;
};

bool is_exr(const std::string& path) { return std::filesystem::path(path).extension() == ".exr"; }

void check(const DiffArguments& arguments) {
  check_paths({arguments.a, arguments.b, arguments.mask}, {arguments.out, arguments.json});
  prepare_parent(arguments.json);
  if (arguments.out.empty()) return;
  refuse_if(!is_exr(arguments.out) && std::filesystem::path(arguments.out).extension() != ".png",
            "--out '" + arguments.out +
                "': a picture's name ends in .png, a texture of the "
                "differences in .exr.");
  prepare_parent(arguments.out);
}

/// Saves the difference of the maps: a picture with its scale (PNG), or the values as they are (EXR). The maps are gone after it.
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
  Scale scale{scale_end(std::move(values)), by_channel ? "channel difference" : "degrees", {}};
  if (mask != nullptr) scale.others = {{kMasked, "masked"}};
  std::vector<Panel> panels(1);
  panels[0].image = coloured(differences, scale, [&](float value) -> std::optional<Colour> {
    if (value >= 0) return std::nullopt;
    return kMasked;
  });
  save_image(make_sheet(panels, scale), arguments.out, {ImageFormat::png8});
}

int run_diff(const DiffArguments& arguments) {
  check(arguments);
  Image a = load_normal_map(arguments.a);
  // The other one, and an angle a texel.
  require_pictures({.width = a.width, .height = a.height}, 2);
  Image b = load_normal_map(arguments.b);
  std::optional<Image> mask;
  if (!arguments.mask.empty()) mask = load_mask(arguments.mask);
  refuse_if(a.channels < 3 && (arguments.max_angle || arguments.max_mean_angle),
            "'" + arguments.a + "' has " + std::to_string(a.channels) +
                " channels, so there are no angles to limit: use --max-error.");
  const ImageDifference difference = compare_images(a, b, mask ? &*mask : nullptr);

  if (difference.compared == 0) {
    throw Error(ErrorCode::input,
                "'" + arguments.mask + "' leaves no texel to compare: give another mask.");
  }
  const bool has_limit = arguments.max_mean_angle || arguments.max_angle || arguments.max_error;
  bool within = true;
  if (arguments.max_mean_angle && difference.mean_angle_degrees > *arguments.max_mean_angle)
    within = false;
  if (arguments.max_angle && difference.max_angle_degrees > *arguments.max_angle) within = false;
  if (arguments.max_error && difference.max_error > *arguments.max_error) within = false;
  if (!has_limit && difference.max_error > 0) within = false;

  const std::string text = formatted(
      "%s texels: angle mean %.4f, 95%% %.4f, 99%% %.4f, max %.4f degrees; "
      "channel error mean %s, max %s, worst at (%u, %u)",
      std::to_string(difference.compared).c_str(), difference.mean_angle_degrees,
      difference.p95_angle_degrees, difference.p99_angle_degrees, difference.max_angle_degrees,
      error_text(difference.mean_error).c_str(), error_text(difference.max_error).c_str(),
      difference.worst_x, difference.worst_y);
  std::FILE* const to = arguments.json == "-" ? stderr : stdout;
  print_line(to, text);
  print_line(to, within ? "within" : has_limit ? "beyond the limits" : "different");
  if (!arguments.out.empty()) save_difference(arguments, a, b, mask ? &*mask : nullptr);
  if (!arguments.json.empty()) {
    const Json report = {
        {"version", version()},
        {"a", arguments.a},
        {"b", arguments.b},
        {"compared", difference.compared},
        {"mean_angle_degrees", difference.mean_angle_degrees},
        {"p95_angle_degrees", difference.p95_angle_degrees},
        {"p99_angle_degrees", difference.p99_angle_degrees},
        {"max_angle_degrees", difference.max_angle_degrees},
        {"mean_error", difference.mean_error},
        {"max_error", difference.max_error},
        {"worst", {difference.worst_x, difference.worst_y}},
        {"outputs", arguments.out.empty() ? Json::array() : Json::array({arguments.out})},
        {"within", within}};
    save_report(arguments.json, report);
  }
  return within ? 0 : 1;
}

}  // namespace

Run add_diff(Command& app) {
  Command* command = app.add_command("diff",
                                     "Compare two maps; exit code 0 within the limits, 1 "
                                     "beyond (without limits: 0 only if equal)");
  auto arguments = std::make_shared<DiffArguments>();
#define AT(member) KILN_MEMBER(DiffArguments, member)
  const OptionRow rows[] = {
      {.flag = "A", .value = text(AT(a)), .help = "A map (PNG or EXR)", .required = true},
      {.flag = "B", .value = text(AT(b)), .help = "Another of the same size", .required = true},
      {.flag = "--max-mean-angle",
       .value = number(AT(max_mean_angle), 0, 180).in("degrees"),
       .help = "Degrees, between normals"},
      {.flag = "--max-angle",
       .value = number(AT(max_angle), 0, 180).in("degrees"),
       .help = "Degrees, at the worst texel"},
      {.flag = "--max-error",
       .value = number(AT(max_error), 0, HUGE_VAL),
       .help = "Largest channel difference, 0 to 1"},
      {.flag = "--mask",
       .value = text(AT(mask)),
       .help = "Texels that are 0 there do not count: an image, such as bake's mask, or a saved "
               "match"},
      {.flag = "--out",
       .value = text(AT(out)),
       .help = "Also write where they differ: a picture with a scale (.png), or a texture (.exr): "
               "degrees; with --max-error alone, or fewer than 3 channels, channel differences; -1 "
               "where masked"},
      {.flag = "--json",
       .value = text(AT(json)),
       .help = "Write the figures to this file, or - for standard output"},
  };
#undef AT
  add_options(*command, rows, arguments.get());
  return [arguments] { return run_diff(*arguments); };
}

}  // namespace kiln::cli
