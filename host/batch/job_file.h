// Job files: options of many bakes, in layers.
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

/// Where a value comes from.
struct Origin {
  std::string layer;  ///< "defaults", "profile.ci", "bake 2", "sidecar", "command line"
  std::string file;   ///< Empty: none
  std::uint32_t line = 0;

  /// "job.toml:12", or the layer where there is no file.
  std::string place() const;
};

/// An option, or a key of the run such as `retries`, with its values as words.
struct Setting {
  std::string key;  ///< As in JSON of jobs: "max_distance"
  OptionWords words;
  bool optional = false;  ///< A file that need not be there
  Origin origin;
  std::string
      folder;  ///< That relative paths begin at, itself relative to the job file's, or absolute
};

/// Settings of one table of a file.
struct OptionLayer {
  std::string name;
  std::vector<Setting> settings;

  /// Null: it has none of that key.
  const Setting* find(std::string_view key) const;
};

/// A limit of [check]: "normal.mean = 0.5", "missed = 5%".
struct CheckLimit {
  std::string map;      ///< Empty: of all maps, or of the bake
  std::string measure;  ///< mean, max, outliers, missed
  double value = 0;     ///< Shares are of 1
  Origin origin;
};

/// [check].
struct CheckRules {
  std::string golden;  ///< Folder; empty: none
  std::vector<CheckLimit> limits;
  Origin origin;
};

struct JobFile {
  std::filesystem::path path;
  std::filesystem::path folder;  ///< That its paths begin at; empty: the current one
  OptionLayer defaults;
  std::optional<OptionLayer> profile;  ///< That was asked for
  std::vector<OptionLayer> bakes;
  CheckRules check;
};

/// Largest job file. Ten thousand bakes by name are some 2 MB.
inline constexpr std::size_t kMostJobFileBytes = std::size_t{16} << 20;

/// \param profile  of [profile.NAME]; empty: none
/// \throws Error(usage) with "FILE:LINE: key", Error(input) where the file cannot be read
JobFile read_job_file(const std::filesystem::path& path, const std::string& profile);
/// The same of a text. \param path  for messages, and where relative paths begin
JobFile parse_job_file(std::string_view text, const std::filesystem::path& path,
                       const std::string& profile);
/// The settings of NAME.kiln.toml. \param folder  of the file, as relative paths in it begin
OptionLayer read_sidecar(const std::filesystem::path& path, const std::string& folder);

/// True for keys that are of the run, not of a job: retries, timeout, before, after, skip, name.
bool is_run_key(std::string_view key);
/// The row of an option by its key, "max_distance"; null: there is none.
const OptionRow* find_option_row(std::string_view key);
/// The key of a row: "max_distance".
std::string option_key(const OptionRow& row);

/// Which words of an option name files or folders.
enum class PathOption : std::uint8_t {
  none,
  input,   ///< Read
  output,  ///< Written
};
PathOption path_option(const OptionRow& row);
/// The word with its path changed; one that names no file stays. \param change  of the path
std::string with_path(const OptionRow& row, const std::string& word,
                      const std::function<std::string(const std::string&)>& change);

/// A JSON Schema (2020-12) of job files.
std::string job_file_schema();
/// A job as a job file of one bake. \param json  of to_json()
std::string job_file_of(std::string_view json);

}  // namespace kiln
