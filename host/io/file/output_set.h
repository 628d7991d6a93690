// The input and output files of a run; the implementation of OutputSet in kiln/files.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "base/file.h"
#include "base/input_log.h"
#include "io/file/placing.h"

namespace kiln {

/// Passes a finished file to the open set.
/// \returns false if no set is open; then the caller places the file
/// \throws Error(usage) if links make it the same file as another one of the set
bool add_to_open_set(PendingFile& file);

/// Commits those files of the open set that one run wrote, as OutputSet::commit() does for all
/// files; for several runs at the same time. A run is identified by its log of inputs
/// (base/input_log.h). May be called from any thread.
/// \throws Error(output)
void commit_outputs(const InputLog& run);
/// Deletes the files that a run wrote to the open set, unless they were committed. May be called
/// from any thread.
void discard_outputs(const InputLog& run);
/// An output file that is not committed yet, and the path at which its bytes can be read.
struct PendingOutput {
  std::filesystem::path destination, bytes;
};
/// The uncommitted files of a run. Of several with the same destination, only the last one is
/// included.
std::vector<PendingOutput> outputs_of(const InputLog& run);
/// Number of uncommitted files in the open set.
std::size_t held_outputs();

/// Throws Error(usage) if the file with this identity was read since the set was opened. Without an open set it does
/// nothing.
/// \param destination  the file's name, for the message
void refuse_input(const std::filesystem::path& destination, os::FileId file);

/// Records a file that is open for reading as an input. Without an open set it does nothing.
void register_input(os::FileId file);

}  // namespace kiln
