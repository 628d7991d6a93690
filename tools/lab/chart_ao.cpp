#include "lab/chart_ao.h"

#include <algorithm>
#include <array>

#include "lab/chart.h"

namespace kiln::cli {
namespace {

/// Of its rays, --ao-error casts a quarter before anything is smoothed, and more only where the error asks for
/// it: an error of 1 never does.
constexpr std::uint32_t kSmoothedShare = 4;

AoSetting by_rays(std::uint32_t rays) {
  const std::string count = std::to_string(rays);
  AoSetting setting{"ao_rays_" + count, count + " rays", "--ao-rays " + count, AoFamily::rays, {}};
  setting.occlusion.rays = rays;
  return setting;
}

AoSetting smoothed(std::uint32_t rays) {
  const std::string count = std::to_string(rays);
  AoSetting setting{"ao_smooth_" + count,
                    count + " smoothed",
                    "--ao-rays " + std::to_string(kSmoothedShare * rays) + " --ao-error 1",
                    AoFamily::smooth,
                    {}};
  setting.occlusion.rays = kSmoothedShare * rays;
  setting.occlusion.max_error = 1;
  return setting;
}

AoSetting by_views(std::uint32_t views) {
  const std::string count = std::to_string(views);
  AoSetting setting{"ao_views_" + count,
                    count + " views",
                    "--ao-by views --ao-views " + count,
                    AoFamily::views,
                    {}};
  setting.occlusion.by = OcclusionBy::views;
  setting.occlusion.views = views;
  return setting;
}

BakeResult bake_ao(const Source& source, const Mesh& low, const AoSetting& setting,
                   const AoChartOptions& options, bool report_errors, const Progress& progress) {
  BakeOptions bake_with;
  // All settings can be asked of it.
  bake_with.maps = {std::find_if(maps().begin(), maps().end(), [](const MapInfo& map) {
                      return map.takes_max_error && map.takes_views;
                    })->kind};
  bake_with.width = bake_with.height = options.size;
  bake_with.max_distance = options.max_distance;
  bake_with.occlusion = setting.occlusion;
  bake_with.report_errors = report_errors;
  bake_with.recall = 0;
  bake_with.progress = progress;
  return bake(source, low, bake_with);
}

void mark_front(std::vector<AoRow>& rows) {
  std::vector<std::array<double, 2>> points;
  for (const AoRow& row : rows) points.push_back({row.seconds, row.error.rms});
  const std::vector<bool> front = pareto_front(points);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].front = front[i];
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[(values.size() - 1) / 2];
}

}  // namespace

const char* family_name(AoFamily family) {
  switch (family) {
    case AoFamily::rays:
      return "ao_rays";
    case AoFamily::smooth:
      return "ao_smooth";
    case AoFamily::views:
      break;
  }
  return "ao_views";
}

std::vector<AoSetting> ao_settings() {
  std::vector<AoSetting> settings;
  for (std::uint32_t rays = 8; rays <= 1024; rays *= 2) settings.push_back(by_rays(rays));
  for (std::uint32_t rays = 8; rays <= 1024; rays *= 2) settings.push_back(smoothed(rays));
  for (std::uint32_t views = 64; views <= 512; views *= 2) settings.push_back(by_views(views));
  return settings;
}

void choose_ao(const AoChartOptions& options, AoChart& chart) {
  const std::vector<AoRow>& rows = chart.rows;
  const auto best = [&](const auto& value, const auto& allowed) {
    std::optional<std::size_t> found;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (allowed(rows[i]) && (!found || value(rows[i]) < value(rows[*found]))) found = i;
    }
    return found;
  };
  const auto seconds = [](const AoRow& row) { return row.seconds; };
  const auto error = [](const AoRow& row) { return row.error.rms; };
  const auto all = [](const AoRow&) { return true; };
  if (options.budget) {
    chart.for_budget =
        best(error, [&](const AoRow& row) { return row.seconds <= *options.budget; });
    chart.within_budget = chart.for_budget.has_value();
    if (!chart.within_budget) chart.for_budget = best(seconds, all);
  }
  if (options.error) {
    const double wanted = *options.error * 255;
    chart.for_error = best(seconds, [&](const AoRow& row) { return row.error.rms <= wanted; });
    chart.reaches_error = chart.for_error.has_value();
    if (!chart.reaches_error) chart.for_error = best(error, all);
  }
}

std::optional<AoChart> run_ao_chart(const Device& device, const Mesh& high, const Mesh& low,
                                    const AoChartOptions& options, const Progress& progress) {
  const Source source(device, high);
  AoChart chart;
  // Measuring counts as one more bake.
  double done = 0;
  const double steps = static_cast<double>(options.settings.size() * (2 + options.repeat));
  std::string stage;
  const auto show = [&](double share, std::string_view) {
    return progress((done + share) / steps, stage);
  };
  for (const AoSetting& setting : options.settings) {
    stage = "measuring ambient occlusion, " + setting.label;
    const BakeResult baked = bake_ao(source, low, setting, options, true, show);
    if (baked.cancelled) return std::nullopt;
    if (baked.report.errors.empty()) {
      throw Error(ErrorCode::input, "'" + low.name + "' has no texel at " +
                                        std::to_string(options.size) +
                                        " texels a side that its high poly is found for, so "
                                        "there is no ambient occlusion to compare: use a larger "
                                        "--size.");
    }
    AoRow row;
    row.setting = setting;
    row.error = baked.report.errors.front();  // of rays from the same points; finer points follow
    chart.rows.push_back(std::move(row));
    done += 2;
  }
  // In turns, so that what else the machine does falls on all alike.
  for (std::uint32_t run = 0; run < options.repeat; ++run) {
    for (AoRow& row : chart.rows) {
      stage = "timing ambient occlusion, " + row.setting.label + ", run " +
              std::to_string(run + 1) + " of " + std::to_string(options.repeat);
      const BakeResult baked = bake_ao(source, low, row.setting, options, false, show);
      if (baked.cancelled) return std::nullopt;
      row.runs.push_back(baked.report.seconds_detail);
      done += 1;
    }
  }
  for (AoRow& row : chart.rows) row.seconds = median(row.runs);
  mark_front(chart.rows);
  choose_ao(options, chart);
  return chart;
}

}  // namespace kiln::cli
