// Conversion of library reports to parts of the --json report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/memory.h"
#include "base/stopwatch.h"
#include "kiln/clean.h"
#include "kiln/contour.h"
#include "kiln/measure.h"
#include "kiln/simplify.h"
#include "mesh/mesh_stream.h"
#include "options/json.h"

namespace kiln {

Json describe(const DeviceInfo& info);
Json describe(const Mesh& mesh, const std::filesystem::path& path);
/// Describes a mesh that is larger than memory, whose UVs are not read.
Json describe(const MeshStream& mesh, const std::filesystem::path& path);
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
/// Repairs of the high poly, by kind.
Json describe(const CleanReport& report);
/// True if a low poly has over 10% more faces than requested.
/// \param requested  number of faces; 0: no number was requested
bool misses_faces(const SimplifyReport& report, std::uint32_t requested);
/// The message of a low poly for which misses_faces() is true.
Message too_many_faces(const SimplifyReport& report, std::uint32_t requested);
/// Flaws of a simplified mesh, repaired and remaining.
Json describe_flaws(const SimplifyReport& report);
/// Numbers of texels, and of samples by status.
Json describe_texels(const BakeReport& report);

/// Adds the keys that end every report: seconds by stage and in total, memory, written files, warnings.
/// \param seconds  by stage; "total" is added
void add_closing_keys(Json& report, Json seconds, const Stopwatch& watch,
                      const std::vector<std::string>& outputs,
                      const std::vector<Warning>& warnings);

/// Flaws of a mesh extracted from a volume, repaired and remaining.
Json describe_flaws(const ExtractReport& report);
/// Summary lines about repairs of an extracted mesh; empty if there were none.
std::vector<std::string> flaw_lines(const ExtractReport& report);

/// Warns if a low poly that Kiln made deviates by more than 5% of the diagonal from the high poly.
/// \param remedy  a sentence that ends the message, such as "Ask for more faces."
void warn_of_lost_shape(const SimplifyReport& low, const Message& remedy,
                        std::vector<Warning>& warnings);

}  // namespace kiln
