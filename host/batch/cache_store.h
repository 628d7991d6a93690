// Stores results by name, in a folder or on a server.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace kiln {

/// Stores bytes under names such as "entries/0f3a...". A hash of name and bytes detects changes and truncation; damaged
/// entries count as missing. Concurrent writers of one name are safe: all values of a name are equally valid.
class CacheStore {
 public:
  virtual ~CacheStore() = default;
  /// Returns the bytes of an entry; nullopt if it is missing or damaged.
  std::optional<std::string> get(const std::string& name);
  /// Stores an entry. \returns false if it could not be stored; runs continue without it
  bool put(const std::string& name, std::string_view bytes);

 private:
  virtual std::optional<std::string> load(const std::string& name) = 0;
  virtual bool store(const std::string& name, std::string_view bytes) = 0;
};

/// Stores entries in a folder, which may be on a network file system. Each entry is written to a temporary file, which
/// is then renamed, so that readers never see a part of an entry.
class FolderStore : public CacheStore {
 public:
  explicit FolderStore(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Removes the least recently used entries until the remaining ones have at most `max_bytes`.
  void prune(std::uint64_t max_bytes);

 private:
  std::optional<std::string> load(const std::string& name) override;
  bool store(const std::string& name, std::string_view bytes) override;

  std::filesystem::path folder_;
};

}  // namespace kiln
