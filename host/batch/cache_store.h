// Where results are kept, by keys: a folder, or a server.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace kiln {

/// Bytes by names such as "entries/0f3a...". Each is sealed with a hash: one that was changed, or cut off, is not there.
/// Two writers of one name write the same, or either of two that are both right.
class CacheStore {
 public:
  virtual ~CacheStore() = default;
  /// None: it is not there, or not as it was written.
  std::optional<std::string> get(const std::string& name);
  /// \returns false where it cannot be kept, which is no failure of a run
  bool put(const std::string& name, std::string_view bytes);

 private:
  virtual std::optional<std::string> load(const std::string& name) = 0;
  virtual bool store(const std::string& name, std::string_view bytes) = 0;
};

/// A folder, on a network file system, too: a name appears whole, by renaming.
class FolderStore : public CacheStore {
 public:
  explicit FolderStore(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Removes entries, those that were used least lately first, until they take at most so many bytes.
  void prune(std::uint64_t most_bytes);

 private:
  std::optional<std::string> load(const std::string& name) override;
  bool store(const std::string& name, std::string_view bytes) override;

  std::filesystem::path folder_;
};

}  // namespace kiln
