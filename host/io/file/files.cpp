#include "kiln/files.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <system_error>
#include <vector>

#include "base/file.h"
#include "io/file/atomic_file.h"
#include "io/file/placing.h"
#include "io/file/temporary.h"
#include "kiln/error.h"

namespace kiln {

namespace {

std::mutex created_mutex;
std::vector<std::filesystem::path> created_folders;

/// Opens a path that is not an ordinary file: one that names an open descriptor of the process, a
/// pipe, or a device such as /dev/null. Such paths are written to directly, and no file is
/// replaced.
/// \returns -1 for an ordinary path
int open_stream(const std::filesystem::path& path) {
  if (os::is_device_name(path)) return -1;  // AtomicFile refuses it
  const std::string name = path.string();
  if (name == "/dev/stdout") return os::duplicate(1);
  if (name == "/dev/stderr") return os::duplicate(2);
  for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (name.rfind(folder, 0) == 0) {
      return os::duplicate(std::atoi(name.c_str() + folder.size()));
    }
  }
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  using Type = std::filesystem::file_type;
  if (kind == Type::fifo || kind == Type::character || kind == Type::socket) {
    return os::open_to_write(path);
  }
  return -1;
}

/// \throws Error(output) if a folder, or one of its parents, is a dangling symbolic link
void refuse_broken_link(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  for (fs::path part = folder; !part.empty() && part != part.parent_path();
       part = part.parent_path()) {
    if (!fs::is_symlink(part, error) || fs::exists(part, error)) continue;
    const fs::path to = fs::read_symlink(part, error);
    if (error) continue;
    throw Error(ErrorCode::output, "The output folder '" + part.string() +
                                       "' is a symbolic link to '" + to.string() +
                                       "', which does not exist: create '" +
                                       (part.parent_path() / to).lexically_normal().string() +
                                       "', or remove the link.");
  }
}

/// Creates a folder whose parent exists. \throws Error(output)
void create_output_folder(const std::filesystem::path& folder) {
  std::error_code error;
  const bool is_created = std::filesystem::create_directory(folder, error);
  if (error) {
    throw Error(ErrorCode::output, "The output folder '" + folder.string() +
                                       "' cannot be created (" + error.message() +
                                       "): choose another place.");
  }
  if (!is_created) return;  // Another process has created the folder, or the path ends in a slash
  const std::filesystem::path absolute_folder = os::absolute(folder, error);
  const std::lock_guard lock(created_mutex);
  created_folders.push_back(error ? folder : absolute_folder);
  register_created_folder(created_folders.back());
}

}  // namespace

void save_text(const std::filesystem::path& path, std::string_view text) {
  if (const int stream = open_stream(path); stream >= 0) {
    bool all_succeeded = true;
    while (all_succeeded && !text.empty()) {
      const std::ptrdiff_t written = os::write_some(stream, text.data(), text.size());
      all_succeeded = written > 0 || (written < 0 && errno == EINTR);
      if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    }
    const std::string reason = all_succeeded ? "" : std::strerror(errno);
    os::close(stream);
    if (all_succeeded) return;
    throw Error(ErrorCode::output, "'" + path.string() + "' cannot be written (" + reason + ").");
  }
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

void remove_empty_output_folders() noexcept {
  const std::lock_guard lock(created_mutex);
  // Folders are removed in the reverse order of their creation.
  while (!created_folders.empty()) {
    // This fails for folders that are not empty, as it should.
    os::remove_folder(created_folders.back().c_str());
    created_folders.pop_back();
  }
  unregister_created_folders();
}

void prepare_output_folder(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path target = folder.empty() ? fs::path(".") : folder;
  std::error_code error;
  if (!fs::exists(target, error)) {
    refuse_broken_link(target);
    std::vector<fs::path> missing_folders;
    // A root folder cannot be missing, and a drive's name alone stands for its current folder.
    for (fs::path part = target; part.has_relative_path() && !fs::exists(part, error);
         part = part.parent_path()) {
      missing_folders.push_back(part);
    }
    for (auto part = missing_folders.rbegin(); part != missing_folders.rend(); ++part)
      create_output_folder(*part);
    return;
  }
  if (!fs::is_directory(target, error)) {
    throw Error(ErrorCode::output,
                "'" + target.string() + "' is not a folder: give a folder for the output.");
  }
  if (!os::may_write_in(target)) {
    throw Error(ErrorCode::output, "The output folder '" + target.string() +
                                       "' cannot be written (" + std::strerror(errno) +
                                       "): change its permissions, or choose another place.");
  }
  finish_interrupted(target);
}

}  // namespace kiln
