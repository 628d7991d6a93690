// Files of this process's user alone, in folders of caches.
#pragma once

#include <filesystem>
#include <string_view>

namespace kiln::ocl {

/// Writes a file that only this user may read, and its folders. Readers find the former file or the new one, never a
/// part. \returns false if that fails; a former file then stays
bool replace_private_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace kiln::ocl
