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
  ~HeldFile();  ///< Removes the file unless it was placed
  HeldFile(HeldFile&& other) noexcept;
  HeldFile& operator=(HeldFile&& other) noexcept;

  std::filesystem::path destination;  ///< As given, for messages
  std::filesystem::path target;       ///< Absolute, with links resolved
  TemporaryName temporary;            ///< Empty while it is unnamed
  int descriptor = -1;                ///< Open while it is unnamed
  const void* run = nullptr;          ///< The run that wrote it: see commit_outputs()

  /// Waits until its bytes are on the medium. \throws Error(output)
  void sync() const;
  /// Gives it a hidden name if it is unnamed. \throws Error(output)
  void name();
  void discard() noexcept;
};

/// Renames all files to their targets, in order; a later file of one target wins.
///
/// Transactions of killed processes in these folders are completed first. If one file fails, the
/// previous files are restored for all. A journal per folder lets the next process complete the work of
/// a killed one. A lock keeps two processes from mixing their files.
/// \throws Error(output)
void place_files(std::vector<HeldFile>& files);

/// Completes the transaction of a killed process in a folder, as recorded in its journal, if there is
/// one. Waits for processes that place files there now.
void finish_interrupted(const std::filesystem::path& folder) noexcept;

/// Throws an Error(output) that names a destination, the reason (from errno if not zero) and a
/// remedy.
[[noreturn]] void fail_to_write(const std::filesystem::path& destination, std::string_view what,
                                int error_number);

}  // namespace kiln
