// The files that one run reads and writes. Behind OutputSet of kiln/files.h.
#pragma once

#include <filesystem>

#include "base/file.h"
#include "io/file/placing.h"

namespace kiln {

/// Hands a finished file to the set that is open. \returns false where none is: it is the caller's to place.
/// Throws Error(usage) where links make it one file with another one of the set.
bool hold_output(HeldFile& file);

/// Throws Error(usage) where a file is among those that were read since the set was opened; by identity, not
/// by name. Nothing where none is open. \param destination  its name, for the message
void refuse_input(const std::filesystem::path& destination, os::FileId file);

/// A file that is open for reading. Nothing where no set is open.
void note_read(os::FileId file);

}  // namespace kiln
