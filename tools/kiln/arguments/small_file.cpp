#include "arguments/small_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

#include "kiln/error.h"
#include "kiln/files.h"

namespace kiln::cli {
namespace {

/// Opened before it is looked at, and without waiting for whoever writes to a pipe.
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& path)
      : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    struct stat status {};
    if (file_ < 0 || ::fstat(file_, &status) != 0) {
      problem_ = std::strerror(errno);
    } else if (!S_ISREG(status.st_mode)) {
      problem_ = "it is no regular file";
    } else {
      size_ = static_cast<std::uint64_t>(status.st_size);
    }
  }
  ~RegularFile() {
    if (file_ >= 0) ::close(file_);
  }
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  /// Empty where it can be read.
  const std::string& problem() const { return problem_; }
  std::uint64_t size() const { return size_; }
  /// Fewer only at the end, or where the disk fails: then problem() says so.
  std::string read(std::size_t count) {
    std::string bytes(count, '\0');
    std::size_t have = 0;
    while (problem_.empty() && have < count) {
      const ssize_t got = ::read(file_, bytes.data() + have, count - have);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) problem_ = std::strerror(errno);
      if (got <= 0) break;
      have += static_cast<std::size_t>(got);
    }
    bytes.resize(have);
    return bytes;
  }

 private:
  int file_;
  std::uint64_t size_ = 0;
  std::string problem_;
};

}  // namespace

std::string read_small_file(const std::filesystem::path& path, std::size_t most,
                            const std::string& what) {
  OutputSet::protect(path);
  RegularFile file(path);
  // A file of 0 bytes by its file system (/proc) may have some: one more than allowed is asked for.
  std::string bytes = file.size() > most ? std::string() : file.read(most + 1);
  if (!file.problem().empty()) {
    throw Error(ErrorCode::input, what + " cannot be read (" + file.problem() +
                                      "): check the path, and name a text file.");
  }
  if (file.size() > most || bytes.size() > most) {
    throw Error(ErrorCode::input, what + " is longer than " + std::to_string(most >> 20) +
                                      " MiB, which such a file never is: check the path.");
  }
  // The reader may end there, and leave the rest out in silence.
  if (bytes.find('\0') != std::string::npos) {
    throw Error(ErrorCode::input, what +
                                      " holds bytes of 0, which no text has: check the path, "
                                      "and save it as plain text.");
  }
  return bytes;
}

std::string head_of_file(const std::filesystem::path& path, std::size_t count) {
  return RegularFile(path).read(count);
}

bool is_readable_file(const std::filesystem::path& path) {
  return RegularFile(path).problem().empty();
}

}  // namespace kiln::cli
