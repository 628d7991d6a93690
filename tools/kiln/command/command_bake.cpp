// `kiln bake`: converts arguments to a job, and prints its result.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "arguments/command_options.h"
#include "base/input_log.h"
#include "batch/job_file.h"
#include "cl/device_order.h"
#include "command/view_command.h"
#include "commands.h"
#include "interrupt.h"
#include "io/file/output_set.h"
#include "job/high_poly_input.h"
#include "job/job_options.h"
#include "job/run.h"
#include "kiln/job.h"
#include "kiln/options.h"
#include "kiln/plan.h"
#include "options/parse.h"
#include "picture/plot.h"
#include "report/console.h"

namespace kiln::cli {
namespace {

std::string size_text(std::uint32_t size) {
  return size == 0 ? "none" : std::to_string(size) + " x " + std::to_string(size);
}

/// Largest ratio of a map's bytes to those of the chosen map; larger maps are left out of the plot.
constexpr std::uint64_t kMaxDrawnBytesRatio = 16;

Plot plan_plot(const LowPolyPlan& plan, const std::string& stem) {
  const auto kib = [](const Candidate& c) { return static_cast<double>(c.bytes.total()) / 1024; };
  Json panel = plot_panel("Mean angle between rendered normals, degrees");
  panel["levels"].push_back({{"title", formatted("wanted: %.3g degrees", plan.wanted)},
                             {"look", "none"},
                             {"y", plan.wanted}});
  std::map<std::uint32_t, std::vector<Candidate>> candidates_by_size;
  for (const Candidate& trial : plan.outlook) candidates_by_size[trial.size].push_back(trial);
  std::erase_if(candidates_by_size, [&](const auto& curve) {
    return std::none_of(curve.second.begin(), curve.second.end(), [&](const Candidate& trial) {
      return trial.bytes.total() <= kMaxDrawnBytesRatio * plan.chosen.bytes.total();
    });
  });
  double min_kib = 1e300, max_kib = 0, previous = 0;
  for (const auto& [size, trials] : candidates_by_size) {
    for (const Candidate& trial : trials) {
      min_kib = std::min(min_kib, kib(trial));
      max_kib = std::max(max_kib, kib(trial));
    }
    panel["curves"].push_back(
        plot_curve(size == 0 ? "no map" : std::to_string(size) + "² texels",
                   previous++ / static_cast<double>(candidates_by_size.size()), trials, kib,
                   [](const Candidate& trial) { return trial.expected; }));
  }
  panel["rings"] = {
      {"title", formatted("chosen: %s faces, map: %s", with_commas(plan.chosen.faces).c_str(),
                          size_text(plan.chosen.size).c_str())},
      {"x", {kib(plan.chosen)}},
      {"y", {plan.chosen.measured}}};
  Plot plot;
  plot.name = stem + "_plan";
  plot.data = {{"kind", "study"},
               {"title", "Faces against texels: " + stem},
               {"x_title", "KiB of low poly and maps"},
               {"x_ticks", power_of_four_ticks(min_kib, max_kib)},
               {"panels", Json::array({panel})}};
  return plot;
}

/// Returns hooks that draw a plan with Python. Python starts while the plan is computed.
RunHooks drawing_hooks(const Job& job, std::optional<RunningProgram>& python) {
  RunHooks hooks;
  hooks.plan_files = [](const std::string& stem) { return list_plot_files(stem + "_plan"); };
  hooks.on_start = [&] {
    if (plans_low_poly(job)) python = start_python();
  };
  hooks.on_plan = [&python](const LowPolyPlan& plan, const std::string& stem) {
    if (python && python->has_begun()) python = start_python();
    if (python) begin_plot(*python, plan_plot(plan, stem));
  };
  hooks.draw_plan = [&python](const LowPolyPlan& plan, const std::string& folder,
                              const std::string& stem, std::vector<std::string>& outputs,
                              std::vector<Warning>& warnings) {
    return save_plots(folder, {plan_plot(plan, stem)}, outputs, warnings, std::move(python));
  };
  return hooks;
}

/// Converts a job to the arguments of --page, for the job's asset.
ViewCommandArguments page_arguments(const Job& job, const std::string& page) {
  const std::string asset = asset_file(job);
  refuse_if(asset.empty(), "--page shows an asset: give --out NAME.glb, NAME.gltf or NAME.obj.");
  refuse_if(job.low.make.lods != 0,
            "--page shows one asset: leave --lod out, or run kiln view for a level.");
  ViewCommandArguments view;
  view.mesh = asset;
  view.out = page;
  view.device = job.device;
  view.shading = job.frame.shading;
  std::vector<std::string> inputs;
  for (const JobInput& input : job.high) inputs.push_back(input.name);
  if (inputs.size() == 1 && !is_height_field(inputs.front())) view.reference = inputs.front();
  for (const JobInput& input : job.low.given) inputs.push_back(input.name);
  check_page("--page", page, inputs);
  return view;
}

/// Runs `kiln bake`. \param page  value of --page; empty: no page
int run_bake(const Job& job, const std::string& page) {
  Console console(job.quiet, job.json);
  std::optional<ViewCommandArguments> view;
  if (!page.empty()) {
    check(job);
    view = page_arguments(job, page);
  }
  std::optional<RunningProgram> python;
  RunHooks hooks = drawing_hooks(job, python);
  const auto open_device = [&] {
    const Device device = Device::open(job.device);
    const std::string choice = job.device.empty() ? describe_device_choice() : "";
    if (!choice.empty()) console.line(choice + "; --device takes another");
    return device;
  };
  InputLog bake_output_log([](const std::filesystem::path&) { return std::string(); });
  std::optional<InputLogScope> scope;
  if (view) scope.emplace(&bake_output_log);
  const JobResult result = run_job(
      open_device, job,
      [&](double share, std::string_view stage) { return console.progress(share, stage); }, hooks);
  scope.reset();
  if (result.cancelled) return kExitCancelled;
  if (job.json == "-") save_report("-", result.report);
  for (const Warning& warning : result.causes) console.warning(warning.message);
  for (const Message& line : result.summary) console.line(line.text(option_as_flag));
  if (view) {
    // The page is made from the asset's files, so these are placed first, and stay if the page fails.
    commit_outputs(bake_output_log);
    write_view(*view, console);
  }
  if (result.failure.empty()) return 0;
  print_line(stderr, "kiln: " + result.failure.text(option_as_flag));
  return 1;
}

}  // namespace

Run add_bake(Command& app) {
  Command* command = app.add_command(
      "bake", "Bake the detail of HIGH into textures of LOW (made from HIGH if LOW is not given)");
  auto job = std::make_shared<Job>();
  add_options(*command, bake_rows(), job.get());
  command->add_text_flag("--help-json", options_json,
                         "All options as JSON, for programs: types, units, ranges, defaults");
  auto page = std::make_shared<std::string>();
  command->add_option(
      "--page", [page](const Option::Words& words) { *page = words.back(); },
      "Also write a page (HTML) that shows the asset of --out beside HIGH in a browser, as kiln "
      "view does");
  auto prints_job = std::make_shared<bool>(false);
  command->add_flag(
      "--print-job", [prints_job](const Option::Words&) { *prints_job = true; },
      "Print the command as a job file for kiln run, without baking");
  return [command, job, prints_job, page] {
    job->given = given_flags(*command);
    job->given.erase("--page");
    if (*prints_job) {
      job->given.erase("--print-job");
      check(*job);
      print_text(stdout, to_job_file(to_json(*job)));
      return 0;
    }
    return run_bake(*job, *page);
  };
}

}  // namespace kiln::cli
