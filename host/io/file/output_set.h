// The files that one run reads and writes. Behind OutputSet of kiln/files.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "base/file.h"
#include "base/input_log.h"
#include "io/file/placing.h"

namespace kiln {

/// Hands a finished file to the set that is open. \returns false where none is: it is the caller's to place.
/// Throws Error(usage) where links make it one file with another one of the set.
bool hold_output(HeldFile& file);

/// Puts in place those files of the open set that a run wrote, as OutputSet::commit() does all: for several runs at once.
/// A run is known by the log of its inputs (base/input_log.h). Any thread. \throws Error(output)
void commit_outputs(const InputLog& run);
/// Removes the files of the open set that a run wrote. Any thread.
void discard_outputs(const InputLog& run);
/// A file that waits, and where its bytes can be read.
struct HeldOutput {
  std::filesystem::path destination, bytes;
};
/// The files of a run that wait; of one destination the last one.
std::vector<HeldOutput> outputs_of(const InputLog& run);
/// Number of files that wait in the open set.
std::size_t held_outputs();

/// Throws Error(usage) where a file is among those that were read since the set was opened; by identity, not
/// by name. Nothing where none is open. \param destination  its name, for the message
void refuse_input(const std::filesystem::path& destination, os::FileId file);

/// A file that is open for reading. Nothing where no set is open.
void note_read(os::FileId file);

}  // namespace kiln
