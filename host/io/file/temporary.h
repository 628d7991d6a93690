// Hidden names of files that are being written, and who removes them.
#pragma once

#include <filesystem>
#include <string_view>

namespace kiln {

/// A hidden name in a folder, registered so that a signal handler can remove it (remove_temporary_files()).
/// If too many are registered already, or the name is too long, it is not: its owner still removes it.
class TemporaryName {
 public:
  TemporaryName() = default;
  /// A name of the form `.kiln-MARK-PROCESS-NUMBER.ENDING` (os::process_mark()) that this process has not used yet.
  explicit TemporaryName(const std::filesystem::path& folder, const char* ending = "tmp");
  ~TemporaryName() { release(); }
  TemporaryName(TemporaryName&& other) noexcept;
  TemporaryName& operator=(TemporaryName&& other) noexcept;

  bool empty() const { return path_.empty(); }
  const std::filesystem::path& path() const { return path_; }
  /// Nothing of this name is there any more.
  void release() noexcept;

 private:
  std::filesystem::path path_;
  int slot_ = -1;
};

/// Of a hidden name: whether its process may still be at work.
enum class NameState {
  foreign,  ///< It is none of ours
  live,     ///< Its process runs
  unknown,  ///< Its process is another machine's, or of an earlier start of this one
  left,     ///< Its process is gone
};
/// \param name  of a file, without its folder  \param ending  that it must have, such as "tmp"
NameState state_of_name(std::string_view name, std::string_view ending);

/// A folder that remove_temporary_files() removes where it is still empty. Where too many are registered
/// already, or the name is too long, it is not.
void note_created_folder(const std::filesystem::path& folder) noexcept;
/// None of them is removed any more.
void forget_created_folders() noexcept;

/// Most names that are tried one after the other where one is taken.
inline constexpr int kNameAttempts = 100;

}  // namespace kiln
