// Reports of runs: as JSON with a schema, several as one, and one beside a former one.
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

/// What a report says beside its assets.
struct ReportHead {
  std::string job;      ///< The job file, as it was given
  std::string profile;  ///< Empty: none
  std::string shard;    ///< "2/8"; empty: all
  double seconds = 0;   ///< By the clock
};

/// What `kiln run --json FILE` writes.
Json report_of(const ReportHead& head, const Batch& batch, const std::vector<AssetResult>& results);

/// A JSON Schema (2020-12) of report_of(), with what pages add to it.
std::string report_schema();

/// Before and after the report in a page, which is JSON whose "<" are escaped.
inline constexpr std::string_view kReportBegin = "<script type=\"application/json\" id=\"report\">";
inline constexpr std::string_view kReportEnd = "</script>";

/// A report as a page holds it: no byte of it ends its element.
std::string report_in_page(const Json& report);

/// Reads a report from a file of --json, or from a page of --report.
/// \param what  begins messages: "--baseline 'old.json'" \throws Error(input)
Json read_report(const std::filesystem::path& path, const std::string& what);

/// Joins reports of the parts of one run. \param names  of the files, for messages
/// \throws Error(usage) where they are of other job files, profiles or versions, have an asset twice, or where a part is
///         missing
Json merge_reports(const std::vector<Json>& reports, const std::vector<std::string>& names);

/// Notes in each asset how it differs from that of a former report: "baseline" with `state` (same, changed, new), `what`
/// (sentences) and `worse` (greater: worse; below 0: better). Assets that are gone stand in the report's "gone".
void add_baseline(Json& report, const Json& former);

/// Counts of the assets' states.
Json states_of(const Json& assets);

/// Bytes as base64 (RFC 4648).
std::string base64(std::string_view bytes);

}  // namespace kiln
