// Records the files and folders that a run reads: the dependencies of its results.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace kiln {

/// Log of the files that were read, the files that were missing, and the answers to queries about
/// folders. Thread-safe.
class InputLog {
 public:
  /// \param identify  identity of a file's contents; called before a file's first read
  explicit InputLog(std::function<std::string(const std::filesystem::path&)> identify);
  ~InputLog();
  InputLog(const InputLog&) = delete;
  InputLog& operator=(const InputLog&) = delete;

  struct Inputs {
    /// Identity of each file's contents, by absolute path
    std::map<std::string, std::string> files;
    std::set<std::string> missing_files;  ///< Absolute paths
    /// Answer of each query, by absolute path and query. The query "tiles" is about a file name with
    /// a placeholder for tiles, "named crate.png" about a folder.
    std::map<std::pair<std::string, std::string>, std::string> answers;
  };
  Inputs inputs() const;

 private:
  friend void register_input(const std::filesystem::path& path);
  friend void register_missing_file(const std::filesystem::path& path);
  friend void register_query(const std::filesystem::path& path, const std::string& question,
                             const std::string& answer);
  void add(const std::filesystem::path& path);

  std::function<std::string(const std::filesystem::path&)> identify_;
  mutable std::mutex mutex_;
  Inputs inputs_;
};

/// During its lifetime, files that the calling thread reads are recorded in a log, and so are files read by threads
/// that it starts by parallel_for() and AsyncTask. Reads of threads without a log are recorded in all logs: a
/// superfluous dependency is safer than a missing one.
class InputLogScope {
 public:
  explicit InputLogScope(InputLog* log) noexcept;
  ~InputLogScope();
  InputLogScope(const InputLogScope&) = delete;
  InputLogScope& operator=(const InputLogScope&) = delete;

 private:
  InputLog* before_;
};
/// The calling thread's log; null if there is none.
InputLog* current_input_log() noexcept;

/// Records a file that is about to be read, or whose existence was checked. Does nothing without a log.
void register_input(const std::filesystem::path& path);
/// Records that a file is missing.
void register_missing_file(const std::filesystem::path& path);
/// Records a query about a folder or names in it, with its answer.
void register_query(const std::filesystem::path& path, const std::string& question,
                    const std::string& answer);
/// Calls register_input() or register_missing_file(). \returns true if a regular file exists there
bool register_file_check(const std::filesystem::path& path);

}  // namespace kiln
