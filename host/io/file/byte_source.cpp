#include "io/file/byte_source.h"

#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "base/file.h"
#include "base/input_log.h"
#include "base/memory.h"
#include "io/file/bounds.h"
#include "io/file/output_set.h"
#include "kiln/error.h"

namespace kiln {
namespace {

class FileSource final : public ByteSource {
 public:
  /// Opens the file before checking it, so that no other file can take its place in between.
  FileSource(const std::filesystem::path& path, FailWith fail) : report_error_(std::move(fail)) {
    register_file_check(path);
    file_ = os::open_to_read(path);
    if (file_ < 0) {
      const int error = errno;
      if (error == ENOENT) report_error_("", "there is no such file", "Check the path.");
      report_error_("", std::string("it cannot be opened: ") + std::strerror(error),
                    "Check the path and its permissions.");
    }
    std::optional<os::FileStatus> file_facts;
    try {
      file_facts = os::query_file(file_);
      if (!file_facts) {
        report_error_("", std::string("it cannot be examined: ") + std::strerror(errno),
                      "Check the disk.");
      }
      if (file_facts->is_folder) report_error_("", "it is a directory", "Name a file in it.");
      if (!file_facts->is_regular) {
        report_error_("", "it is not a regular file", "Copy it to a file first.");
      }
    } catch (...) {
      os::close(file_);
      throw;
    }
    size_ = file_facts->bytes;
    modified_ns_ = file_facts->modified_ns;
    register_input(file_facts->id);
  }
  ~FileSource() override { os::close(file_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  std::uint64_t size() const override { return size_; }
  std::uint64_t size_now() const override {
    const std::optional<os::FileStatus> file_facts = os::query_file(file_);
    return file_facts ? file_facts->bytes : size_;
  }
  bool was_written() const override {
    const std::optional<os::FileStatus> file_facts = os::query_file(file_);
    return file_facts && file_facts->modified_ns != modified_ns_;
  }
  std::size_t read_at(std::uint64_t offset, void* to, std::size_t count) const override {
    if (offset >= size_) return 0;
    count = static_cast<std::size_t>(std::min<std::uint64_t>(count, size_ - offset));
    // If fewer bytes are read without an error, another process has truncated the file.
    const std::size_t have = os::read_fully(file_, offset, to, count);
    if (have < count && errno != 0) {
      report_error_("byte " + std::to_string(offset + have),
                    std::string("it cannot be read: ") + std::strerror(errno), "Check the disk.");
    }
    return have;
  }

 private:
  FailWith report_error_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  std::int64_t modified_ns_ = 0;
};

class MemorySource final : public ByteSource {
 public:
  explicit MemorySource(std::string_view bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  std::size_t read_at(std::uint64_t offset, void* to, std::size_t count) const override {
    if (offset >= bytes_.size()) return 0;
    count = std::min(count, bytes_.size() - static_cast<std::size_t>(offset));
    if (count != 0) std::memcpy(to, bytes_.data() + offset, count);
    return count;
  }

 private:
  std::string_view bytes_;
};

class UncompressedStream final : public ByteStream {
 public:
  UncompressedStream(const ByteSource& source, std::uint64_t offset)
      : source_(source), at_(std::min(offset, source.size())) {}
  std::size_t read(void* to, std::size_t count) override {
    const std::size_t got = source_.read_at(at_, to, count);
    at_ += got;
    return got;
  }
  std::uint64_t max_remaining() const override { return source_.size() - at_; }
  bool is_exact() const override { return true; }

 private:
  const ByteSource& source_;
  std::uint64_t at_;
};

class InflatingStream final : public ByteStream {
 public:
  InflatingStream(const ByteSource& source, std::uint64_t offset, FailWith fail)
      : source_(source), at_(std::min(offset, source.size())), report_error_(std::move(fail)) {
    buffer_.resize(std::size_t{1} << 18);
    // With MAX_WBITS + 32, zlib recognizes gzip and zlib streams by their header.
    if (inflateInit2(&zlib_, MAX_WBITS + 32) != Z_OK) throw std::bad_alloc();
  }
  ~InflatingStream() override { inflateEnd(&zlib_); }
  InflatingStream(const InflatingStream&) = delete;
  InflatingStream& operator=(const InflatingStream&) = delete;

  std::size_t read(void* to, std::size_t count) override {
    std::size_t have = 0;
    while (have < count && !is_stream_ended_) {
      if (zlib_.avail_in == 0) refill();
      const std::size_t part = std::min<std::size_t>(count - have, std::size_t{1} << 30);
      zlib_.next_out = static_cast<Bytef*>(to) + have;
      zlib_.avail_out = static_cast<uInt>(part);
      const int status = inflate(&zlib_, Z_NO_FLUSH);
      have += part - zlib_.avail_out;
      if (status == Z_STREAM_END) {
        is_stream_ended_ = !next_member();
      } else if (status == Z_MEM_ERROR) {
        throw std::bad_alloc();
      } else if (status != Z_OK && !(status == Z_BUF_ERROR && zlib_.avail_in == 0)) {
        report_error_(
            place(),
            std::string("the compressed data are damaged (") +
                (zlib_.msg != nullptr ? zlib_.msg : "zlib's error " + std::to_string(status)) + ")",
            "Copy or export the file again.");
      } else if (zlib_.avail_in == 0 && zlib_.avail_out != 0 && at_ == source_.size()) {
        report_error_(place(), "the compressed data stop before their end (truncated)",
                      "Copy or export the file again.");
      }
    }
    return have;
  }
  std::uint64_t max_remaining() const override {
    if (is_stream_ended_) return 0;
    // zlib itself may hold a part of a byte, and 32 KiB in its window.
    const std::uint64_t left = source_.size() - at_ + zlib_.avail_in + 1;
    return max_unpacked_bytes(Packing::deflate, left + 64);
  }
  bool is_exact() const override { return false; }

 private:
  void refill() {
    const std::size_t got = source_.read_at(at_, buffer_.data(), buffer_.size());
    at_ += got;
    zlib_.next_in = buffer_.data();
    zlib_.avail_in = static_cast<uInt>(got);
  }
  std::string place() const { return "byte " + std::to_string(at_ - zlib_.avail_in); }

  /// A gzip file may consist of several members, which are decompressed one after the other.
  bool next_member() {
    unsigned char magic[2] = {};
    const std::uint64_t next = at_ - zlib_.avail_in;
    if (source_.read_at(next, magic, 2) != 2 || magic[0] != 0x1f || magic[1] != 0x8b) return false;
    if (inflateReset2(&zlib_, MAX_WBITS + 16) != Z_OK) throw std::bad_alloc();
    return true;
  }

  const ByteSource& source_;
  std::uint64_t at_;
  FailWith report_error_;
  std::vector<Bytef> buffer_;
  z_stream zlib_{};
  bool is_stream_ended_ = false;
};

}  // namespace

std::string read_whole(const ByteSource& source, const FailWith& fail) {
  require_memory("its bytes", source.size(), memory_failure(fail, ""));
  std::string bytes(static_cast<std::size_t>(source.size()), '\0');
  const std::size_t got = source.read_at(0, bytes.data(), bytes.size());
  const std::uint64_t now = source.size_now();
  const bool resized = got != bytes.size() || now != source.size();
  if (resized || source.was_written()) {
    fail("",
         "it changed while it was read" +
             (resized ? ": it had " + std::to_string(source.size()) + " bytes, and then " +
                            std::to_string(got != bytes.size() ? got : now)
                      : ""),
         "Wait for the writing program to finish, and read it again.");
  }
  return bytes;
}

std::string ByteSource::head(std::size_t limit) const {
  std::string bytes(static_cast<std::size_t>(std::min<std::uint64_t>(limit, size())), '\0');
  bytes.resize(read_at(0, bytes.data(), bytes.size()));
  return bytes;
}

std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path, FailWith fail) {
  return std::make_unique<FileSource>(path, std::move(fail));
}

std::unique_ptr<ByteSource> bytes_in_memory(std::string_view bytes) {
  return std::make_unique<MemorySource>(bytes);
}

std::unique_ptr<ByteStream> plain_stream(const ByteSource& source, std::uint64_t offset) {
  return std::make_unique<UncompressedStream>(source, offset);
}

std::unique_ptr<ByteStream> inflating_stream(const ByteSource& source, std::uint64_t offset,
                                             FailWith fail) {
  return std::make_unique<InflatingStream>(source, offset, std::move(fail));
}

}  // namespace kiln
