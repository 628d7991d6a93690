// Readers of bytes from a file or from memory, compressed or not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "kiln/message.h"

namespace kiln {

/// Reports a reader's error: throws Error(input) "<file>: <place>: <problem>. <remedy>" for its file.
/// The place may be empty.
using FailWith = std::function<void(const std::string& place, const std::string& problem,
                                    const Message& remedy)>;

/// A sequence of bytes with random access, such as a file.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual std::uint64_t size() const = 0;
  /// The present size, which differs from size() if another process has changed the file since it
  /// was opened.
  virtual std::uint64_t size_now() const { return size(); }
  /// True if another process has written to the file since it was opened, even if the size is the same.
  virtual bool was_written() const { return false; }
  /// Reads up to `count` bytes from `offset` on. Returns fewer only at the end.
  virtual std::size_t read_at(std::uint64_t offset, void* to, std::size_t count) const = 0;

  /// The source's first bytes, at most `limit`.
  std::string head(std::size_t limit) const;
};

/// Opens a regular file. `fail` is kept and called if the file cannot be opened or read; it must
/// throw.
/// \throws what `fail` throws
std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path, FailWith fail);

/// Reads a whole file.
/// \throws what `fail` throws if memory is insufficient, or if another process writes to the file
///   in the meantime
std::string read_whole(const ByteSource& source, const FailWith& fail);

/// Bytes in memory, which must outlive the source.
std::unique_ptr<ByteSource> bytes_in_memory(std::string_view bytes);

/// A sequential stream of bytes.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  /// Reads up to `count` bytes. Returns fewer only at the end.
  virtual std::size_t read(void* to, std::size_t count) = 0;
  /// Upper bound of the number of remaining bytes; if is_exact() is true, the number itself.
  virtual std::uint64_t max_remaining() const = 0;
  virtual bool is_exact() const = 0;
};

/// The bytes of a source from `offset` on, unchanged. The source must outlive the stream.
std::unique_ptr<ByteStream> plain_stream(const ByteSource& source, std::uint64_t offset);

/// The decompressed bytes of the gzip members, or of the zlib stream, at `offset`. Bytes after them
/// are ignored. Calls `fail`, which must throw, if the data is truncated or damaged.
std::unique_ptr<ByteStream> inflating_stream(const ByteSource& source, std::uint64_t offset,
                                             FailWith fail);

}  // namespace kiln
