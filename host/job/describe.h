// Parts of the --json report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/memory.h"
#include "base/stopwatch.h"
#include "kiln/clean.h"
#include "kiln/contour.h"
#include "kiln/kiln.h"
#include "kiln/measure.h"
#include "kiln/simplify.h"
#include "options/json.h"

namespace kiln {

Json describe(const DeviceInfo& info);
Json describe(const Mesh& mesh, const std::filesystem::path& path);
Json describe(const std::vector<Warning>& warnings);
Json describe(const NormalError& error);
Json describe(const ViewReport& views);
Json describe(const VisibilityReport& visibility);
Json describe(const CageReport& cage);
Json describe(const EdgeReport& edges);
Json describe(const HighCoverageReport& recall);
Json describe(const TransitionReport& transitions);
Json describe(const UvReport& uv);
Json describe(const std::vector<MapError>& errors);
Json describe(const StoredError& error, bool is_normal);
/// Repairs of the high poly.
Json describe(const CleanReport& report);
/// True if a low poly has over 10% more faces than requested (0: no number was requested).
bool misses_faces(const SimplifyReport& report, std::uint32_t asked);
/// The warning for that case.
Message too_many_faces(const SimplifyReport& report, std::uint32_t asked);
/// Repaired and remaining flaws of a low poly.
Json describe_flaws(const SimplifyReport& report);
/// Texels and samples by status.
Json describe_texels(const BakeReport& report);

/// Adds the common end of reports: seconds by stage and in total, memory, written files, warnings.
/// \param seconds  by stage; "total" is added
void add_ending(Json& report, Json seconds, const Stopwatch& watch,
                const std::vector<std::string>& outputs, const std::vector<Warning>& warnings);

/// Flaws of a low poly from a volume.
Json describe_flaws(const ExtractReport& report);
/// Lines about repairs; empty if there were none.
std::vector<std::string> lines_of_flaws(const ExtractReport& report);

/// Warns if a low poly made by Kiln deviates far from the high poly.
/// \param remedy  "Ask for ..."
void warn_of_lost_shape(const SimplifyReport& low, const Message& remedy,
                        std::vector<Warning>& warnings);

}  // namespace kiln
