// The files of a run: none of the user's is lost.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "report/report.h"

namespace kiln::cli {

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

/// Writes a report to a file, or to standard output where the path is "-". \throws Error(output)
void save_report(const std::filesystem::path& path, const Json& report);

}  // namespace kiln::cli
