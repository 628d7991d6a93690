// The match as a stage of a bake: from the options to a matcher, and from its notes to the report.
#pragma once

#include <cstdint>
#include <memory>

#include "bake/progress.h"
#include "match/registry.h"
#include "texel/edge_turn.h"
#include "texel/sheet_reach.h"

namespace kiln {

/// Share of a bake's progress for preparing, of matches that prepare for long.
inline constexpr double kPreparingShare = 0.5;

/// Checks everything in the options that needs no mesh. \throws Error(usage)
void check_options(const BakeOptions& options);

/// The request that options make of a match.
MatchRequest match_request(const BakeOptions& options, const Source::Impl& source,
                           const LowSurface& surface);

/// The cluster of visibility directions that is baked, and what all clusters share.
struct Clusters {
  std::uint32_t cluster = 0;
  /// Made for the first one; of one cluster alone it stays from bake to bake.
  std::shared_ptr<const VisibilityField> field;
};

/// The turn of samples' directions at hard edges, for matches that look along them; see RayOptions.
/// \param report  out: where they turn at hard edges, how far off; may be null
EdgeTurn edge_turn(const BakeOptions& options, const Source::Impl& source,
                   const LowSurface& surface, EdgeReport* report = nullptr);
/// True if they turn as the high poly says, and so change with it.
bool turns_by_source(const BakeOptions& options);

/// Reach of samples on open sheets where nothing is near; none where the options say how far.
SheetReach sheet_reach(const BakeOptions& options, const LowSurface& surface);

/// Adds what a match said of itself to the report.
void take_notes(MatchNotes notes, BakeReport& report);

/// The matcher that the options ask for, with what it needs of the source built. Adds to the report what
/// is known before the first band.
/// \param turned  samples' directions turn at hard edges: where they miss, averaged ones may hit
/// \throws Error(usage) for an option out of its range, Cancelled where the progress callback says stop
std::unique_ptr<Matcher> make_matcher(const Source::Impl& source, const LowSurface& surface,
                                      const BakeOptions& options, BakeReport& report,
                                      Clusters& clusters, const BakeProgress& progress,
                                      bool turned = false);

}  // namespace kiln
