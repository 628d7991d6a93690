// Hidden names of temporary files, and their removal.
#pragma once

#include <filesystem>
#include <string_view>

namespace kiln {

/// A hidden name in a folder. It is registered, so that a signal handler can remove the file
/// (remove_temporary_files()). If too many names are registered, or the name is too long, it is not
/// registered, and only its owner removes the file.
class TemporaryName {
 public:
  TemporaryName() = default;
  /// Creates a name of the form `.kiln-ID-PROCESS-NUMBER.ENDING` (ID: os::process_namespace_id()) that this
  /// process has not used yet.
  explicit TemporaryName(const std::filesystem::path& folder, const char* ending = "tmp");
  ~TemporaryName() { release(); }
  TemporaryName(TemporaryName&& other) noexcept;
  TemporaryName& operator=(TemporaryName&& other) noexcept;

  bool empty() const { return path_.empty(); }
  const std::filesystem::path& path() const { return path_; }
  /// Unregisters the name, because the file was renamed or removed.
  void release() noexcept;

 private:
  std::filesystem::path path_;
  int slot_ = -1;
};

/// Whether the process that created a hidden name is still running.
enum class NameState {
  foreign,  ///< The name was not created by Kiln
  running,  ///< The process that created the name is running
  unknown,  ///< The process that created the name ran on another machine, or before the last boot
  ended,    ///< The process has ended
};
/// \param name  a file's name, without its folder  \param ending  required ending, such as "tmp"
NameState state_of_name(std::string_view name, std::string_view ending);

/// Registers a folder, so that remove_temporary_files() removes it if it is empty. It is not
/// registered if too many folders are, or if its name is too long.
void register_created_folder(const std::filesystem::path& folder) noexcept;
/// Unregisters all folders.
void unregister_created_folders() noexcept;

/// Maximum number of names to try for one file.
inline constexpr int kNameAttempts = 100;

}  // namespace kiln
