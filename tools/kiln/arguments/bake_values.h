// What the bake command's options may be, by the words of the command line. For the files of bake_arguments.h.
#pragma once

#include <string>
#include <vector>

#include "arguments/bake_arguments.h"
#include "arguments/words.h"

namespace kiln::cli {

constexpr const char* kAutomatic = "auto";  ///< Of --match and --sets

Words<NormalMapSpace> space_values();
Words<Bitangent> bitangent_values();
Words<Triangulation> triangulation_values();
Words<RayTraversal> traversal_values();
Words<RayRule> ray_rule_values();
Words<OcclusionBy> occlusion_by_values();
Words<OcclusionFalloff> occlusion_falloff_values();
Words<RayDirection> ray_direction_values();
Words<VisibilityAt> visibility_at_values();
Words<VisibilityTest> visibility_test_values();
Words<ViewLikelihood> likelihood_values();
Words<ViewCriterion> criterion_values();
Words<ImageFormat> format_values();
/// What --fallback can end with.
Words<MissPolicy> miss_values();
Words<IdBy> id_by_values();
Words<PartsBy> parts_by_values();
Words<UvCopies> uv_copies_values();
/// Of --sets, beside kAutomatic.
Words<SetsBy> sets_values();

/// What the chain of fallbacks says of misses at its end.
MissPolicy miss_policy(const BakeArguments& arguments);

/// The matches that are asked in turn for what the match leaves undecided.
std::vector<MatchMethod> fallback_methods(const BakeArguments& arguments);

/// True if a match is the one asked for, or one of its fallbacks.
bool matches_by(const BakeArguments& arguments, MatchMethod method);

/// The first match with a property, such as &MatchInfo::takes_views. One must have it.
MatchMethod first_match(bool MatchInfo::*property);

/// A word, and the matches that need nothing of the high poly but its surface.
std::vector<std::string> surface_matches(const char* first);

/// Whether --match has a property, such as &MatchInfo::needs_uvs; never for auto.
bool match_has(const BakeArguments& arguments, bool MatchInfo::*property);
/// Whether --match or one of its fallbacks has it.
bool chain_has(const BakeArguments& arguments, bool MatchInfo::*property);

/// The map that plans measure.
std::string shading_map();
/// Whether --maps has it.
bool bakes_shading_map(const BakeArguments& arguments);

}  // namespace kiln::cli
