#include "arguments/match_flags.h"

#include <algorithm>
#include <utility>

#include "arguments/bake_flags.h"
#include "arguments/bake_values.h"
#include "arguments/cage_file.h"

namespace kiln::cli {

namespace {

using AddFlags = void (*)(Command&, BakeArguments&);

/// Adds parts of the bake's flags, and keeps those wanted, below one heading. \returns their names
template <typename Wanted>
std::set<std::string> add_some(Command& command, BakeArguments& arguments,
                               std::initializer_list<AddFlags> parts, const char* heading,
                               const Wanted& wanted) {
  const std::vector<Option*> before = command.get_options();
  for (const AddFlags add : parts) add(command, arguments);
  std::set<std::string> added;
  for (Option* option : command.get_options()) {
    if (std::find(before.begin(), before.end(), option) != before.end()) continue;
    const std::string name = option->get_name();
    if (!wanted(name)) {
      command.remove_option(option);
    } else {
      option->group(heading);
      added.insert(name);
    }
  }
  return added;
}

}  // namespace

std::set<std::string> add_matching_flags(Command& command, BakeArguments& arguments,
                                         const std::set<std::string>& without) {
  // What a match has no say in, or what is of maps alone.
  static const std::set<std::string> never = {
      "--max-angle",           "--save-match",           "--reasons",  "--recall",
      "--visibility-clusters", "--visibility-deviation", "--save-cage"};
  return add_some(command, arguments, {add_file_list_flags, add_match_flags, add_view_flags},
                  "The match, as of kiln bake", [&](const std::string& name) {
                    return !without.contains(name) && !never.contains(name);
                  });
}

std::set<std::string> add_measured_map_flags(Command& command, BakeArguments& arguments) {
  constexpr const char* kHeading = "Maps whose errors are told, as of kiln bake";
  std::set<std::string> added =
      add_some(command, arguments, {add_map_flags, add_file_flags}, kHeading,
               [](const std::string& name) { return name == "--maps" || name == "--transfer"; });
  added.merge(add_some(command, arguments, {add_detail_flags}, kHeading,
                       [](const std::string&) { return true; }));
  return added;
}

void check_cage_directions(const BakeArguments& arguments, const Mesh& low, const Mesh& cage) {
  if (cage.triangles.size() != low.triangles.size()) return;
  // A vertex of LOW that lies in two places: the cage is a hull that has as many triangles.
  std::vector<std::optional<std::uint32_t>> partner(low.positions.size());
  for (std::size_t t = 0; t < low.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t now = cage.triangles[t][k];
      const std::uint32_t known = partner.at(low.triangles[t][k]).value_or(now);
      if (cage.positions.at(known) != cage.positions.at(now)) return;
      partner[low.triangles[t][k]] = known;
    }
  }
  for (const char* flag : {"--direction", "--edge-width"}) {
    if (!arguments.given.contains(flag)) continue;
    throw Error(ErrorCode::usage, std::string(flag) +
                                      " is for rays without a --cage-mesh of LOW's own triangles, "
                                      "which says where they leave to: leave one out.");
  }
}

void MatchInputs::read(const BakeArguments& arguments, const Mesh& high, const Mesh& low,
                       std::vector<Warning>& warnings) {
  if (!arguments.cage_mesh.empty()) {
    cage_mesh_ =
        load_cage(arguments.cage_mesh, low, load_options(arguments, MeshSide::low), &warnings);
    check_cage_directions(arguments, low, *cage_mesh_);
  }
  if (arguments.match_by != "all") {
    parts_ = pair_parts(high, low, part_names(arguments));
    warnings.insert(warnings.end(), parts_->warnings.begin(), parts_->warnings.end());
  }
  if (!arguments.load_match.empty()) match_ = load_match(arguments.load_match);
  for (const std::string& file : occluder_files(arguments)) {
    occluders_.push_back(load_mesh(file, load_options(arguments, MeshSide::other), &warnings));
  }
}

void MatchInputs::make_cage(const BakeArguments& arguments, const Device& device, const Mesh& high,
                            const Mesh& low, std::vector<Warning>& warnings) {
  if (arguments.cage != kAutomatic) return;
  BakeOptions options = bake_options(arguments);
  apply(options);
  FoundCage found = find_cage(Source(device, high), low, options);
  warnings.insert(warnings.end(), found.warnings.begin(), found.warnings.end());
  cage_mesh_ = std::move(found.mesh);
  found_cage_ = true;
}

void MatchInputs::apply(BakeOptions& options) const {
  if (cage_mesh_) options.match.cage_mesh = &*cage_mesh_;
  if (found_cage_) options.match.max_distance.reset();  // that was for finding it
  if (parts_) options.match.parts = &*parts_;
  for (const Mesh& mesh : occluders_) options.occlusion.by_others.push_back(&mesh);
  if (!match_) return;
  options.match.saved = &*match_;
  options.width = match_->width / match_->samples;
  options.height = match_->height / match_->samples;
  options.samples = match_->samples;
}

MeshFiles load_low_files(const BakeArguments& arguments, std::vector<Warning>& warnings) {
  MeshFiles files = load_meshes(low_files(arguments), load_options(arguments, MeshSide::low),
                                has_more_files(arguments), warnings);
  if (arguments.tangents != "file") {
    files.mesh.tangents = {};
  } else if (arguments.given.contains("--tangents") && files.mesh.tangents.empty()) {
    throw Error(ErrorCode::input,
                "--tangents file: LOW " + in_words(files.files) +
                    " has none. PLY gives them, as properties tx, ty, tz and tw of its vertices, "
                    "beside UVs; leave --tangents out for those of MikkTSpace.");
  }
  turn_normals("LOW", Trusted::normals, files.mesh, warnings);
  return files;
}

Mesh load_low(const BakeArguments& arguments, std::vector<Warning>& warnings) {
  MeshFiles files = load_low_files(arguments, warnings);
  warn_of_shared_texels(files, warnings);
  return arguments.split_at_seams ? split_at_seams(files.mesh) : std::move(files.mesh);
}

}  // namespace kiln::cli
