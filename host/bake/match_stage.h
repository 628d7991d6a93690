// Runs the match as a stage of a bake: makes a matcher from the options, and adds its notes to the report.
#pragma once

#include <cstdint>
#include <memory>

#include "bake/progress.h"
#include "kiln/bake.h"
#include "match/registry.h"
#include "texel/sample_directions.h"
#include "texel/sheet_distances.h"

namespace kiln {

/// Share of a bake's progress for the preparation of matches that take long to prepare.
inline constexpr double kPreparingShare = 0.5;

/// Checks all options that do not depend on meshes. \throws Error(usage)
void check_options(const BakeOptions& options);

/// Converts options to the request of a match.
MatchRequest match_request(const BakeOptions& options, const Source::Impl& source,
                           const LowSurface& surface);

/// The cluster of visibility directions that is baked, and data that all clusters share.
struct Clusters {
  std::uint32_t cluster = 0;
  /// The visibility field: computed for the first cluster, and kept for later bakes if there is one cluster
  /// only.
  std::shared_ptr<const VisibilityField> field;
};

/// Computes the directions of samples, blended at hard edges, for matches that search along
/// directions; see RayOptions.
/// \param report out: angles by which directions change at hard edges; may be null
SampleDirections make_sample_directions(const BakeOptions& options, const Source::Impl& source,
                                        const LowSurface& surface, EdgeReport* report = nullptr);
/// True if the blending of directions depends on the high poly, so that it must be updated when the
/// high poly changes.
bool directions_depend_on_high(const BakeOptions& options);

/// Returns the larger search distances for samples that lie on open sheets and find no point
/// nearby; empty if the options set the distance.
SheetDistances sheet_distances(const BakeOptions& options, const LowSurface& surface);

/// Moves the notes of a match, such as warnings, to the report.
void add_notes(MatchNotes notes, BakeReport& report);

/// Makes the matcher that the options select, and the structures of the source that it needs. Adds facts that are
/// known before the first band to the report.
/// \param blends_directions samples' directions are blended at hard edges: samples that miss are
/// retried along averaged directions
/// \throws Error(usage) for an option out of its range, Cancelled if the progress callback returns false
std::unique_ptr<Matcher> make_matcher(const Source::Impl& source, const LowSurface& surface,
                                      const BakeOptions& options, BakeReport& report,
                                      Clusters& clusters, const BakeProgress& progress,
                                      bool blends_directions = false);

}  // namespace kiln
