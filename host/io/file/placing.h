// Places finished files at their destinations: all of them, or none.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "io/file/temporary.h"

namespace kiln {

/// A finished file that is not placed yet.
struct HeldFile {
  HeldFile() = default;
  ~HeldFile();  ///< Removes the file if it was not placed
  HeldFile(HeldFile&& other) noexcept;
  HeldFile& operator=(HeldFile&& other) noexcept;

  std::filesystem::path destination;  ///< Path as the caller gave it, for messages
  std::filesystem::path target;       ///< Absolute, with links resolved
  TemporaryName temporary;            ///< Empty while the file is unnamed
  int descriptor = -1;                ///< Descriptor of the file while it is unnamed; else -1
  const void* run = nullptr;          ///< Run that wrote the file, see commit_outputs()

  /// Waits until the file's bytes are on the medium.
  /// \throws Error(output)
  void sync() const;
  /// Gives the file a hidden name if it is unnamed.
  /// \throws Error(output)
  void name();
  void discard() noexcept;
};

/// Renames all files to their targets, in order; if several files have the same target, the last one remains.
///
/// Transactions of killed processes in these folders are completed first. If one file cannot be placed, all old files
/// are restored. From a journal in each folder, the next process completes the transaction of a killed one. A lock
/// keeps two processes from mixing their files.
/// \throws Error(output)
void place_files(std::vector<HeldFile>& files);

/// Completes the transaction of a killed process in a folder, as recorded in its journal, if there is one. Waits for
/// processes that are placing files in the folder.
void finish_interrupted(const std::filesystem::path& folder) noexcept;

/// Throws an Error(output) that names a destination, the reason (from errno if not zero) and a
/// remedy.
[[noreturn]] void fail_to_write(const std::filesystem::path& destination, std::string_view what,
                                int error_number);

}  // namespace kiln
