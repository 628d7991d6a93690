#include "io/file/cache_file.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <iterator>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "kiln/error.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

// Files that no run has used for longer than this are removed.
constexpr std::chrono::hours kMaxUnusedFileAge(24 * 30);
// Temporary files that are older than this are removed, since the process that wrote them must have been killed.
constexpr std::chrono::hours kMaxTemporaryFileAge(24);

/// Removes files that no run has used for a long time, and abandoned temporary files.
void remove_unused_files(const fs::path& folder) {
  std::error_code error;
  const auto now = fs::file_time_type::clock::now();
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code file_error;
    const bool complete =
        std::any_of(std::begin(kCacheFileSuffixes), std::end(kCacheFileSuffixes),
                    [&](const char* suffix) { return at->path().extension() == suffix; });
    const bool temporary = at->path().extension() == ".tmp";
    if (!complete && !temporary) continue;
    const auto age = now - at->last_write_time(file_error);
    if (!file_error && age > (complete ? kMaxUnusedFileAge : kMaxTemporaryFileAge))
      fs::remove(at->path(), file_error);
  }
}

}  // namespace

CacheFileWriter::CacheFileWriter(fs::path folder, std::string name)
    : folder_(std::move(folder)), name_(std::move(name)) {
  os::create_private_folders(folder_);
  remove_unused_files(folder_);
  file_ = os::create_unnamed(folder_);
  if (file_ >= 0) return;
  // Some file systems do not support unnamed temporary files (O_TMPFILE).
  temporary_ = unique_name();
  os::remove_file(temporary_.c_str());
  file_ = os::create_file(temporary_, 0600);
  if (file_ < 0) fail(errno);
}

CacheFileWriter::~CacheFileWriter() {
  if (file_ >= 0) os::close(file_);
  if (!temporary_.empty()) os::remove_file(temporary_.c_str());
}

/// A temporary name that no other run uses, since another run may be writing a file of the same name at the same time.
fs::path CacheFileWriter::unique_name() const {
  return folder_ / (name_ + "-" + os::process_namespace_id() + "-" +
                    std::to_string(os::process_id()) + ".tmp");
}

void CacheFileWriter::fail(int error) const {
  throw Error(ErrorCode::output, "A high poly larger than memory is sorted into a file in '" +
                                     folder_.string() +
                                     "', which cannot be written: " + std::strerror(error) +
                                     ". Make room there, or set XDG_CACHE_HOME to another folder.");
}

void CacheFileWriter::write(const void* data, std::size_t bytes) {
  std::size_t done = 0;
  while (done < bytes) {
    const std::ptrdiff_t now =
        os::write_some(file_, static_cast<const char*>(data) + done, bytes - done);
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) fail(now == 0 ? ENOSPC : errno);
    done += static_cast<std::size_t>(now);
  }
  size_ += bytes;
}

int CacheFileWriter::open_to_read() const {
  const int file =
      os::open_to_read(temporary_.empty() ? fs::path(os::path_of_open_file(file_)) : temporary_);
  if (file < 0) fail(errno);
  return file;
}

void CacheFileWriter::commit() {
  if (temporary_.empty()) {
    const fs::path hidden_name = unique_name();
    os::remove_file(hidden_name.c_str());
    if (!os::link_unnamed_file(file_, hidden_name)) fail(errno);
    temporary_ = hidden_name;
  }
  if (!os::replace(temporary_, path())) fail(errno);
  temporary_.clear();
  os::close(std::exchange(file_, -1));
}

int open_cache_file(const fs::path& path, std::uint64_t& bytes) {
  const int file = os::open_to_read(path);
  if (file < 0) return -1;
  const auto facts = os::query_file(file);
  if (!facts || !facts->is_owned_by_user) {
    os::close(file);
    return -1;
  }
  bytes = facts->bytes;
  return file;
}

void touch_cache_file(const fs::path& path) {
  std::error_code error;
  fs::last_write_time(path, fs::file_time_type::clock::now(), error);
}

}  // namespace kiln
