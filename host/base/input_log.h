// What a run reads from the file system, so that whoever keeps its results knows what they depend on.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace kiln {

/// Files that were read, files that were looked for and not there, and answers of folders. Any thread.
class InputLog {
 public:
  /// \param identify  of a file's contents, as they are now: called before a file is read for the first time
  explicit InputLog(std::function<std::string(const std::filesystem::path&)> identify);
  ~InputLog();
  InputLog(const InputLog&) = delete;
  InputLog& operator=(const InputLog&) = delete;

  struct Inputs {
    std::map<std::string, std::string> files;  ///< Absolute path to identity
    std::set<std::string> absent;              ///< Absolute paths
    /// Absolute path and question to the answer: "tiles" of a name, "named crate.png" of a folder
    std::map<std::pair<std::string, std::string>, std::string> answers;
  };
  Inputs inputs() const;

 private:
  friend void note_input(const std::filesystem::path& path);
  friend void note_absent(const std::filesystem::path& path);
  friend void note_answer(const std::filesystem::path& path, const std::string& question,
                          const std::string& answer);
  void add(const std::filesystem::path& path);

  std::function<std::string(const std::filesystem::path&)> identify_;
  mutable std::mutex mutex_;
  Inputs inputs_;
};

/// While it lives, what the calling thread reads goes to a log; so does what threads read that it starts by
/// parallel_for() and AsyncTask. Threads without a log write to all that there are: too much is known rather than too
/// little.
class InputLogScope {
 public:
  explicit InputLogScope(InputLog* log) noexcept;
  ~InputLogScope();
  InputLogScope(const InputLogScope&) = delete;
  InputLogScope& operator=(const InputLogScope&) = delete;

 private:
  InputLog* before_;
};
/// Of the calling thread; null: none.
InputLog* current_input_log() noexcept;

/// A file is about to be read, or was found to be there. Nothing where there is no log.
void note_input(const std::filesystem::path& path);
/// A file was looked for and is not there.
void note_absent(const std::filesystem::path& path);
/// A folder, or names in it, were asked.
void note_answer(const std::filesystem::path& path, const std::string& question,
                 const std::string& answer);
/// note_input() or note_absent(). \returns true if there is such a regular file
bool note_whether_file(const std::filesystem::path& path);

}  // namespace kiln
