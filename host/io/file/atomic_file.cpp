#include "io/file/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "kiln/error.h"

namespace kiln {
namespace {

// Names that a signal handler may have to remove. Fixed memory and lock-free states only, since a
// handler may run between any two instructions. A name that finds no slot, or is too long for one, is
// still removed by the destructor.
enum SlotState : int { kSlotFree, kSlotTaken, kSlotLive };

struct Slot {
  std::atomic<int> state{kSlotFree};
  std::array<char, 1024> path{};
};
static_assert(std::atomic<int>::is_always_lock_free);

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

std::array<Slot, 64> slots;
std::atomic<unsigned> name_counter{0};

int register_name(const std::string& name) {
  if (name.size() >= slots[0].path.size()) return -1;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    int expected = kSlotFree;
    if (!slots[i].state.compare_exchange_strong(expected, kSlotTaken)) continue;
    std::memcpy(slots[i].path.data(), name.c_str(), name.size() + 1);
    slots[i].state = kSlotLive;
    return static_cast<int>(i);
  }
  return -1;
}

void release_slot(int& slot) noexcept {
  if (slot >= 0) slots[static_cast<std::size_t>(slot)].state = kSlotFree;
  slot = -1;
}

const char* remedy(int error_number) {
  switch (error_number) {
    case ENOSPC:
    case EDQUOT:
      return " Free some space there, or write to another disk.";
    case EFBIG:
      return " Raise the limit on file sizes (ulimit -f), or write a smaller file.";
    case EACCES:
    case EPERM:
      return " Change its permissions, or write to another folder.";
    case EROFS:
      return " Write to a folder on a writable disk.";
    case ENOENT:
    case ENOTDIR:
      return " Create the folder first, or correct the path.";
    case EISDIR:
      return " Give a file's name instead.";
    case ENAMETOOLONG:
      return " Use a shorter name.";
    case EMFILE:
    case ENFILE:
      return " Raise the limit on open files (ulimit -n).";
    default:
      return " Check the disk, or write to another folder.";
  }
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path destination, bool allow_unnamed)
    : destination_(std::move(destination)) {
  if (destination_.empty()) fail("its name is empty; give one", 0);
  std::error_code error;
  target_ = std::filesystem::absolute(destination_, error);
  if (error) fail("", error.value());

  struct stat found {};
  if (stat(target_.c_str(), &found) == 0) {
    if (S_ISDIR(found.st_mode)) fail("there is a folder of this name", EISDIR);
    if (!S_ISREG(found.st_mode)) {
      direct_ = true;
      temporary_ = target_;
      const int descriptor = open(target_.c_str(), O_WRONLY | O_CLOEXEC);
      if (descriptor < 0) fail("", errno);
      open_stream(descriptor);
      return;
    }
    if (access(target_.c_str(), W_OK) != 0) fail("the file there is write-protected", errno);
    const std::filesystem::path followed = std::filesystem::canonical(target_, error);
    if (!error) target_ = followed;
  } else if (errno != ENOENT) {
    fail("", errno);
  }
  if (!target_.has_filename()) fail("the path names a folder", EISDIR);

  const std::filesystem::path folder = target_.parent_path();
  if (stat(folder.c_str(), &found) != 0) {
    const int number = errno;
    fail(number == ENOENT ? "the folder '" + folder.string() + "' does not exist" : "", number);
  }
  int descriptor = -1;
#ifdef O_TMPFILE
  if (allow_unnamed) descriptor = open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
  // The file is given its name through /proc: without that it could never appear.
  if (descriptor >= 0 &&
      access(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), F_OK) != 0) {
    close(descriptor);
    descriptor = -1;
  }
#endif
  if (descriptor < 0) descriptor = create_named();
  open_stream(descriptor);
}

AtomicFile::~AtomicFile() { discard(); }

void AtomicFile::open_stream(int descriptor) {
  stream_ = fdopen(descriptor, "wb");
  if (stream_ == nullptr) {
    const int number = errno;
    close(descriptor);
    discard();
    fail("", number);
  }
  buffer_.resize(kBufferBytes);
  std::setvbuf(stream_, buffer_.data(), _IOFBF, buffer_.size());
}

// Creates a file of a hidden, unused name and registers that.
int AtomicFile::create_named() {
  const std::filesystem::path folder = target_.parent_path();
  for (int attempt = 0;; ++attempt) {
    temporary_ = folder / (".kiln-" + std::to_string(static_cast<long>(getpid())) + "-" +
                           std::to_string(name_counter++) + ".tmp");
    // Registered first: a signal that arrives in between removes nothing.
    slot_ = register_name(temporary_.native());
    const int descriptor = open(temporary_.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
    if (descriptor >= 0) return descriptor;
    const int number = errno;
    release_slot(slot_);
    temporary_.clear();
    if (number != EEXIST || attempt == 100) {
      fail("the folder '" + folder.string() + "' cannot be written to", number);
    }
  }
}

// Gives a file that has no name yet a hidden one.
void AtomicFile::name_file() {
  if (!temporary_.empty()) return;
  const std::string link = "/proc/self/fd/" + std::to_string(fileno(stream_));
  const std::filesystem::path folder = target_.parent_path();
  for (int attempt = 0;; ++attempt) {
    std::filesystem::path name = folder / (".kiln-" + std::to_string(static_cast<long>(getpid())) +
                                           "-" + std::to_string(name_counter++) + ".tmp");
    slot_ = register_name(name.native());
    if (linkat(AT_FDCWD, link.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
      temporary_ = std::move(name);
      return;
    }
    const int number = errno;
    release_slot(slot_);
    if (number != EEXIST || attempt == 100) fail("", number);
  }
}

void AtomicFile::write(const void* data, std::size_t bytes) {
  if (bytes == 0) return;
  if (stream_ == nullptr) throw Error(ErrorCode::internal, "AtomicFile::write after close_stream.");
  errno = 0;
  if (std::fwrite(data, 1, bytes, stream_) != bytes) fail("", errno);
}

void AtomicFile::close_stream() {
  if (stream_ == nullptr) return;
  errno = 0;
  if (std::fflush(stream_) != 0 || std::ferror(stream_) != 0) fail("", errno);
  name_file();
  std::FILE* const stream = std::exchange(stream_, nullptr);
  errno = 0;
  if (std::fclose(stream) != 0) fail("", errno);
}

void AtomicFile::commit() {
  try {
    close_stream();
    if (!direct_) {
      if (temporary_.empty()) throw Error(ErrorCode::internal, "AtomicFile::commit called twice.");
      if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail("", errno);
    }
  } catch (...) {
    discard();
    throw;
  }
  release_slot(slot_);
  temporary_.clear();
}

void AtomicFile::discard() noexcept {
  if (stream_ != nullptr) std::fclose(std::exchange(stream_, nullptr));
  if (!direct_ && !temporary_.empty()) unlink(temporary_.c_str());
  release_slot(slot_);
  temporary_.clear();
}

void AtomicFile::fail(std::string_view what, int error_number) const {
  std::string message = "Could not write '" + destination_.string() + "'";
  if (!what.empty()) message += ": " + std::string(what);
  if (error_number != 0) {
    const std::string reason = std::generic_category().message(error_number);
    message += what.empty() ? ": " + reason : " (" + reason + ")";
  } else if (what.empty()) {
    message += ": the disk reported an error";
  }
  message += ".";
  if (error_number != 0 || what.empty()) message += remedy(error_number);
  throw Error(ErrorCode::output, message);
}

void remove_temporary_files() noexcept {
  const int saved = errno;
  for (Slot& slot : slots) {
    if (slot.state == kSlotLive) unlink(slot.path.data());
  }
  errno = saved;
}

}  // namespace kiln
