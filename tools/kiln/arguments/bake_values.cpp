#include "arguments/bake_values.h"

#include <algorithm>

namespace kiln::cli {

const std::map<std::string, NormalMapSpace>& space_values() {
  static const std::map<std::string, NormalMapSpace> values = {{"tangent", NormalMapSpace::tangent},
                                                               {"object", NormalMapSpace::object},
                                                               {"face", NormalMapSpace::face}};
  return values;
}

const std::map<std::string, Bitangent>& bitangent_values() {
  static const std::map<std::string, Bitangent> values = {{"pixel", Bitangent::pixel},
                                                          {"vertex", Bitangent::vertex}};
  return values;
}

const std::map<std::string, Triangulation>& triangulation_values() {
  static const std::map<std::string, Triangulation> values = {
      {"auto", Triangulation::automatic},
      {"blender", Triangulation::blender},
      {"fan", Triangulation::fan},
      {"shortest", Triangulation::shortest}};
  return values;
}

const std::map<std::string, MissPolicy>& miss_values() {
  static const std::map<std::string, MissPolicy> values = {
      {"keep", MissPolicy::keep}, {"fill", MissPolicy::fill}, {"mark", MissPolicy::mark}};
  return values;
}

const std::map<std::string, RayTraversal>& traversal_values() {
  static const std::map<std::string, RayTraversal> values = {
      {"auto", RayTraversal::automatic}, {"cpu", RayTraversal::cpu}, {"gpu", RayTraversal::gpu}};
  return values;
}

const std::map<std::string, RayRule>& ray_rule_values() {
  static const std::map<std::string, RayRule> values = {{"outermost", RayRule::outermost},
                                                        {"nearest", RayRule::nearest}};
  return values;
}

const std::map<std::string, OcclusionBy>& occlusion_by_values() {
  static const std::map<std::string, OcclusionBy> values = {
      {"rays", OcclusionBy::rays}, {"views", OcclusionBy::views}, {"auto", OcclusionBy::automatic}};
  return values;
}

const std::map<std::string, RayDirection>& ray_direction_values() {
  static const std::map<std::string, RayDirection> values = {{"auto", RayDirection::automatic},
                                                             {"averaged", RayDirection::averaged},
                                                             {"face", RayDirection::face},
                                                             {"painted", RayDirection::painted}};
  return values;
}

const std::map<std::string, VisibilityAt>& visibility_at_values() {
  static const std::map<std::string, VisibilityAt> values = {{"face", VisibilityAt::face},
                                                             {"vertex", VisibilityAt::vertex},
                                                             {"texel", VisibilityAt::texel}};
  return values;
}

const std::map<std::string, VisibilityTest>& visibility_test_values() {
  static const std::map<std::string, VisibilityTest> values = {{"auto", VisibilityTest::automatic},
                                                               {"views", VisibilityTest::views},
                                                               {"rays", VisibilityTest::rays}};
  return values;
}

const std::map<std::string, ViewLikelihood>& likelihood_values() {
  static const std::map<std::string, ViewLikelihood> values = {{"all", ViewLikelihood::all},
                                                               {"horizon", ViewLikelihood::horizon},
                                                               {"up", ViewLikelihood::up}};
  return values;
}

const std::map<std::string, ViewCriterion>& criterion_values() {
  static const std::map<std::string, ViewCriterion> values = {{"depth", ViewCriterion::depth},
                                                              {"distance", ViewCriterion::distance},
                                                              {"angle", ViewCriterion::angle}};
  return values;
}

const std::map<std::string, ImageFormat>& format_values() {
  static const std::map<std::string, ImageFormat> values = {{"exr", ImageFormat::exr_half},
                                                            {"exr32", ImageFormat::exr_float},
                                                            {"png16", ImageFormat::png16},
                                                            {"png8", ImageFormat::png8}};
  return values;
}

const std::map<std::string, MissPolicy>& fallback_miss_values() {
  static const std::map<std::string, MissPolicy> values = {
      {"low", MissPolicy::keep},
      {"fill", MissPolicy::fill},
      {"mark", MissPolicy::mark},
      {"none", MissPolicy::mark}};  // the older name
  return values;
}

const std::map<std::string, IdBy>& id_by_values() {
  static const std::map<std::string, IdBy> values = {{"part", IdBy::part},
                                                     {"material", IdBy::material},
                                                     {"group", IdBy::group},
                                                     {"object", IdBy::object}};
  return values;
}

const std::map<std::string, PartsBy>& parts_by_values() {
  static const std::map<std::string, PartsBy> values = {{"name", PartsBy::name},
                                                        {"group", PartsBy::group},
                                                        {"object", PartsBy::object},
                                                        {"material", PartsBy::material},
                                                        {"list", PartsBy::list}};
  return values;
}

const std::map<std::string, UvCopies>& uv_copies_values() {
  static const std::map<std::string, UvCopies> values = {
      {"plain", UvCopies::plain}, {"mirrored", UvCopies::mirrored}, {"first", UvCopies::first}};
  return values;
}

MissPolicy miss_policy(const BakeArguments& a) {
  const auto said = fallback_miss_values().find(a.fallback.back());
  return said != fallback_miss_values().end() && said->second != MissPolicy::keep
             ? said->second
             : miss_values().at(a.miss);
}

std::vector<MatchMethod> fallback_methods(const BakeArguments& a) {
  std::vector<MatchMethod> methods;
  for (const std::string& name : a.fallback) {
    if (!fallback_miss_values().contains(name)) methods.push_back(find_match(name).method);
  }
  return methods;
}

bool matches_by(const BakeArguments& a, MatchMethod method) {
  return a.match == method.name ||
         std::find(a.fallback.begin(), a.fallback.end(), method.name) != a.fallback.end();
}

}  // namespace kiln::cli
