#include "arguments/match_flags.h"

#include <algorithm>
#include <utility>

#include "arguments/bake_job.h"
#include "arguments/cage_file.h"
#include "arguments/transfers.h"
#include "kiln/cage.h"

namespace kiln::cli {

namespace {

std::set<std::string> flags_of(const std::vector<OptionRow>& rows) {
  std::set<std::string> flags;
  for (const OptionRow& row : rows) flags.insert(row.flag);
  return flags;
}

}  // namespace

std::set<std::string> add_matching_flags(Command& command, BakeJob& job,
                                         const std::set<std::string>& without) {
  // Flags of reading meshes and of finding points, but for those that a match has no say in.
  static const std::set<std::string> of_meshes = {
      "--high",         "--low",       "--triangulate",    "--tangents",
      "--uv-copies",    "--two-sided", "--split-at-seams", "--traversal",
      "--load-match",   "--up",        "--unit",           "--uv-set",
      "--allow-outside"};
  static const std::set<std::string> never = {"--visibility-clusters", "--visibility-deviation",
                                              "--save-cage", "--reasons", "--recall"};
  const std::vector<OptionRow> rows =
      rows_below(bake_rows(), "The match, as of kiln bake", [&](const OptionRow& row) {
        return (row.is_of_matches() || of_meshes.contains(row.flag)) && !never.contains(row.flag) &&
               !without.contains(row.flag);
      });
  add_options(command, rows, &job);
  return flags_of(rows);
}

std::set<std::string> add_measured_map_flags(Command& command, BakeJob& job) {
  static const std::set<std::string> wanted = {"--maps", "--transfer", "--range"};
  // Those of values, not of how files hold them.
  static const std::set<std::string> never = {"--space", "--bitangent",     "--flip-y",
                                              "--raw",   "--two-component", "--gutter",
                                              "--mips",  "--id-by"};
  const std::vector<OptionRow> rows = rows_below(
      bake_rows(), "Maps whose errors are told, as of kiln bake", [&](const OptionRow& row) {
        return (row.is_of_maps() || wanted.contains(row.flag)) && !never.contains(row.flag);
      });
  add_options(command, rows, &job);
  return flags_of(rows);
}

void check_cage_directions(const BakeJob& arguments, const Mesh& low, const Mesh& cage) {
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

void MatchInputs::read(const BakeJob& arguments, const Mesh& high, const Mesh& low,
                       std::vector<Warning>& warnings) {
  if (const SetsBy sets = choose_texture_sets(low); sets != SetsBy::none) {
    throw Error(ErrorCode::input,
                "LOW '" + low.name + "' has several texture sets, a " +
                    (sets == SetsBy::udim ? "UDIM tile" : "material") +
                    " each: their UVs overlap, and one map cannot hold them. `kiln bake` makes "
                    "a map of each. Here, give a LOW of one set alone, or one with a layout for "
                    "all (kiln bake --unwrap).",
                "several-sets");
  }
  if (!arguments.cage_mesh.empty()) {
    cage_mesh_ =
        load_cage(arguments.cage_mesh, low, load_options(arguments, MeshSide::low), &warnings);
    check_cage_directions(arguments, low, *cage_mesh_);
  }
  if (arguments.parts_by) {
    parts_ = pair_parts(high, low, part_names(arguments));
    warnings.insert(warnings.end(), parts_->warnings.begin(), parts_->warnings.end());
  }
  if (!arguments.load_match.empty()) match_ = load_match(arguments.load_match);
  for (const std::string& file : arguments.occluders) {
    occluders_.push_back(load_mesh(file, load_options(arguments, MeshSide::other), &warnings));
  }
}

void MatchInputs::make_cage(const BakeJob& arguments, const Device& device, const Mesh& high,
                            const Mesh& low, std::vector<Warning>& warnings) {
  if (!arguments.cage_auto) return;
  BakeOptions options = options_of(arguments);
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
  share_occluders(options);
  if (!match_) return;
  options.match.saved = &*match_;
  options.width = match_->width / match_->samples;
  options.height = match_->height / match_->samples;
  options.samples = match_->samples;
}

MeshFiles load_low_files(const BakeJob& arguments, std::vector<Warning>& warnings) {
  MeshFiles files = load_meshes(low_files(arguments), load_options(arguments, MeshSide::low),
                                has_more_files(arguments), warnings, !arguments.asset.empty());
  if (!arguments.file_tangents) {
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

Mesh load_low(const BakeJob& arguments, std::vector<Warning>& warnings) {
  MeshFiles files = load_low_files(arguments, warnings);
  warn_of_shared_texels(files, warnings);
  return arguments.split_at_seams ? split_at_seams(files.mesh) : std::move(files.mesh);
}

}  // namespace kiln::cli
