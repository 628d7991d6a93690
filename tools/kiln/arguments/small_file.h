// Small files, opened so that neither a pipe nor a device can hold the program up.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace kiln::cli {

/// The whole of a regular file of at most `most` bytes.
/// \param what  begins the message, such as "--view-weight 'views.txt'"
/// \throws Error(input): not there, not readable, no regular file, too long, no text; says which,
///   and what to do
std::string read_small_file(const std::filesystem::path& path, std::size_t most,
                            const std::string& what);

/// The first bytes of a regular file, at most `count`; empty where there is none that can be read.
std::string head_of_file(const std::filesystem::path& path, std::size_t count);

/// True if there is a regular file that can be read.
bool is_readable_file(const std::filesystem::path& path);

}  // namespace kiln::cli
