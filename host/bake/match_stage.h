// The match as a stage of a bake: makes a matcher from the options, and adds its notes to the report.
#pragma once

#include <cstdint>
#include <memory>

#include "bake/progress.h"
#include "match/registry.h"
#include "texel/edge_turn.h"
#include "texel/sheet_reach.h"

namespace kiln {

/// Share of a bake's progress for preparing matches with a long preparation.
inline constexpr double kPreparingShare = 0.5;

/// Checks all options that do not depend on meshes. \throws Error(usage)
void check_options(const BakeOptions& options);

/// Converts options to the request of a match.
MatchRequest match_request(const BakeOptions& options, const Source::Impl& source,
                           const LowSurface& surface);

/// The baked cluster of visibility directions, and data that all clusters share.
struct Clusters {
  std::uint32_t cluster = 0;
  /// Computed for the first cluster; a bake with one cluster keeps it for later bakes.
  std::shared_ptr<const VisibilityField> field;
};

/// The turn of samples' directions at hard edges, for matches that search along them; see RayOptions.
/// \param report  out: angles by which directions turn at hard edges; may be null
EdgeTurn edge_turn(const BakeOptions& options, const Source::Impl& source,
                   const LowSurface& surface, EdgeReport* report = nullptr);
/// True if the turn depends on the high poly, and has to be updated with it.
bool turns_by_source(const BakeOptions& options);

/// Larger search distance for samples on open sheets without a surface nearby; none if the options set the distance.
SheetReach sheet_reach(const BakeOptions& options, const LowSurface& surface);

/// Moves a match's notes to the report.
void add_notes(MatchNotes notes, BakeReport& report);

/// Makes the options' matcher, and the structures of the source that it needs. Adds to the report what is known before
/// the first band.
/// \param turned  samples' directions turn at hard edges: where they miss, averaged ones may hit
/// \throws Error(usage) for an option out of its range, Cancelled if the progress callback returns false
std::unique_ptr<Matcher> make_matcher(const Source::Impl& source, const LowSurface& surface,
                                      const BakeOptions& options, BakeReport& report,
                                      Clusters& clusters, const BakeProgress& progress,
                                      bool turned = false);

}  // namespace kiln
