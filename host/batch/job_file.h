// Reads job files, which hold the options of several bakes in layers: defaults, profiles and one layer per [[bake]].
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "batch/toml.h"
#include "options/option_table.h"

namespace kiln {

/// The file and line of a value, for messages.
struct Origin {
  /// The kind of layer: "defaults", "profile.ci", "bake 2", "sidecar", "command line"
  std::string layer;
  std::string file;  ///< Path of the file; empty if the value is not from a file
  std::uint32_t line = 0;

  /// Formats the file and the line, such as "job.toml:12"; without a file, the layer's name.
  std::string place() const;
};

/// A value of an option, or of a run key such as `retries`, as words.
struct Setting {
  std::string key;  ///< The option's name as in a job's JSON: "max_distance"
  OptionWords words;
  bool optional = false;  ///< True if the value names a file that may be missing
  Origin origin;
  /// Folder that relative paths start from; absolute, or relative to the job file's folder
  std::string folder;
};

/// The settings of one table of a job file.
struct OptionLayer {
  std::string name;
  std::vector<Setting> settings;

  /// Finds the setting with a key; null if there is none.
  const Setting* find(std::string_view key) const;
};

/// A limit in the table [check], such as "normal.mean = 0.5" or "missed = 5%".
struct CheckLimit {
  std::string map;      ///< Name of the map; empty: all maps, or the whole bake
  std::string measure;  ///< Name of the measure: mean, max, outliers or missed
  double value = 0;     ///< Value of the limit; percentages are stored as shares of 1
  Origin origin;
};

/// The table [check].
struct CheckRules {
  std::string golden;  ///< Folder of golden maps; empty: there are none
  std::vector<CheckLimit> limits;
  Origin origin;
};

struct JobFile {
  std::filesystem::path path;
  /// Folder that relative paths in the table start from; empty: the current folder
  std::filesystem::path folder;
  OptionLayer defaults;
  std::optional<OptionLayer> profile;  ///< The selected profile
  std::vector<OptionLayer> bakes;
  CheckRules check;
};

/// Maximum size of a job file. Ten thousand named bakes are about 2 MB.
inline constexpr std::size_t kMaxJobFileBytes = std::size_t{16} << 20;

/// Reads and parses a job file.
/// \param profile  NAME of [profile.NAME]; empty: no profile
/// \throws Error(usage) with "FILE:LINE: key", Error(input) if the file cannot be read
JobFile read_job_file(const std::filesystem::path& path, const std::string& profile);
/// Parses the text of a job file.
/// \param path  path for messages, and for the base of relative paths
JobFile parse_job_file(std::string_view text, const std::filesystem::path& path,
                       const std::string& profile);
/// Reads the settings of NAME.kiln.toml.
/// \param folder  base of relative paths in the file
OptionLayer read_sidecar(const std::filesystem::path& path, const std::string& folder);

/// True for keys that control the run instead of the job: retries, timeout, before, after, skip, name.
bool is_run_key(std::string_view key);
/// Finds the row of the option with a key such as "max_distance"; null if there is none.
const OptionRow* find_option_row(std::string_view key);
/// Returns the key of an option's row, such as "max_distance" for --max-distance.
std::string option_key(const OptionRow& row);

/// Kind of access to the files or folders that the words of an option name.
enum class PathAccess : std::uint8_t {
  none,
  input,   ///< The files are read
  output,  ///< The files are written
};
PathAccess path_access(const OptionRow& row);
/// Returns a word of an option's value with its path replaced; words without a path are unchanged.
/// \param change  function that returns the new path for an old one
std::string replace_path(const OptionRow& row, const std::string& word,
                         const std::function<std::string(const std::string&)>& change);

/// Returns the JSON Schema (2020-12) of job files.
std::string job_file_schema();
/// Converts a job to the text of a job file with one bake.
/// \param json  the job, from to_json()
std::string to_job_file(std::string_view json);

}  // namespace kiln
