// The standard streams and the terminal. Implemented in posix/ and windows/.
#pragma once

#include <cstddef>
#include <cstdio>

namespace kiln::os {

/// Prepares the standard streams for UTF-8: bytes are written unchanged, and terminals show Unicode and obey
/// control sequences. Only Windows needs it.
void prepare_streams() noexcept;

/// Restores the state that the terminal had before prepare_streams(), then calls std::_Exit(). Async-signal-safe.
[[noreturn]] void end_process(int exit_code) noexcept;

/// If the program was started without some of the standard streams, reserves their descriptors, such that using these
/// streams still fails. Otherwise a file that the program opens could get such a descriptor, and printed text would be
/// written to that file. \returns false on failure
bool reserve_streams() noexcept;

/// True if the stream is a terminal that obeys control sequences.
bool is_terminal(std::FILE* stream) noexcept;
/// Number of columns of the terminal of standard error; 80 if unknown.
std::size_t terminal_columns() noexcept;

/// After a write that failed: true if the stream is a pipe or socket without a reader.
bool has_reader_closed(std::FILE* stream) noexcept;
/// True if the stream cannot be written, since it is closed or open for reading only.
bool is_closed(std::FILE* stream) noexcept;

/// Writes to standard error. Async-signal-safe.
void write_error(const char* text) noexcept;

}  // namespace kiln::os
