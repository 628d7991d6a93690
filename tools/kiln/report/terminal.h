// Text on its way to standard output and standard error.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace kiln::cli {

/// As a terminal may be given it: control characters, which a name in a file may hold to move the cursor or to
/// change the window, and bytes that are no UTF-8 become \xNN. Line breaks and tabs stay.
std::string printable(std::string_view text);

/// The first `columns` characters. \param text  printable
std::string_view first_columns(std::string_view text, std::size_t columns);

/// A line of text: all that the command prints goes this way. Flushed.
void print_line(std::FILE* to, std::string_view text);

/// Columns of the terminal that standard error is; 80 where it does not say.
std::size_t terminal_columns();

/// Standard output to where it goes. A reader that has left, as `head` does, has read what it wanted: that is no
/// error. \throws Error(output) where it is closed, or its disk is full
void finish_output();

/// Where the command is started without standard input, output or error, a file that it opens would take their
/// place, and what is printed would go into that file. So they are opened, such that their use fails as before.
/// \returns false where that cannot be
bool reserve_descriptors();

}  // namespace kiln::cli
