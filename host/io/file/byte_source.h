// Bytes to read from, of a file or of memory, packed or not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace kiln {

/// A reader's error for what it cannot use: throws Error(input) "<file>: <place>: <problem>. <remedy>"
/// with the file that it was made for. The place may be empty.
using FailWith = std::function<void(const std::string& place, const std::string& problem,
                                    const std::string& remedy)>;

/// Bytes at known places: the whole of a file.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// The same as it is now: another process may have written to the file since it was opened.
  virtual std::uint64_t size_now() const { return size(); }
  /// True if another process wrote to the file since it was opened, whatever size it has now.
  virtual bool was_written() const { return false; }
  /// Up to `count` bytes from `offset`; fewer only at the end.
  virtual std::size_t read_at(std::uint64_t offset, void* to, std::size_t count) const = 0;

  /// The first bytes, at most `limit`.
  std::string head(std::size_t limit) const;
};

/// A regular file. `fail` must throw; it is called for a file that cannot be opened or read, and kept.
/// \throws what `fail` throws
std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path, FailWith fail);

/// The whole file. \throws what `fail` throws: where memory is short, or another process wrote to the file meanwhile
std::string read_whole(const ByteSource& source, const FailWith& fail);

/// `bytes` must outlive the source.
std::unique_ptr<ByteSource> bytes_in_memory(std::string_view bytes);

/// Bytes one after the other.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Up to `count` bytes; fewer only at the end.
  virtual std::size_t read(void* to, std::size_t count) = 0;
  /// No more bytes than this can come. Exact where `exact`.
  virtual std::uint64_t at_most() const = 0;
  virtual bool exact() const = 0;
};

/// The source's bytes from `offset` as they are. The source must outlive the stream.
std::unique_ptr<ByteStream> plain_stream(const ByteSource& source, std::uint64_t offset);

/// Unpacked bytes of the gzip members or the zlib stream from `offset`, ending where they end; other bytes
/// after them are left. A stream that is cut short or damaged calls `fail`, which must throw.
std::unique_ptr<ByteStream> inflating_stream(const ByteSource& source, std::uint64_t offset,
                                             FailWith fail);

}  // namespace kiln
