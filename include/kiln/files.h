#pragma once

#include <filesystem>
#include <string_view>

namespace kiln {

/// Writes a text file that appears whole or not at all. \throws Error(output)
void save_text(const std::filesystem::path& path, std::string_view text);

/// Fails now, and not after minutes of work, where no file could be written to a folder. Creates the
/// folder where only its last part is missing. \throws Error(output)
void prepare_output_folder(const std::filesystem::path& folder);

/// Removes the folders that prepare_output_folder() created in this process and that are still empty: for
/// a run that ends without having written anything.
void remove_empty_output_folders() noexcept;

/// Removes the temporary files of every save under way in this process. Async-signal-safe: for a signal
/// handler that is about to end the process. Finished files are not touched.
void remove_temporary_files() noexcept;

}  // namespace kiln
