#include "kiln/files.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "io/atomic_file.h"
#include "kiln/error.h"

namespace kiln {

void save_text(const std::filesystem::path& path, std::string_view text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

void prepare_output_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path target = folder.empty() ? fs::path(".") : folder;
  std::error_code error;
  if (!fs::exists(target, error)) {
    fs::create_directory(target, error);
    if (error) {
      throw Error(ErrorCode::output, "The output folder '" + target.string() +
                                         "' cannot be created (" + error.message() +
                                         "): create its parent folder, or choose another place.");
    }
    return;
  }
  if (!fs::is_directory(target, error)) {
    throw Error(ErrorCode::output,
                "'" + target.string() + "' is not a folder: give a folder for the output.");
  }
  if (access(target.c_str(), W_OK | X_OK) != 0) {
    throw Error(ErrorCode::output, "The output folder '" + target.string() +
                                       "' cannot be written (" + std::strerror(errno) +
                                       "): change its permissions, or choose another place.");
  }
}

}  // namespace kiln
