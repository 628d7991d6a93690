#include "arguments/bake_values.h"

#include <algorithm>

namespace kiln::cli {

Words<NormalMapSpace> space_values() {
  static constexpr Words<NormalMapSpace>::Row kRows[] = {{"face", NormalMapSpace::face},
                                                         {"object", NormalMapSpace::object},
                                                         {"tangent", NormalMapSpace::tangent}};
  return kRows;
}

Words<Bitangent> bitangent_values() {
  static constexpr Words<Bitangent>::Row kRows[] = {{"pixel", Bitangent::pixel},
                                                    {"vertex", Bitangent::vertex}};
  return kRows;
}

Words<Triangulation> triangulation_values() {
  static constexpr Words<Triangulation>::Row kRows[] = {{"auto", Triangulation::automatic},
                                                        {"blender", Triangulation::blender},
                                                        {"fan", Triangulation::fan},
                                                        {"shortest", Triangulation::shortest}};
  return kRows;
}

Words<RayTraversal> traversal_values() {
  static constexpr Words<RayTraversal>::Row kRows[] = {
      {"auto", RayTraversal::automatic}, {"cpu", RayTraversal::cpu}, {"gpu", RayTraversal::gpu}};
  return kRows;
}

Words<RayRule> ray_rule_values() {
  static constexpr Words<RayRule>::Row kRows[] = {{"nearest", RayRule::nearest},
                                                  {"outermost", RayRule::outermost}};
  return kRows;
}

Words<OcclusionBy> occlusion_by_values() {
  static constexpr Words<OcclusionBy>::Row kRows[] = {
      {"auto", OcclusionBy::automatic}, {"rays", OcclusionBy::rays}, {"views", OcclusionBy::views}};
  return kRows;
}

Words<OcclusionFalloff> occlusion_falloff_values() {
  static constexpr Words<OcclusionFalloff>::Row kRows[] = {{"linear", OcclusionFalloff::linear},
                                                           {"none", OcclusionFalloff::none},
                                                           {"smooth", OcclusionFalloff::smooth}};
  return kRows;
}

Words<RayDirection> ray_direction_values() {
  static constexpr Words<RayDirection>::Row kRows[] = {{"auto", RayDirection::automatic},
                                                       {"averaged", RayDirection::averaged},
                                                       {"face", RayDirection::face},
                                                       {"painted", RayDirection::painted}};
  return kRows;
}

Words<VisibilityAt> visibility_at_values() {
  static constexpr Words<VisibilityAt>::Row kRows[] = {{"face", VisibilityAt::face},
                                                       {"texel", VisibilityAt::texel},
                                                       {"vertex", VisibilityAt::vertex}};
  return kRows;
}

Words<VisibilityTest> visibility_test_values() {
  static constexpr Words<VisibilityTest>::Row kRows[] = {{"auto", VisibilityTest::automatic},
                                                         {"rays", VisibilityTest::rays},
                                                         {"views", VisibilityTest::views}};
  return kRows;
}

Words<ViewLikelihood> likelihood_values() {
  static constexpr Words<ViewLikelihood>::Row kRows[] = {{"all", ViewLikelihood::all},
                                                         {"horizon", ViewLikelihood::horizon},
                                                         {"up", ViewLikelihood::up}};
  return kRows;
}

Words<ViewCriterion> criterion_values() {
  static constexpr Words<ViewCriterion>::Row kRows[] = {{"angle", ViewCriterion::angle},
                                                        {"depth", ViewCriterion::depth},
                                                        {"distance", ViewCriterion::distance}};
  return kRows;
}

Words<ImageFormat> format_values() {
  static constexpr Words<ImageFormat>::Row kRows[] = {
      {"exr", ImageFormat::exr_half},     {"exr32", ImageFormat::exr_float},
      {"png16", ImageFormat::png16},      {"png8", ImageFormat::png8},
      {"tiff16", ImageFormat::tiff16},    {"tiff8", ImageFormat::tiff8},
      {"tiff32", ImageFormat::tiff_float}};
  return kRows;
}

Words<MissPolicy> miss_values() {
  static constexpr Words<MissPolicy>::Row kRows[] = {
      {"fill", MissPolicy::fill}, {"low", MissPolicy::keep}, {"mark", MissPolicy::mark}};
  return kRows;
}

Words<IdBy> id_by_values() {
  static constexpr Words<IdBy>::Row kRows[] = {{"group", IdBy::group},
                                               {"material", IdBy::material},
                                               {"object", IdBy::object},
                                               {"part", IdBy::part}};
  return kRows;
}

Words<PartsBy> parts_by_values() {
  static constexpr Words<PartsBy>::Row kRows[] = {{"group", PartsBy::group},
                                                  {"list", PartsBy::list},
                                                  {"material", PartsBy::material},
                                                  {"name", PartsBy::name},
                                                  {"object", PartsBy::object}};
  return kRows;
}

Words<SetsBy> sets_values() {
  static constexpr Words<SetsBy>::Row kRows[] = {{"material", SetsBy::material},
                                                 {"none", SetsBy::none},
                                                 {"object", SetsBy::object},
                                                 {"udim", SetsBy::udim}};
  return kRows;
}

Words<UvCopies> uv_copies_values() {
  static constexpr Words<UvCopies>::Row kRows[] = {
      {"first", UvCopies::first}, {"mirrored", UvCopies::mirrored}, {"plain", UvCopies::plain}};
  return kRows;
}

std::vector<std::string> default_maps() {
  std::vector<std::string> names;
  for (const MapKind map : BakeOptions().maps) names.emplace_back(map.name);
  return names;
}

std::string default_match() { return std::string(BakeOptions().match.method.name); }

MatchMethod first_match(bool MatchInfo::*property) {
  return std::find_if(matches().begin(), matches().end(),
                      [&](const MatchInfo& match) { return match.*property; })
      ->method;
}

std::vector<std::string> surface_matches(const char* first) {
  std::vector<std::string> names = {first};
  for (const MatchInfo& match : matches()) {
    const bool more =
        match.needs_uvs || match.needs_direction || match.takes_views || match.takes_visibility;
    if (!more) names.emplace_back(match.method.name);
  }
  return names;
}

MissPolicy miss_policy(const BakeArguments& a) {
  const MissPolicy* const said = miss_values().find(a.fallback.back());
  return said != nullptr ? *said : MissPolicy::keep;
}

std::vector<MatchMethod> fallback_methods(const BakeArguments& a) {
  std::vector<MatchMethod> methods;
  for (const std::string& name : a.fallback) {
    if (!miss_values().contains(name)) methods.push_back(find_match(name).method);
  }
  return methods;
}

bool matches_by(const BakeArguments& a, MatchMethod method) {
  return a.match == method.name ||
         std::find(a.fallback.begin(), a.fallback.end(), method.name) != a.fallback.end();
}

bool match_has(const BakeArguments& a, bool MatchInfo::*property) {
  return a.match != kAutomatic && find_match(a.match).*property;
}

bool chain_has(const BakeArguments& a, bool MatchInfo::*property) {
  return std::any_of(matches().begin(), matches().end(), [&](const MatchInfo& match) {
    return match.*property && matches_by(a, match.method);
  });
}

std::string shading_map() {
  const auto map =
      std::find_if(maps().begin(), maps().end(), [](const MapInfo& info) { return info.shades; });
  return std::string(map->kind.name);
}

bool bakes_shading_map(const BakeArguments& a) {
  return std::find(a.maps.begin(), a.maps.end(), shading_map()) != a.maps.end();
}

}  // namespace kiln::cli
