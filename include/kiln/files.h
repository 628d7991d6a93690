#pragma once

#include <filesystem>
#include <string_view>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Writes a text file atomically: it appears whole or not at all. Several threads may save at once, to
/// different names.
/// \throws Error(output)
void save_text(const std::filesystem::path& path, std::string_view text);

/// A transaction over the output files of one run: all of them appear, or none.
///
/// While a set is open, files saved by any thread are written to temporary files; commit() moves
/// them to their names. Without commit() no output appears. Pipes and devices are written
/// immediately.
///
/// While a set is open, files that Kiln reads are protected inputs, material files of meshes
/// included: saving over one throws Error(usage) before a byte of it changes. Files are compared by
/// device and inode, not by name, so two outputs that are links to one file throw, too. A process
/// has one set at a time. Its functions may be called from any thread, commit() once all saves have
/// returned.
class OutputSet {
 public:
  OutputSet();   ///< \throws Error(usage) while another OutputSet exists
  ~OutputSet();  ///< Removes the temporary files of outputs that were not committed
  OutputSet(const OutputSet&) = delete;
  OutputSet& operator=(const OutputSet&) = delete;

  /// Moves the temporary files that were saved since the set was opened or last committed to their
  /// final names. If one of these moves fails, the previous files are restored. After a kill or
  /// power loss in between, the next prepare_output_folder() or commit() completes the commit,
  /// folder by folder. Waits while another process commits to the same folders.
  /// \throws Error(output)
  void commit();

  /// Returns the path of the temporary file that holds an output until commit(), so that it can be read
  /// earlier, for example by another program. Empty if nothing was saved under this name.
  static std::filesystem::path temporary_path(const std::filesystem::path& destination);

  /// Adds a file to the protected inputs, for inputs that Kiln has not read yet or that other code
  /// reads.
  static void protect(const std::filesystem::path& input);

  /// Checks early, before minutes of work, that saving to a destination would not overwrite an input.
  /// \throws Error(usage)
  static void check(const std::filesystem::path& destination);
};

/// True while OutputSet::commit() moves files: a signal handler that would end the process should return
/// instead. Async-signal-safe.
bool is_committing_outputs() noexcept;

/// Checks early, before minutes of work, that files can be written to a folder. Creates the folder and its parents if
/// they are missing, and completes a commit that a killed process began there. Any thread.
/// \throws Error(output)
void prepare_output_folder(const std::filesystem::path& folder);

/// Removes folders that prepare_output_folder() created in this process and that are still empty: for a
/// run that ends without output. Any thread.
void remove_empty_output_folders() noexcept;

/// Removes the temporary files of all saves in progress in this process, then calls
/// remove_empty_output_folders(). Async-signal-safe: for a signal handler that is about to end the
/// process. Finished files are kept.
void remove_temporary_files() noexcept;

}  // namespace kiln
