// The files of a run: read without being held up, and none of the user's is lost.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "kiln/message.h"

namespace kiln {

/// The whole of a regular file of at most `most` bytes.
/// \param what  begins the message, such as "--view-weight 'views.txt'"
/// \throws Error(input): not there, not readable, no regular file, too long, no text; says which,
///   and what to do
std::string read_small_file(const std::filesystem::path& path, std::size_t most,
                            const Message& what);

/// The first bytes of a regular file, at most `count`; empty where there is none that can be read.
std::string head_of_file(const std::filesystem::path& path, std::size_t count);

/// True if there is a regular file that can be read.
bool is_readable_file(const std::filesystem::path& path);

/// True if two paths are one file, there or not yet.
bool is_one_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Refuses outputs that are inputs, or that are written twice, before any work. Empty paths and "-" do not
/// count. Files that inputs name are known once they are read, and refused then.
/// \throws Error(usage)
void check_paths(const std::vector<std::filesystem::path>& inputs,
                 const std::vector<std::filesystem::path>& outputs);

/// Refuses to write over an OBJ that Kiln did not write. \throws Error(output)
void check_not_foreign(const std::filesystem::path& obj, bool force);
/// True if Kiln wrote an OBJ, and nothing has written over it.
bool is_own_obj(const std::filesystem::path& obj);

/// The folder that a file goes to must take files; made where it is missing. Streams such as /dev/stdout need none.
/// \throws Error(output)
void prepare_parent(const std::filesystem::path& file);

/// Refuses a folder that has maps of another low poly of the same name.
/// \param stem    of the maps' names
/// \param source  LOW; where Kiln makes it, HIGH
/// \throws Error(usage) names both meshes and the remedy
void check_low_record(const std::filesystem::path& folder, const std::string& stem,
                      const std::filesystem::path& source);

/// Notes whose maps these are, in the hidden file FOLDER/.STEM.kiln.json. The path in it starts at the
/// folder, so that both can move together. \throws Error(output)
void save_low_record(const std::filesystem::path& folder, const std::string& stem,
                     const std::filesystem::path& source);

}  // namespace kiln
