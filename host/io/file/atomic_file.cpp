#include "io/file/atomic_file.h"

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/file.h"
#include "io/file/output_set.h"
#include "io/file/placing.h"
#include "kiln/error.h"

namespace kiln {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
// Maximum number of symbolic links that are followed in a row, as in Linux
constexpr int kMaxSymlinks = 40;

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path destination, bool allow_unnamed)
    : destination_(std::move(destination)) {
  if (destination_.empty()) fail("its name is empty; give one", 0);
  if (os::is_device_name(destination_)) {
    fail("Windows reserves this name for a device; choose another", 0);
  }
  std::error_code error;
  target_ = os::absolute(destination_, error);
  if (error) fail("", error.value());
  examine_destination();
  if (is_written_directly_) return;
  if (!target_.has_filename()) fail("the path names a folder", EISDIR);

  const std::filesystem::path folder = target_.parent_path();
  if (!os::query_file(folder)) {
    const int saved_error = errno;
    fail(saved_error == ENOENT ? "the folder '" + folder.string() + "' does not exist" : "",
         saved_error);
  }
  int descriptor = allow_unnamed ? os::create_unnamed(folder) : -1;
  if (descriptor < 0) descriptor = create_named();
  open_stream(descriptor);
}

AtomicFile::~AtomicFile() { discard(); }

// Finds out what is at the destination: nothing, a file to replace, or a device to write to
// directly.
void AtomicFile::examine_destination() {
  const std::optional<os::FileStatus> found = os::query_file(target_);
  if (!found) {
    if (errno != ENOENT) fail("", errno);
    follow_links();
    return;
  }
  if (found->is_folder) fail("there is a folder of this name", EISDIR);
  if (!found->is_regular) {
    is_written_directly_ = true;
    const int descriptor = os::open_to_write(target_);
    if (descriptor < 0) fail("", errno);
    open_stream(descriptor);
    return;
  }
  refuse_input(destination_, found->id);
  if (!os::may_write(target_)) fail("the file there is write-protected", errno);
  mode_ = found->permissions;
  std::error_code error;
  const std::filesystem::path followed = os::canonical(target_, error);
  if (!error) target_ = followed;
}

// A link may point to a file that does not exist; then that file is created.
void AtomicFile::follow_links() {
  std::error_code error;
  for (int links = 0; std::filesystem::is_symlink(target_, error); ++links) {
    if (links == kMaxSymlinks) fail("", ELOOP);
    const std::filesystem::path to = std::filesystem::read_symlink(target_, error);
    if (error) fail("", error.value());
    target_ = (target_.parent_path() / to).lexically_normal();
  }
}

void AtomicFile::open_stream(int descriptor) {
  stream_ = os::stream_of(descriptor);
  if (stream_ == nullptr) {
    const int saved_error = errno;
    os::close(descriptor);
    discard();
    fail("", saved_error);
  }
  buffer_.resize(kBufferBytes);
  std::setvbuf(stream_, buffer_.data(), _IOFBF, buffer_.size());
}

// Creates a file with a hidden, unused name.
int AtomicFile::create_named() {
  const std::filesystem::path folder = target_.parent_path();
  for (int attempt = 0;; ++attempt) {
    // Registered before the file exists, so that a signal handler never misses it.
    TemporaryName name(folder);
    const int descriptor = os::create_file(name.path(), 0666);
    if (descriptor >= 0) {
      temporary_ = std::move(name);
      return descriptor;
    }
    const int saved_error = errno;
    if (saved_error != EEXIST || attempt == kNameAttempts) {
      fail("the folder '" + folder.string() + "' cannot be written to", saved_error);
    }
  }
}

// Gives an unnamed file a hidden name.
void AtomicFile::give_hidden_name() {
  if (is_written_directly_ || !temporary_.empty()) return;
  PendingFile file;
  file.destination = destination_;
  file.target = target_;
  file.descriptor = os::duplicate(os::descriptor_of_stream(stream_));
  if (file.descriptor < 0) fail("", errno);
  file.name();
  temporary_ = std::move(file.temporary);
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
  give_hidden_name();
  std::FILE* const stream = std::exchange(stream_, nullptr);
  errno = 0;
  if (std::fclose(stream) != 0) fail("", errno);
}

// Sets the file's permissions, and starts flushing it to the medium, so that the flush overlaps
// with the making of the next file.
void AtomicFile::begin_flush(int descriptor) const {
  if (mode_ && !os::set_permissions(descriptor, *mode_) && errno != EPERM) fail("", errno);
  os::begin_sync(descriptor);  // PendingFile::sync() waits until the data is on the medium
}

void AtomicFile::commit() {
  if (is_committed_) throw Error(ErrorCode::internal, "AtomicFile::commit called twice.");
  try {
    if (is_written_directly_) {
      close_stream();
      is_committed_ = true;
      return;
    }
    PendingFile file;
    file.destination = destination_;
    file.target = target_;
    if (stream_ != nullptr) {
      errno = 0;
      if (std::fflush(stream_) != 0 || std::ferror(stream_) != 0) fail("", errno);
      begin_flush(os::descriptor_of_stream(stream_));
      if (temporary_.empty()) {
        file.descriptor = os::duplicate(os::descriptor_of_stream(stream_));
        // An unnamed file must stay open, and too many files are open already
        if (file.descriptor < 0) give_hidden_name();
      }
      std::FILE* const stream = std::exchange(stream_, nullptr);
      errno = 0;
      if (std::fclose(stream) != 0) fail("", errno);
    } else {
      const int descriptor = os::open_to_read(temporary_.path());
      if (descriptor < 0) fail("", errno);
      try {
        begin_flush(descriptor);
      } catch (...) {
        os::close(descriptor);
        throw;
      }
      os::close(descriptor);
    }
    file.temporary = std::move(temporary_);
    is_committed_ = true;
    if (add_to_open_set(file)) return;
    std::vector<PendingFile> single_file;
    single_file.push_back(std::move(file));
    place_files(single_file);
  } catch (...) {
    discard();
    throw;
  }
}

void AtomicFile::discard() noexcept {
  if (stream_ != nullptr) std::fclose(std::exchange(stream_, nullptr));
  if (!temporary_.empty()) os::remove_file(temporary_.path().c_str());
  temporary_.release();
}

void AtomicFile::fail(std::string_view what, int error_number) const {
  fail_to_write(destination_, what, error_number);
}

}  // namespace kiln
