// The standard streams, and the terminal that they may be. Implemented in posix/ and windows/.
#pragma once

#include <cstddef>
#include <cstdio>

namespace kiln::os {

/// Makes the standard streams those of a program of UTF-8: bytes as they are, and on a terminal Unicode and control
/// sequences. Needed on Windows; elsewhere they are.
void prepare_streams() noexcept;

/// Opens the standard streams that the program was started without, such that their use fails as before: else a file that
/// it opens takes their place, and what is printed goes into that file. \returns false where that cannot be
bool reserve_streams() noexcept;

/// True if the stream is a terminal that obeys control sequences.
bool is_terminal(std::FILE* stream) noexcept;
/// Columns of the terminal that standard error is; 80 where it does not say.
std::size_t terminal_columns() noexcept;

/// After a write that failed: true if the stream is a pipe or socket without a reader.
bool reader_left(std::FILE* stream) noexcept;
/// True if nothing can be written to the stream, since it is closed or is open for reading alone.
bool is_closed(std::FILE* stream) noexcept;

/// Writes to standard error. Async-signal-safe.
void write_error(const char* text) noexcept;

}  // namespace kiln::os
