// The files that one run reads and writes. Behind OutputSet of kiln/files.h.
#pragma once

#include <sys/stat.h>

#include <filesystem>

#include "io/file/placing.h"

namespace kiln {

/// Hands a finished file to the set that is open. \returns false where none is: it is the caller's to place.
/// Throws Error(usage) where links make it one file with another one of the set.
bool hold_output(HeldFile& file);

/// Throws Error(usage) where a file is among those that were read since the set was opened; by identity, not
/// by name. Nothing where none is open. \param destination  its name, for the message
void refuse_input(const std::filesystem::path& destination, const struct stat& file);

/// A file that is open for reading. Nothing where no set is open.
void note_read(const struct stat& file);

}  // namespace kiln
