#include "batch/assets.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <unordered_map>

#include "asset/file_finder.h"
#include "base/file.h"
#include "base/lower_case.h"
#include "batch/path_pattern.h"
#include "job/job_options.h"
#include "job/map_words.h"
#include "kiln/error.h"
#include "kiln/options.h"
#include "options/near_words.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail_at_setting(const Setting& setting, const Message& problem) {
  throw Error(ErrorCode::usage, setting.origin.place() + ": " + setting.key + ": " + problem);
}

/// True if a path has the extension of a mesh. Other files do not count as matches of a pattern with an open ending,
/// such as "crate_low.*".
bool has_mesh_extension(const std::string& path) {
  constexpr std::array kEndings = {".ply", ".obj", ".stl", ".off", ".gltf",
                                   ".glb", ".fbx", ".dae", ".3ds", ".x"};
  const std::string ending = lower_case(fs::path(path).extension().string());
  return std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end();
}

bool is_multi_path_pattern(const PathPattern& pattern) { return !pattern.is_plain(); }

std::string join_path(const std::string& folder, const std::string& path) {
  if (folder.empty() || os::is_absolute(path)) return path;
  return folder.ends_with('/') ? folder + path : folder + "/" + path;
}

/// Prepends the setting's folder to a pattern. The folder's name is escaped, since it is not a pattern.
std::string prepend_folder(const Setting& setting, const std::string& word) {
  return join_path(escape_pattern(setting.folder), word);
}

std::string canonical_path(const fs::path& path) {
  std::error_code error;
  const fs::path found = os::canonical(path, error);
  return (error ? os::absolute_normal(path) : found).generic_string();
}

/// Returns the paths of the files that a job writes in addition to its maps. If the output is a folder of maps, the
/// first path is that of the low poly, even if the job does not write it: two jobs with the same path there have maps
/// of the same names.
std::vector<std::string> list_secondary_outputs(const Job& job) {
  std::vector<std::string> outputs;
  const std::string file = asset_file(job);
  if (!file.empty()) outputs.push_back(canonical_path(file));
  if (file.empty() || lower_extension(file) == ".obj") {
    outputs.push_back(canonical_path(fs::path(out_folder(job)) / (low_stem(job) + ".obj")));
  }
  if (lower_extension(file) == ".gltf")
    outputs.push_back(canonical_path(fs::path(file).replace_extension(".bin")));
  for (const std::string* const output :
       {&job.json, &job.save_cage, &job.save_match, &job.save_source}) {
    if (!output->empty()) outputs.push_back(canonical_path(*output));
  }
  return outputs;
}

class Expander {
 public:
  Expander(const JobFile& file, const ExpandOptions& options)
      : file_(file), options_(options), file_lister_(file.folder) {}

  Batch expand() {
    for (const std::string& pattern : options_.selected_names) only_patterns_.emplace_back(pattern);
    for (std::size_t rule = 0; rule < file_.bakes.size(); ++rule) expand_rule(rule);
    make_names_unique();
    check_outputs();
    check_sidecars();
    check_outputs_are_no_inputs();
    if (!only_patterns_.empty()) select_assets();
    return std::move(batch_);
  }

 private:
  struct CaptureGroup {
    Captures captures;
    std::vector<std::string> files;  ///< Files that match the first pattern with these captures
  };

  std::vector<FileLister::FoundFile> find(const Setting& setting, const PathPattern& pattern,
                                          const Captures& known) {
    std::vector<FileLister::FoundFile> found;
    try {
      found = file_lister_.find(pattern, known);
    } catch (const Error& error) {
      throw Error(error.code(),
                  setting.origin.place() + ": " + setting.key + ": " + error.message());
    }
    if (pattern.has_open_ending()) {
      std::erase_if(
          found, [](const FileLister::FoundFile& file) { return !has_mesh_extension(file.path); });
    }
    return found;
  }

  static PathPattern parse_pattern(const Setting& setting, const std::string& word) {
    try {
      const PathPattern pattern(prepend_folder(setting, word));
      // A ".." after a capture would lead out of the captured folder.
      const std::string& text = pattern.text();
      const std::size_t open = std::min({text.find('{'), text.find('*'), text.size()});
      if (!pattern.captures().empty() && text.find("/..", open) != std::string::npos) {
        fail_at_setting(
            setting,
            "'" + word + "' contains '..' after a capture: write the folder's name instead.");
      }
      return pattern;
    } catch (const Error& error) {
      if (std::string_view(error.what()).starts_with(setting.origin.place())) throw;
      fail_at_setting(setting, error.message());
    }
  }

  /// Rejects files whose names differ only in the extension, since they probably hold the same mesh.
  static void check_formats(const Setting& setting, const std::vector<std::string>& files) {
    std::map<std::string, std::string> stems;
    for (const std::string& file : files) {
      const auto [entry, added] =
          stems.try_emplace(fs::path(file).replace_extension().string(), file);
      if (!added) {
        fail_at_setting(setting,
                        "'" + entry->second + "' and '" + file +
                            "' have the same name in two formats, and would be baked as one mesh: "
                            "add the extension to the pattern.");
      }
    }
  }

  static bool is_skipped(const std::vector<PathPattern>& skip, const std::string& path) {
    return std::any_of(skip.begin(), skip.end(), [&](const PathPattern& pattern) {
      return pattern.matches_path_or_parent(path);
    });
  }

  void expand_rule(std::size_t rule) {
    const OptionLayer& bake = file_.bakes[rule];
    const Setting* const high = bake.find("high");
    const Setting* const low = bake.find("low");
    std::vector<PathPattern> skip;
    if (const Setting* const setting = bake.find("skip")) {
      for (const std::string& word : setting->words) skip.push_back(parse_pattern(*setting, word));
    }
    const Setting& first = low != nullptr ? *low : *high;
    const PathPattern input_pattern = parse_pattern(first, first.words[0]);
    if (is_multi_path_pattern(input_pattern))
      input_patterns_.push_back({input_pattern, skip, rule, &first});
    // Assets are created in the order of their first files, so that the order is deterministic.
    std::vector<CaptureGroup> groups;
    std::map<Captures, std::size_t> group_indices;
    std::size_t matched_files = 0;
    for (FileLister::FoundFile& file : find(first, input_pattern, {})) {
      ++matched_files;
      if (is_skipped(skip, file.path)) continue;
      const auto [place, added] = group_indices.try_emplace(file.captures, groups.size());
      if (added) groups.push_back({file.captures, {}});
      groups[place->second].files.push_back(std::move(file.path));
    }
    if (matched_files == 0) {
      fail_at_setting(first, is_multi_path_pattern(input_pattern)
                                 ? "no file matches '" + input_pattern.text() + "'" +
                                       describe_folder() + ": check the path."
                                 : "there is no file '" + input_pattern.path({}) + "'" +
                                       describe_folder() + ": check the path.");
    }
    std::set<std::string> used_stems;
    for (const CaptureGroup& group : groups) {
      check_formats(first, group.files);
      expand_asset(rule, group, used_stems);
    }
    if (low != nullptr) check_unpaired(*high, skip, used_stems);
  }

  std::string describe_folder() const {
    return file_.folder.empty() ? "" : " below '" + file_.folder.string() + "'";
  }

  /// Warns about high polys that belong to no low poly, which would otherwise be skipped silently.
  void check_unpaired(const Setting& high, const std::vector<PathPattern>& skip,
                      const std::set<std::string>& used_stems) {
    std::vector<std::string> unpaired;
    for (const std::string& word : high.words) {
      const PathPattern pattern = parse_pattern(high, word);
      if (pattern.captures().empty()) continue;
      for (const FileLister::FoundFile& file : find(high, pattern, {})) {
        if (used_stems.count(file.path) == 0 && !is_skipped(skip, file.path))
          unpaired.push_back(file.path);
      }
    }
    if (unpaired.empty()) return;
    batch_.warnings.push_back({"unpaired-high",
                               high.origin.place() + ": " + std::to_string(unpaired.size()) +
                                   (unpaired.size() == 1 ? " file matches" : " files match") +
                                   " high without a matching low, for example '" +
                                   unpaired.front() +
                                   "', and a high poly without a low poly is not baked: check the "
                                   "names, or add it to skip.",
                               unpaired.size()});
  }

  /// Finds all files of the setting `high` or `low` for the given captures.
  /// \param problem  receives the reason if a pattern matches no file
  std::vector<std::string> find_mesh_files(const Setting& setting, const Captures& captures,
                                           std::string& problem) {
    std::vector<std::string> files;
    for (const std::string& word : setting.words) {
      const PathPattern pattern = parse_pattern(setting, word).substitute(captures);
      for (const std::string& name : pattern.captures()) {
        fail_at_setting(setting, "{" + name + "} is not captured" + describe_captures(captures));
      }
      std::vector<std::string> matching_files;
      for (FileLister::FoundFile& file : find(setting, pattern, {}))
        matching_files.push_back(std::move(file.path));
      if (matching_files.empty() && problem.empty()) {
        problem = "there is no " + setting.key + " '" +
                  (pattern.is_plain() ? pattern.path({}) : pattern.text()) + "' (" +
                  setting.origin.place() + ")";
      }
      files.insert(files.end(), matching_files.begin(), matching_files.end());
    }
    check_formats(setting, files);
    return files;
  }

  static std::string describe_captures(const Captures& captures) {
    std::string list;
    for (const auto& [name, value] : captures)
      list += (list.empty() ? "; there are {" : ", {") + name + "}";
    return list.empty() ? ", because the first pattern of this [[bake]] has no captures."
                        : list + ".";
  }

  /// Merges a layer into the effective settings. Later layers override earlier ones.
  void add_layer(std::map<std::string, Setting>& effective_settings,
                 const OptionLayer& layer) const {
    for (const Setting& setting : layer.settings) {
      // A setting removes settings of earlier layers that exclude it, as --cage and --cage-mesh exclude each other.
      const OptionRow* const row = find_option_row(setting.key);
      for (auto other = effective_settings.begin();
           row != nullptr && other != effective_settings.end();) {
        const OptionRow* const other_row = find_option_row(other->first);
        const bool excluded =
            other_row != nullptr && layer.find(other->first) == nullptr &&
            ((" " + row->excludes + " ").find(" " + other_row->flag + " ") != std::string::npos ||
             (" " + other_row->excludes + " ").find(" " + row->flag + " ") != std::string::npos);
        other = excluded ? effective_settings.erase(other) : std::next(other);
      }
      effective_settings[setting.key] = setting;
    }
  }

  /// Finds the sidecar of an asset: the file NAME.kiln.toml beside one of its meshes, where NAME is the mesh's stem or
  /// the value of the capture {name}. \returns its path; empty if there is none
  std::string find_sidecar_path(const std::vector<std::string>& meshes, const Captures& captures) {
    std::set<std::string> found;
    const auto find_sidecar = [&](const std::string& folder, const std::string& stem) {
      const std::string name = stem + std::string(kSidecarEnding);
      const std::vector<std::string>& files = file_lister_.files_of(folder);
      if (std::binary_search(files.begin(), files.end(), name))
        found.insert(join_path(folder, name));
    };
    for (const std::string& mesh : meshes) {
      const std::string folder = fs::path(mesh).parent_path().string();
      // Only folders that a pattern with captures searches are checked for unused sidecars. Other folders may hold
      // files of other job files.
      if (!captures.empty()) sidecar_folders_.insert(folder);
      find_sidecar(folder, fs::path(mesh).stem().string());
      if (const auto name = captures.find("name"); name != captures.end())
        find_sidecar(folder, name->second);
    }
    if (found.size() > 1) {
      throw Error(ErrorCode::usage, "'" + *found.begin() + "' and '" + *found.rbegin() +
                                        "' are two sidecars of one asset: remove one.");
    }
    sidecars_.insert(found.begin(), found.end());
    return found.empty() ? "" : *found.begin();
  }

  void expand_asset(std::size_t rule, const CaptureGroup& group,
                    std::set<std::string>& used_stems) {
    const OptionLayer& bake = file_.bakes[rule];
    const Setting* const high = bake.find("high");
    const Setting* const low = bake.find("low");
    BatchAsset asset;
    asset.rule = rule;
    std::vector<std::string> highs, lows;
    (low != nullptr ? lows : highs) = group.files;
    const Setting& first = low != nullptr ? *low : *high;
    if (first.words.size() > 1) {
      Setting remaining_setting = first;
      remaining_setting.words.erase(remaining_setting.words.begin());
      std::vector<std::string>& files = low != nullptr ? lows : highs;
      for (std::string& file : find_mesh_files(remaining_setting, group.captures, asset.problem))
        files.push_back(std::move(file));
    }
    if (low != nullptr) highs = find_mesh_files(*high, group.captures, asset.problem);
    used_stems.insert(highs.begin(), highs.end());
    used_stems.insert(lows.begin(), lows.end());
    std::vector<std::string> meshes = lows;
    meshes.insert(meshes.end(), highs.begin(), highs.end());
    std::map<std::string, Setting> effective_settings;
    add_layer(effective_settings, file_.defaults);
    if (file_.profile) add_layer(effective_settings, *file_.profile);
    add_layer(effective_settings, bake);
    if (const std::string sidecar = find_sidecar_path(meshes, group.captures); !sidecar.empty()) {
      const OptionLayer layer =
          read_sidecar(file_.folder / sidecar, fs::path(sidecar).parent_path().string());
      if (const Setting* const skip = layer.find("skip")) {
        if (skip->words != std::vector<std::string>{"true"} &&
            skip->words != std::vector<std::string>{"false"}) {
          fail_at_setting(*skip, "a sidecar applies to one asset: give true or false.");
        }
        if (skip->words[0] == "true") return;
      }
      add_layer(effective_settings, layer);
    }
    add_layer(effective_settings, options_.command_line);
    effective_settings.erase("skip");
    std::string name;
    for (const std::string& capture : list_captures(first)) {
      const auto value = group.captures.find(capture);
      if (value != group.captures.end() && !value->second.empty())
        name += (name.empty() ? "" : "/") + value->second;
    }
    if (name.empty()) name = fs::path(group.files.front()).stem().string();
    if (const auto setting = effective_settings.find("name"); setting != effective_settings.end()) {
      name = plain_path(setting->second, setting->second.words[0], group.captures);
    }
    asset.name = name;
    apply_run_settings(asset, effective_settings);
    const auto faces = effective_settings.find("faces");
    const std::vector<std::string> levels =
        faces == effective_settings.end() ? std::vector<std::string>() : faces->second.words;
    for (std::size_t level = 0; level < std::max<std::size_t>(1, levels.size()); ++level) {
      BatchAsset level_asset = asset;
      if (levels.size() > 1) {
        effective_settings["faces"].words = {levels[level]};
        if (level > 0) level_asset.name += "_lod" + std::to_string(level);
      }
      make_job(level_asset, effective_settings, highs, lows, group.captures, level);
      batch_.assets.push_back(std::move(level_asset));
    }
  }

  static std::vector<std::string> list_captures(const Setting& first) {
    return parse_pattern(first, first.words[0]).captures();
  }

  void apply_run_settings(BatchAsset& asset,
                          std::map<std::string, Setting>& effective_settings) const {
    double number = 0;
    if (const auto s = effective_settings.find("retries");
        s != effective_settings.end() && read_number(s->second.words[0], number)) {
      asset.retries = static_cast<unsigned>(number);
    }
    if (const auto s = effective_settings.find("timeout"); s != effective_settings.end())
      read_number(s->second.words[0], asset.timeout);
    for (const auto& [key, member] :
         {std::pair{"before", &BatchAsset::before}, std::pair{"after", &BatchAsset::after}}) {
      const auto s = effective_settings.find(key);
      if (s == effective_settings.end()) continue;
      if (!options_.allow_hooks) {
        fail_at_setting(
            s->second,
            "the file contains a shell command, which would run with your rights: read it, and "
            "add --allow-hooks.");
      }
      asset.*member = s->second.words[0];
    }
  }

  /// Substitutes captures in a path. \throws Error(usage) if an unknown capture or a wildcard remains
  std::string plain_path(const Setting& setting, const std::string& word,
                         const Captures& captures) const {
    try {
      const PathPattern pattern = PathPattern(word).substitute(captures);
      for (const std::string& name : pattern.captures()) {
        std::vector<std::string> known_names;
        for (const auto& [known_name, value] : captures) known_names.push_back(known_name);
        const std::string suggestion = nearest_word(name, known_names);
        fail_at_setting(setting, "{" + name + "} is not captured" +
                                     (suggestion.empty() ? describe_captures(captures)
                                                         : "; did you mean {" + suggestion + "}?"));
      }
      return pattern.path({});
    } catch (const Error& error) {
      if (std::string_view(error.what()).starts_with(setting.origin.place())) throw;
      fail_at_setting(setting, error.message());
    }
  }

  /// Replaces patterns and captures in the paths of a setting by the files that they stand for.
  /// \returns false if no path remains, because optional files are missing
  bool resolve_paths(const OptionRow& row, Setting& setting, const Captures& captures) {
    const PathAccess kind = path_access(row);
    if (kind == PathAccess::none) return true;
    OptionWords words;
    for (const std::string& word : setting.words) {
      bool exists = true;
      OptionWords substituted_words;
      const std::string resolved_word = replace_path(row, word, [&](const std::string& path) {
        const std::string full_path = prepend_folder(setting, path);
        const PathPattern pattern = kind == PathAccess::input
                                        ? parse_pattern(setting, path).substitute(captures)
                                        : PathPattern();
        if (kind == PathAccess::input && pattern.captures().empty() &&
            is_multi_path_pattern(pattern)) {
          // Here a pattern with an open ending matches files of all kinds: the option may take pictures or kernel
          // sources.
          for (const FileLister::FoundFile& file : file_lister_.find(pattern))
            substituted_words.push_back(base_path(file.path));
          exists = !substituted_words.empty();
          if (!exists && !setting.optional)
            fail_at_setting(setting,
                            "no file matches '" + pattern.text() + "'" + describe_folder() + ".");
          if (substituted_words.size() > 1 && !row.value.repeats) {
            fail_at_setting(setting, "'" + substituted_words[0] + "' and '" + substituted_words[1] +
                                         "' match '" + pattern.text() +
                                         "', but this option takes one file.");
          }
          return exists ? substituted_words[0] : path;
        }
        const std::string file = base_path(plain_path(setting, full_path, captures));
        std::error_code error;
        if (setting.optional) exists = fs::is_regular_file(file, error);
        return file;
      });
      if (!exists) continue;
      if (substituted_words.size() > 1 && row.flag == "--ao-occluders") {
        words.insert(words.end(), substituted_words.begin(), substituted_words.end());
      } else if (substituted_words.size() > 1) {
        fail_at_setting(
            setting,
            "'" + word + "' matches several files, but the option takes one: write its name.");
      } else {
        words.push_back(resolved_word);
      }
    }
    setting.words = words;
    return !words.empty();
  }

  /// Converts a path that is relative to the job file's folder to one that opens the file from the current folder.
  std::string base_path(const std::string& path) const {
    if (path.empty() || os::is_absolute(path)) return path;
    return os::normal(file_.folder / path).string();
  }

  /// True if the setting comes from a layer that applies to all bakes. A bake that does not use the option ignores such
  /// a setting, instead of reporting an error.
  bool applies_to_all_bakes(const Setting& setting) const {
    const std::string& layer = setting.origin.layer;
    return layer == file_.defaults.name || (file_.profile && layer == file_.profile->name) ||
           layer == options_.command_line.name;
  }

  /// True if a map or the match of a bake uses an option. Bakes without occlusion, for example, do not use `ao_rays`
  /// of [defaults].
  static bool is_option_used(const std::map<std::string, Setting>& effective_settings,
                             const OptionRow& row) {
    if (!row.is_map_option() && !row.is_match_option()) return true;
    Job job;
    job.high = {"high.obj"};
    try {
      if (effective_settings.count("low") != 0) job.low = JobLow("low.obj");
      for (const char* const key :
           {"maps", "match", "fallback", "out", "pack", "load_match", "cage", "transfer"}) {
        const auto setting = effective_settings.find(key);
        if (setting != effective_settings.end()) set_option(job, key, setting->second.words);
      }
      return is_applicable(row, resolve_job(job));
    } catch (const Error&) {
      return true;  // make_job() reports the error
    }
  }

  void make_job(BatchAsset& asset, const std::map<std::string, Setting>& effective_settings,
                const std::vector<std::string>& highs, const std::vector<std::string>& lows,
                const Captures& captures, std::size_t level) {
    for (const std::string& file : highs) asset.job.high.emplace_back(base_path(file));
    for (const std::string& file : lows) asset.job.low.given.emplace_back(base_path(file));
    for (const auto& [key, given] : effective_settings) {
      Setting setting = given;
      const OptionRow* const row = find_option_row(key);
      if (row == nullptr) {
        asset.settings.push_back(setting);
        continue;
      }
      if (applies_to_all_bakes(setting) && !is_option_used(effective_settings, *row)) continue;
      if (key == "high" || key == "low") {
        setting.words = key == "high" ? highs : lows;
        asset.settings.push_back(setting);
        continue;
      }
      if (setting.origin.file.empty()) {
        // Paths on the command line are relative to the current folder.
        for (std::string& word : setting.words) {
          word = replace_path(*row, word, [&](const std::string& path) {
            return path_access(*row) == PathAccess::output ? plain_path(setting, path, captures)
                                                           : path;
          });
        }
      } else if (!resolve_paths(*row, setting, captures)) {
        continue;
      }
      if (key == "out" && level > 0) {
        fs::path out = setting.words[0];
        const std::string lod_suffix = "_lod" + std::to_string(level);
        const bool file = out.has_extension();
        out =
            out.parent_path() / (file ? out.stem().string() + lod_suffix + out.extension().string()
                                      : out.filename().string() + lod_suffix);
        setting.words[0] = out.string();
      }
      try {
        set_option(asset.job, key, setting.words);
      } catch (const Error& error) {
        fail_at_setting(setting, error.message());
      }
      const bool has_own_maps =
          key == "maps" && !asset.job.own_maps.empty() && !setting.origin.file.empty();
      if (has_own_maps && !options_.allow_own_maps) {
        fail_at_setting(setting,
                        "the file defines a map of its own ('" + asset.job.own_maps[0] +
                            "') by code that would run with your rights: read the code, and add "
                            "--allow-own-maps.");
      }
      if (path_access(*row) == PathAccess::output && !setting.origin.file.empty() &&
          !options_.allow_outside && !lies_within(file_.folder, setting.words[0])) {
        fail_at_setting(setting,
                        "'" + setting.words[0] +
                            "' lies outside the job file's folder: choose a folder below it, or "
                            "add --allow-outside.");
      }
      asset.settings.push_back(setting);
    }
    if (asset.job.out.empty()) {
      throw Error(ErrorCode::usage,
                  file_.bakes[asset.rule].find("high")->origin.place() + ": out: '" + asset.name +
                      "' has no output: set out in this [[bake]] or in [defaults].");
    }
    asset.job.quiet = true;
    if (!asset.problem.empty()) return;
    try {
      check(asset.job);
      check_nested_options(asset.job);
    } catch (const Error& error) {
      throw Error(ErrorCode::usage, file_.bakes[asset.rule].find("high")->origin.place() + ": '" +
                                        asset.name + "': " + error.message());
    }
    asset.expected_seconds = expected_seconds(asset.job);
  }

  /// Checks options that are nested in the values of other options, such as those of a variant. Ignores missing files,
  /// which a hook may create before the bake.
  static void check_nested_options(const Job& job) {
    try {
      options_of(resolve_job(job));
    } catch (const Error& error) {
      if (error.code() == ErrorCode::usage) throw;
    }
  }

  /// Replaces names that several assets have, as two [[bake]] tables may capture the same text, by the paths of their
  /// outputs.
  void make_names_unique() {
    std::map<std::string, std::size_t> counts;
    for (const BatchAsset& asset : batch_.assets) ++counts[asset.name];
    for (BatchAsset& asset : batch_.assets) {
      if (counts[asset.name] > 1) asset.name = output_name(asset.job);
    }
  }

  void check_outputs() {
    std::unordered_map<std::string, const BatchAsset*> writers;
    for (const BatchAsset& asset : batch_.assets) {
      for (const std::string& output : list_secondary_outputs(asset.job)) {
        const auto [entry, added] = writers.try_emplace(os::name_key(output), &asset);
        if (added || entry->second == &asset) continue;
        const Setting* const out = find_setting(asset, "out");
        throw Error(ErrorCode::usage,
                    (out == nullptr ? file_.path.string() : out->origin.place()) + ": out: '" +
                        entry->second->name + "'" + rule_location(*entry->second, asset) +
                        " and '" + asset.name + "'" + rule_location(asset, *entry->second) +
                        " would both write '" + output +
                        "': give each a separate path, such as out/{dir}/{name}.");
      }
    }
    // Rejects a file that one bake writes and another reads, since the result would depend on their order.
    for (const BatchAsset& asset : batch_.assets) {
      std::vector<std::string> inputs = high_files(asset.job);
      const std::vector<std::string> low = low_files(asset.job);
      inputs.insert(inputs.end(), low.begin(), low.end());
      inputs.push_back(asset.job.cage_mesh);
      inputs.push_back(asset.job.load_match);
      for (const std::string& input : inputs) {
        if (input.empty()) continue;
        const auto writer = writers.find(os::name_key(canonical_path(input)));
        if (writer == writers.end()) continue;
        throw Error(ErrorCode::usage,
                    file_.path.string() + ": '" + input + "' is written by '" +
                        writer->second->name + "' and read by '" + asset.name +
                        "': write to another folder, or list it in the setting skip.");
      }
    }
  }

  /// File and line of an asset's [[bake]] in parentheses; empty if both assets belong to the same [[bake]].
  std::string rule_location(const BatchAsset& asset, const BatchAsset& other) const {
    if (asset.rule == other.rule) return {};
    return " (" + file_.bakes[asset.rule].find("high")->origin.place() + ")";
  }

  static const Setting* find_setting(const BatchAsset& asset, std::string_view key) {
    for (const Setting& setting : asset.settings) {
      if (setting.key == key) return &setting;
    }
    return nullptr;
  }

  /// Rejects outputs that match a pattern of inputs, since the next run would read them as inputs.
  void check_outputs_are_no_inputs() {
    const std::string base =
        canonical_path(file_.folder.empty() ? fs::path(".") : file_.folder) + "/";
    for (const BatchAsset& asset : batch_.assets) {
      if (!asset.problem.empty()) continue;
      for (const std::string& output : known_outputs(asset.job)) {
        if (!output.starts_with(base)) continue;
        const std::string path = output.substr(base.size());
        for (const auto& [pattern, skip, rule, setting] : input_patterns_) {
          Captures captures;
          if (!pattern.matches(path, {}, captures) || is_skipped(skip, path)) continue;
          if (pattern.has_open_ending() && !has_mesh_extension(path)) continue;
          fail_at_setting(*setting,
                          "'" + path + "', an output of '" + asset.name +
                              "', matches this pattern, so that the next run would bake it: "
                              "write to another folder, or list it in the setting skip.");
        }
      }
    }
  }

  /// Warns about sidecars that belong to no mesh, which would otherwise be ignored silently.
  void check_sidecars() {
    for (const std::string& folder : sidecar_folders_) {
      for (const std::string& file : file_lister_.files_of(folder)) {
        if (!file.ends_with(kSidecarEnding) || file.starts_with('.')) continue;
        const std::string path = join_path(folder, file);
        if (sidecars_.count(path) != 0) continue;
        batch_.warnings.push_back({"unused-sidecar",
                                   "'" + path +
                                       "' belongs to no baked mesh: give it the mesh's name, "
                                       "NAME.kiln.toml, or remove it.",
                                   1});
      }
    }
  }

  void select_assets() {
    std::vector<std::string> names;
    for (const BatchAsset& asset : batch_.assets) names.push_back(asset.name);
    std::vector<bool> is_selected(names.size(), false);
    for (const PathPattern& pattern : only_patterns_) {
      bool any_match = false;
      for (std::size_t i = 0; i < names.size(); ++i) {
        if (!pattern.selects_asset(names[i])) continue;
        any_match = is_selected[i] = true;
      }
      if (any_match) continue;
      const std::string suggestion = nearest_word(pattern.text(), names);
      throw Error(
          ErrorCode::usage,
          "--only '" + pattern.text() + "' matches no asset" +
              (suggestion.empty() ? ": --list shows them." : "; did you mean " + suggestion + "?"));
    }
    std::vector<BatchAsset> selected_assets;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (is_selected[i]) selected_assets.push_back(std::move(batch_.assets[i]));
    }
    batch_.assets = std::move(selected_assets);
  }

  struct InputPattern {
    PathPattern pattern;
    std::vector<PathPattern> skip;
    std::size_t rule;
    const Setting* setting;
  };
  static constexpr std::string_view kSidecarEnding = ".kiln.toml";

  const JobFile& file_;
  const ExpandOptions& options_;
  FileLister file_lister_;
  std::vector<PathPattern> only_patterns_;
  std::vector<InputPattern> input_patterns_;
  std::set<std::string> sidecars_, sidecar_folders_;
  Batch batch_;
};

}  // namespace

Batch expand_job_file(const JobFile& file, const ExpandOptions& options) {
  return Expander(file, options).expand();
}

std::string output_name(const Job& job) {
  const std::string file = asset_file(job);
  return file.empty() ? (fs::path(out_folder(job)) / low_stem(job)).string() : file;
}

std::vector<std::string> known_outputs(const Job& job) {
  std::vector<std::string> outputs = list_secondary_outputs(job);
  if (!asset_file(job).empty()) return outputs;
  if (!writes_low(job)) outputs.erase(outputs.begin());
  for (const std::string& map : all_map_names(resolve_job(job))) {
    outputs.push_back(
        canonical_path(fs::path(out_folder(job)) /
                       (low_stem(job) + "_" + map + std::string(extension_of(job.image.format)))));
  }
  return outputs;
}

double expected_seconds(const Job& job) {
  // Cost model, measured on two CPU cores in 2026: each job takes kJobSeconds, plus the time to parse its files, to
  // compute the samples of its maps and to cast occlusion rays.
  constexpr double kJobSeconds = 0.05, kBytesPerSecond = 4e7, kSamplesPerSecond = 6e6,
                   kRaysPerSecond = 1e7;
  double bytes = 0;
  for (const auto* const mesh_files : {&job.high, &job.low.given}) {
    for (const JobInput& input : *mesh_files) {
      if (const auto facts = os::query_file(fs::path(input.name)))
        bytes += static_cast<double>(facts->bytes);
    }
  }
  const double samples =
      static_cast<double>(job.bake.width) * job.bake.height * job.bake.samples * job.bake.samples;
  double seconds = kJobSeconds + bytes / kBytesPerSecond;
  for (const MapKind map : job.bake.maps) {
    const MapInfo& info = find_map(map.name);
    seconds +=
        samples / kSamplesPerSecond +
        (obeys(info, "occlusion.rays") ? samples * job.bake.occlusion.rays / kRaysPerSecond : 0);
  }
  return seconds + samples / kSamplesPerSecond;
}

}  // namespace kiln
