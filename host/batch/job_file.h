// Job files: options of several bakes, in layers.
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

/// The origin of a value, for messages.
struct Origin {
  std::string layer;  ///< "defaults", "profile.ci", "bake 2", "sidecar", "command line"
  std::string file;   ///< Empty if not from a file
  std::uint32_t line = 0;

  /// "job.toml:12", or the layer's name without a file.
  std::string place() const;
};

/// A value of an option, or of a run key such as `retries`, as words.
struct Setting {
  std::string key;  ///< As in a job's JSON: "max_distance"
  OptionWords words;
  bool optional = false;  ///< Names a file that may be missing
  Origin origin;
  std::string folder;  ///< Base of relative paths; absolute, or relative to the job file's folder
};

/// Settings of one table of a file.
struct OptionLayer {
  std::string name;
  std::vector<Setting> settings;

  /// The setting of a key; null if there is none.
  const Setting* find(std::string_view key) const;
};

/// A limit in [check]: "normal.mean = 0.5", "missed = 5%".
struct CheckLimit {
  std::string map;      ///< Empty: all maps, or the bake as a whole
  std::string measure;  ///< mean, max, outliers, missed
  double value = 0;     ///< Percentages are stored as shares of 1
  Origin origin;
};

/// The table [check].
struct CheckRules {
  std::string golden;  ///< Folder of golden maps; empty: none
  std::vector<CheckLimit> limits;
  Origin origin;
};

struct JobFile {
  std::filesystem::path path;
  std::filesystem::path folder;  ///< Base of its relative paths; empty: the current folder
  OptionLayer defaults;
  std::optional<OptionLayer> profile;  ///< The selected profile
  std::vector<OptionLayer> bakes;
  CheckRules check;
};

/// Maximum size of a job file. Ten thousand named bakes are about 2 MB.
inline constexpr std::size_t kMaxJobFileBytes = std::size_t{16} << 20;

/// \param profile  NAME of [profile.NAME]; empty: none
/// \throws Error(usage) with "FILE:LINE: key", Error(input) if the file cannot be read
JobFile read_job_file(const std::filesystem::path& path, const std::string& profile);
/// Parses the text of a job file. \param path for messages, and the base of relative paths
JobFile parse_job_file(std::string_view text, const std::filesystem::path& path,
                       const std::string& profile);
/// Reads the settings of NAME.kiln.toml. \param folder base of relative paths in it
OptionLayer read_sidecar(const std::filesystem::path& path, const std::string& folder);

/// True for keys that control the run instead of the job: retries, timeout, before, after, skip, name.
bool is_run_key(std::string_view key);
/// The row of an option by its key, "max_distance"; null if there is none.
const OptionRow* find_option_row(std::string_view key);
/// The key of a row: "max_distance".
std::string option_key(const OptionRow& row);

/// Whether the words of an option name files or folders, and for which access.
enum class PathOption : std::uint8_t {
  none,
  input,   ///< Read
  output,  ///< Written
};
PathOption path_option(const OptionRow& row);
/// A word with its path replaced; words without a path are unchanged. \param change maps the old path to the new one
std::string with_path(const OptionRow& row, const std::string& word,
                      const std::function<std::string(const std::string&)>& change);

/// A JSON Schema (2020-12) of job files.
std::string job_file_schema();
/// A job file with one bake for a job. \param json from to_json()
std::string job_file_of(std::string_view json);

}  // namespace kiln
