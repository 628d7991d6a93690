// Input and output files of a run; implementation of OutputSet of kiln/files.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "base/file.h"
#include "base/input_log.h"
#include "io/file/placing.h"

namespace kiln {

/// Hands a finished file to the open set. \returns false if none is open: the caller then places the file.
/// Throws Error(usage) if links make it identical to another file of the set.
bool hold_output(HeldFile& file);

/// Commits the files of the open set that a run wrote, as OutputSet::commit() does for all files. It serves several
/// concurrent runs. A run is identified by its log of inputs (base/input_log.h). May be called from any thread.
/// \throws Error(output)
void commit_outputs(const InputLog& run);
/// Deletes the files that a run wrote to the open set and did not commit. May be called from any thread.
void discard_outputs(const InputLog& run);
/// An uncommitted file, and the path of its bytes.
struct HeldOutput {
  std::filesystem::path destination, bytes;
};
/// Uncommitted files of a run; if several have the same destination, only the last one.
std::vector<HeldOutput> outputs_of(const InputLog& run);
/// Number of uncommitted files in the open set.
std::size_t held_outputs();

/// Throws Error(usage) if the file with this identity was read since the set was opened. Without an open set it does
/// nothing.
/// \param destination  the file's name, for the message
void refuse_input(const std::filesystem::path& destination, os::FileId file);

/// Records a file that is open for reading as an input. Without an open set it does nothing.
void register_input(os::FileId file);

}  // namespace kiln
