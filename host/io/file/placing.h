// Puts finished files in place: together, or none of them.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "io/file/temporary.h"

namespace kiln {

/// A finished file that waits for its place.
struct HeldFile {
  HeldFile() = default;
  ~HeldFile();  ///< Removes it where it was not placed
  HeldFile(HeldFile&& other) noexcept;
  HeldFile& operator=(HeldFile&& other) noexcept;

  std::filesystem::path destination;  ///< As given, for messages
  std::filesystem::path target;       ///< Absolute, links followed
  TemporaryName temporary;            ///< Empty while it has no name
  int descriptor = -1;                ///< Open while it has no name
  const void* run = nullptr;          ///< That wrote it: see commit_outputs()

  /// Waits until its bytes are on the medium. \throws Error(output)
  void sync() const;
  /// Gives it a hidden name if it has none. \throws Error(output)
  void name();
  void discard() noexcept;
};

/// Renames all files to their targets, in order; a later file of one target wins.
///
/// Work that a killed process began in their folders is finished first. Of several files, one that fails
/// brings back what was there before, for all of them. Within a folder, a journal lets the next process
/// that writes there finish a killed one's work. A lock keeps two processes from mixing their files.
/// \throws Error(output)
void place_files(std::vector<HeldFile>& files);

/// Finishes what a killed process began in a folder: the files that its journal names. Does nothing where
/// there is no journal. Waits for processes that place files there now.
void finish_interrupted(const std::filesystem::path& folder) noexcept;

/// An Error(output) that names a destination, says why (from errno where not zero) and what to do.
[[noreturn]] void fail_to_write(const std::filesystem::path& destination, std::string_view what,
                                int error_number);

}  // namespace kiln
