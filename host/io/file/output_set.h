// The files that one run reads and writes. Behind OutputSet of kiln/files.h.
#pragma once

#include <sys/stat.h>

#include "io/file/placing.h"

namespace kiln {

/// Hands a finished file to the set that is open. \returns false where none is: it is the caller's to place
bool hold_output(HeldFile& file);

/// Whether a file is among those that were read since the set was opened; by identity, not by name. False
/// where none is open.
bool was_read(const struct stat& file);

/// A file that is open for reading. Nothing where no set is open.
void note_read(const struct stat& file);

}  // namespace kiln
