// What the bake command's options may be, by the words of the command line. For the files of bake_arguments.h.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

#include "arguments/bake_arguments.h"

namespace kiln::cli {

constexpr const char* kAutomatic = "auto";  ///< Of --match

const std::map<std::string, NormalMapSpace>& space_values();
const std::map<std::string, Bitangent>& bitangent_values();
const std::map<std::string, Triangulation>& triangulation_values();
const std::map<std::string, MissPolicy>& miss_values();
const std::map<std::string, RayTraversal>& traversal_values();
const std::map<std::string, RayRule>& ray_rule_values();
const std::map<std::string, OcclusionBy>& occlusion_by_values();
const std::map<std::string, RayDirection>& ray_direction_values();
const std::map<std::string, VisibilityAt>& visibility_at_values();
const std::map<std::string, VisibilityTest>& visibility_test_values();
const std::map<std::string, ViewLikelihood>& likelihood_values();
const std::map<std::string, ViewCriterion>& criterion_values();
const std::map<std::string, ImageFormat>& format_values();
/// What --fallback can end with: other ways to say --miss.
const std::map<std::string, MissPolicy>& fallback_miss_values();

template <typename T>
CLI::Validator one_of(const std::map<std::string, T>& values) {
  std::vector<std::string> names;
  for (const auto& [name, value] : values) names.push_back(name);
  return CLI::IsMember(names, CLI::ignore_case);
}

/// A value as it is written on the command line.
template <typename T>
std::string name_of(const std::map<std::string, T>& values, T wanted) {
  for (const auto& [name, value] : values) {
    if (value == wanted) return name;
  }
  throw Error(ErrorCode::internal, "An option's value has no name.");
}

const std::map<std::string, IdBy>& id_by_values();
const std::map<std::string, PartsBy>& parts_by_values();
const std::map<std::string, UvCopies>& uv_copies_values();

/// What the chain of fallbacks says of misses at its end, or else --miss.
MissPolicy miss_policy(const BakeArguments& arguments);

/// The matches that are asked in turn for what the match leaves undecided.
std::vector<MatchMethod> fallback_methods(const BakeArguments& arguments);

/// Whether a match is the one asked for, or one of its fallbacks.
bool matches_by(const BakeArguments& arguments, MatchMethod method);

}  // namespace kiln::cli
