// Moves finished files to their destinations: either all of them, or none.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "io/file/temporary.h"

namespace kiln {

/// A finished file that is not at its destination yet.
struct PendingFile {
  PendingFile() = default;
  ~PendingFile();  ///< Removes the file, unless it was placed
  PendingFile(PendingFile&& other) noexcept;
  PendingFile& operator=(PendingFile&& other) noexcept;

  std::filesystem::path destination;  ///< Path as the caller gave it, for messages
  std::filesystem::path target;       ///< Absolute path of the destination with links resolved
  TemporaryName temporary;            ///< Empty while the file is unnamed
  int descriptor = -1;                ///< Descriptor of the file while it is unnamed; else -1
  /// Identifies the run that wrote the file; see commit_outputs()
  const void* run = nullptr;

  /// Waits until the file's bytes are on the medium.
  /// \throws Error(output)
  void sync() const;
  /// Gives the file a hidden name if it is unnamed.
  /// \throws Error(output)
  void name();
  void discard() noexcept;
};

/// Renames all files to their targets, in order. If several files have the same target, the last
/// one remains.
///
/// First, interrupted transactions of killed processes in these folders are completed. If a file
/// cannot be placed, all old files are restored. Each folder gets a journal, from which the next
/// process can complete the transaction if this one is killed. A lock ensures that two processes do
/// not mix their files.
/// \throws Error(output)
void place_files(std::vector<PendingFile>& files);

/// If a killed process has left a journal in a folder, completes its transaction. Waits for
/// processes that are placing files there.
void finish_interrupted(const std::filesystem::path& folder) noexcept;

/// Throws an Error(output) that names a destination, the reason (from errno if not zero) and a
/// remedy.
[[noreturn]] void fail_to_write(const std::filesystem::path& destination, std::string_view what,
                                int error_number);

}  // namespace kiln
