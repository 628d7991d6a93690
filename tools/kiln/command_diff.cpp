#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

#include "commands.h"
#include "kiln/kiln.h"
#include "report.h"

namespace kiln::cli {
namespace {

struct DiffArguments {
  std::string a, b, mask, json;
  std::optional<double> max_mean_angle, max_angle, max_error;
};

int run_diff(const DiffArguments& arguments) {
  const Image a = load_image(arguments.a);
  const Image b = load_image(arguments.b);
  std::optional<Image> mask;
  if (!arguments.mask.empty()) mask = load_image(arguments.mask);
  const ImageDifference difference = compare_images(a, b, mask ? &*mask : nullptr);

  const bool has_limit = arguments.max_mean_angle || arguments.max_angle || arguments.max_error;
  bool within = true;
  if (arguments.max_mean_angle && difference.mean_angle_degrees > *arguments.max_mean_angle)
    within = false;
  if (arguments.max_angle && difference.max_angle_degrees > *arguments.max_angle) within = false;
  if (arguments.max_error && difference.max_error > *arguments.max_error) within = false;
  if (!has_limit && difference.max_error > 0) within = false;

  std::printf(
      "%s texels: angle mean %.4f, 95%% %.4f, 99%% %.4f, max %.4f degrees; "
      "channel error mean %.6f, max %.6f, worst at (%u, %u)\n",
      std::to_string(difference.compared).c_str(), difference.mean_angle_degrees,
      difference.p95_angle_degrees, difference.p99_angle_degrees, difference.max_angle_degrees,
      difference.mean_error, difference.max_error, difference.worst_x, difference.worst_y);
  std::printf("%s\n", within ? "within" : has_limit ? "beyond the limits" : "different");
  if (!arguments.json.empty()) {
    const Json report = {{"version", version()},
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
                         {"within", within}};
    save_text(arguments.json, report.dump(2) + "\n");
  }
  return within ? 0 : 1;
}

}  // namespace

Run add_diff(CLI::App& app) {
  CLI::App* command = app.add_subcommand("diff",
                                         "Compare two maps; exit code 0 within the limits, 1 "
                                         "beyond (without limits: 0 only if equal)");
  auto arguments = std::make_shared<DiffArguments>();
  command->add_option("A", arguments->a, "A map (PNG or EXR)")->required();
  command->add_option("B", arguments->b, "Another of the same size")->required();
  command->add_option("--max-mean-angle", arguments->max_mean_angle, "Degrees, between normals")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--max-angle", arguments->max_angle, "Degrees, at the worst texel")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--max-error", arguments->max_error, "Largest channel difference, 0 to 1")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--mask", arguments->mask, "Image: texels that are 0 there do not count");
  command->add_option("--json", arguments->json, "Write the figures to this file");
  return [arguments] { return run_diff(*arguments); };
}

}  // namespace kiln::cli
