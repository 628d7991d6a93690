// Access to files of a run: reads that never block, and checks that protect the user's files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "kiln/message.h"

namespace kiln {

/// Reads a regular file of at most `max_bytes` bytes.
/// \param what  start of the message, such as "--view-weight 'views.txt'"
/// \throws Error(input) with the remedy if the file is missing, unreadable, not regular, too long, or not text
std::string read_small_file(const std::filesystem::path& path, std::size_t max_bytes,
                            const Message& what);

/// The first bytes of a regular file, at most `count`; empty if it is not readable.
std::string head_of_file(const std::filesystem::path& path, std::size_t count);

/// True for a readable regular file.
bool is_readable_file(const std::filesystem::path& path);

/// True for a regular file that exists and may not be written to.
bool is_write_protected(const std::filesystem::path& path);

/// True if two paths name the same file, which need not exist.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Rejects outputs that equal an input or another output, before any work. Empty paths and "-" are ignored. Files that
/// inputs refer to are checked when they are read. \throws Error(usage)
void check_paths(const std::vector<std::filesystem::path>& inputs,
                 const std::vector<std::filesystem::path>& outputs);

/// Rejects an existing OBJ that Kiln did not write, unless `force` is set. \throws Error(output)
void check_obj_is_replaceable(const std::filesystem::path& obj, bool force);
/// True if Kiln wrote an OBJ, and no other program has overwritten it.
bool is_obj_by_kiln(const std::filesystem::path& obj);

/// Creates the folder of a file if it is missing, and checks that it is writable. Streams such as /dev/stdout are
/// skipped.
/// \throws Error(output)
void prepare_parent(const std::filesystem::path& file);

/// Rejects a folder that holds maps of another low poly of the same name.
/// \param stem  stem of the maps' names
/// \param source  LOW, or HIGH if Kiln makes LOW
/// \throws Error(usage) that names both meshes and the remedy
void check_folder_holds_same_low(const std::filesystem::path& folder, const std::string& stem,
                                 const std::filesystem::path& source);

/// Records the low poly of the maps in the hidden file FOLDER/.STEM.kiln.json. Its path is relative to the folder, so
/// that both can be moved together. \throws Error(output)
void save_low_record(const std::filesystem::path& folder, const std::string& stem,
                     const std::filesystem::path& source);

}  // namespace kiln
