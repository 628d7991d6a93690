// Files of a cache folder, which later runs reuse.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace kiln {

/// Writes a file of a cache folder. It has no name until it is complete, so a run that is stopped leaves none. Files of
/// the folder that no run has used for 30 days are removed when another one is written.
class CacheFileWriter {
 public:
  /// \param folder  created if it is missing
  /// \param name    the file's name, which ends in one of kCacheFileSuffixes
  /// \throws Error(output) if the folder cannot be written to
  CacheFileWriter(std::filesystem::path folder, std::string name);
  ~CacheFileWriter();
  CacheFileWriter(const CacheFileWriter&) = delete;
  CacheFileWriter& operator=(const CacheFileWriter&) = delete;

  /// \throws Error(output), for example for a full disk
  void write(const void* data, std::size_t bytes);
  std::uint64_t size() const { return size_; }
  /// Opens the incomplete file. \returns a descriptor, which the caller closes \throws Error(output)
  int open_to_read() const;
  /// Gives the file its name; replaces a file of that name. \throws Error(output)
  void commit();

  /// The file's path once it is complete.
  std::filesystem::path path() const { return folder_ / name_; }

 private:
  std::filesystem::path unique_name() const;
  [[noreturn]] void fail(int error) const;

  std::filesystem::path folder_;
  std::string name_;
  std::filesystem::path temporary_;
  int file_ = -1;
  std::uint64_t size_ = 0;
};

/// Ends of the names of files that are removed by age.
inline constexpr const char* kCacheFileSuffixes[] = {".chunks", ".mesh"};

/// Opens a file of a cache folder that belongs to this user, and whose first or last bytes the caller checks. \returns a
/// descriptor; -1 if there is none \param bytes  out: the file's size
int open_cache_file(const std::filesystem::path& path, std::uint64_t& bytes);
/// Marks a file as used now.
void touch_cache_file(const std::filesystem::path& path);

}  // namespace kiln
