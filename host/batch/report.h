// Writes reports of runs as JSON, reads and merges them, and compares a report with a former one, the baseline.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "batch/assets.h"
#include "batch/runner.h"
#include "options/json.h"

namespace kiln {

/// Facts about the whole run, for the start of its report.
struct ReportHead {
  std::string job;      ///< Path of the job file as the caller gave it
  std::string profile;  ///< Name of the profile; empty: none
  std::string shard;    ///< The shard, such as "2/8"; empty: the run has all assets
  double seconds = 0;   ///< Wall-clock time of the run
};

/// Builds the report that `kiln run --json FILE` writes.
Json report_of(const ReportHead& head, const Batch& batch, const std::vector<AssetResult>& results);

/// Returns the JSON Schema (2020-12) of the reports of report_of(), with the members that pages add.
std::string report_schema();

/// Markers before and after the report in a page. The report is JSON with escaped "<".
inline constexpr std::string_view kReportBegin = "<script type=\"application/json\" id=\"report\">";
inline constexpr std::string_view kReportEnd = "</script>";

/// Serialises a report for a page, such that its text cannot close the script element.
std::string report_in_page(const Json& report);

/// Reads a report from a file of --json, or from a page of --report.
/// \param what  start of messages, such as "--baseline 'old.json'"
/// \throws Error(input)
Json read_report(const std::filesystem::path& path, const std::string& what);

/// Merges the reports of all shards of a run.
/// \param names  names of the files, for messages
/// \throws Error(usage) if they have different job files, profiles or versions, share an asset, or if a shard is
///         missing
Json merge_reports(const std::vector<Json>& reports, const std::vector<std::string>& names);

/// Compares a report with a former one. Adds "baseline" to each asset: `state` (same, changed or new), `what` (one
/// sentence per difference) and `worse` (a number, positive if the asset is worse than before, negative if better).
/// Adds "gone" to the report, a list of the assets that only the former report has.
void add_baseline(Json& report, const Json& former);

/// Counts the assets in each state.
Json count_states(const Json& assets);

/// Encodes bytes as base64 (RFC 4648).
std::string base64(std::string_view bytes);

}  // namespace kiln
