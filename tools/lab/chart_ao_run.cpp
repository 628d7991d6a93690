// The part of `kiln chart` that gathers ambient occlusion.
#include <algorithm>
#include <utility>

#include "lab/chart_run.h"

namespace kiln::cli {

AoChartOptions ao_options(const ChartArguments& a) {
  AoChartOptions options;
  options.size = a.options.size;
  options.repeat = a.options.repeat;
  options.budget = a.ao_budget;
  options.error = a.ao_error;
  for (AoSetting& setting : ao_settings()) {
    const bool named =
        std::find(a.settings.begin(), a.settings.end(), setting.name) != a.settings.end();
    if (named) options.settings.push_back(std::move(setting));
  }
  if (a.ao && options.settings.empty()) options.settings = ao_settings();
  return options;
}

void check_ao(const ChartArguments& a) {
  const bool charted = !ao_options(a).settings.empty();
  for (const auto& [flag, given] : {std::pair("--ao-error", a.ao_error.has_value()),
                                    std::pair("--ao-budget", a.ao_budget.has_value())}) {
    if (given && !charted) {
      throw Error(ErrorCode::usage, std::string(flag) +
                                        " chooses among ways to gather ambient occlusion, but "
                                        "none is charted: add --ao.");
    }
  }
  if (a.ao_error == 0) {
    throw Error(ErrorCode::usage, "--ao-error is 0, but must be above 0, such as 2/255.");
  }
}

bool add_ao(const Device& device, const Mesh& high, const Mesh& low, const AoChartOptions& options,
            const Progress& progress, ChartPair& pair, Json& json) {
  if (options.settings.empty()) return true;
  pair.ao = run_ao_chart(device, high, low, options, progress);
  if (pair.ao) json["ao"] = cli::describe(*pair.ao, options);
  return pair.ao.has_value();
}

}  // namespace kiln::cli
