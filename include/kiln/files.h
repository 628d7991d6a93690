#pragma once

#include <filesystem>
#include <string_view>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Writes a text file that appears whole or not at all. Several threads may save at once, to different names.
/// \throws Error(output)
void save_text(const std::filesystem::path& path, std::string_view text);

/// Files of one run that appear together, or none of them.
///
/// While a set is open, what any thread saves with Kiln is written out of sight; commit() puts
/// it in place. Without commit() nothing appears. Pipes and devices are written to at once.
///
/// While a set is open, files that Kiln reads are inputs. So are the material files that a mesh
/// names: saving over one throws Error(usage), by whatever name (the device and inode count), and
/// before a byte of it changes. So does saving two files that links make one. A process has one set
/// at a time; its functions may be called from any thread, commit() when all saves have returned.
class OutputSet {
 public:
  OutputSet();   ///< \throws Error(usage) while another is open
  ~OutputSet();  ///< Removes what was not committed
  OutputSet(const OutputSet&) = delete;
  OutputSet& operator=(const OutputSet&) = delete;

  /// Puts in place what was saved since the set was opened, or last committed. Where one file
  /// fails, those that were there before come back. After a kill or a power cut in between, the
  /// next prepare_output_folder() or commit() finishes it, folder by folder. Waits while another
  /// process places files in the same folders.
  /// \throws Error(output)
  void commit();

  /// Path at which the bytes of a file that is held back can be read until commit(), by another program, say.
  /// Empty: nothing was saved under this name.
  static std::filesystem::path held(const std::filesystem::path& destination);

  /// Makes a file an input that is read without Kiln, or later.
  static void protect(const std::filesystem::path& input);

  /// Fails now, and not after minutes of work, where saving to a destination would write over an input.
  /// \throws Error(usage)
  static void check(const std::filesystem::path& destination);
};

/// True while OutputSet::commit() is at work between its first file and its last: a signal handler that would
/// end the process should return instead. Async-signal-safe.
bool placing_outputs() noexcept;

/// Fails now, and not after minutes of work, where no file could be written to a folder. Creates the
/// folder, and those that it lies in, where they are missing. Finishes what a killed process began there. Any thread.
/// \throws Error(output)
void prepare_output_folder(const std::filesystem::path& folder);

/// Removes the folders that prepare_output_folder() created in this process and that are still empty: for
/// a run that ends without having written anything. Any thread.
void remove_empty_output_folders() noexcept;

/// Removes the temporary files of every save under way in this process, and then what
/// remove_empty_output_folders() would. Async-signal-safe: for a signal handler that is about to end the
/// process. Finished files are not touched.
void remove_temporary_files() noexcept;

}  // namespace kiln
