// What a chart leaves behind: data, a table, a plot, the report.
#pragma once

#include <string>
#include <vector>

#include "lab/chart.h"
#include "picture/plot.h"
#include "report/report.h"

namespace kiln::cli {

constexpr const char* kChartName = "chart";  ///< Of the files, without their endings

/// With so many digits after the point.
std::string fixed_text(double value, int digits);
/// Inside a table of Markdown.
std::string markdown_cell(const std::string& text);

/// "map_error", "object_space", ...: as in the files.
const char* measure_name(ChartMeasure measure);

/// The rows of a measure's front, by seconds.
std::vector<const ChartRow*> front_rows(const ChartPair& pair, ChartMeasure measure);

/// Comma-separated values, a line a pair and setting after a line of column names.
std::string chart_data(const std::vector<ChartPair>& pairs);

/// A table a pair, in Markdown.
std::string chart_table(const std::vector<ChartPair>& pairs, const ChartOptions& options,
                        const AoChartOptions& ao, const DeviceInfo& device);

/// Of ambient occlusion: a line a pair and setting. Empty where no pair has it.
std::string chart_ao_data(const std::vector<ChartPair>& pairs);

/// A row of panels a pair, one a measure, and one of ambient occlusion.
Plot chart_plot(const std::vector<ChartPair>& pairs, const ChartOptions& options,
                const DeviceInfo& device);

/// Ends a subtitle: how many runs the seconds come from.
std::string runs_note(unsigned repeat);

/// One line for a person.
std::string summary(const ChartRow& row);

/// Everything of a pair, for the report.
Json describe(const ChartPair& pair);

}  // namespace kiln::cli
