#include "batch/cache_store.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <system_error>
#include <tuple>
#include <vector>

#include "base/file.h"
#include "batch/content_hash.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kTrailingHashBytes = 32;
constexpr std::chrono::hours kMinLeftoverAge(
    24);  // Age after which a temporary file counts as abandoned by its writer

}  // namespace

std::optional<std::string> CacheStore::get(const std::string& name) {
  std::optional<std::string> bytes = load(name);
  if (!bytes || bytes->size() < kTrailingHashBytes) return std::nullopt;
  const std::string_view stored_bytes = *bytes;
  const std::string_view content = stored_bytes.substr(0, stored_bytes.size() - kTrailingHashBytes);
  // The hash includes the name, so an entry that was moved to another name is invalid.
  if (content_hash(name + "\n" + content_hash(content)) != stored_bytes.substr(content.size()))
    return std::nullopt;
  bytes->resize(content.size());
  return bytes;
}

bool CacheStore::put(const std::string& name, std::string_view bytes) {
  return store(name, std::string(bytes) + content_hash(name + "\n" + content_hash(bytes)));
}

std::optional<std::string> FolderStore::load(const std::string& name) {
  const fs::path path = folder_ / name;
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return std::nullopt;
  std::string bytes(size, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  fs::last_write_time(
      path, fs::file_time_type::clock::now(),
      // Marks the entry as recently used. In a read-only cache this fails without effect.
      error);
  return bytes;
}

bool FolderStore::store(const std::string& name, std::string_view bytes) {
  static std::atomic<unsigned> number{0};
  const fs::path path = folder_ / name;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  const fs::path written = path.string() + ".tmp-" + os::process_namespace_id() + "-" +
                           std::to_string(os::process_id()) + "-" + std::to_string(number++);
  std::ofstream out(written, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (out && os::replace(written, path)) return true;
  fs::remove(written, error);
  return false;
}

void FolderStore::prune(std::uint64_t max_bytes) {
  std::vector<std::tuple<fs::file_time_type, std::uintmax_t, fs::path>> entries;
  std::uint64_t bytes = 0;
  std::error_code error;
  const auto current_time = fs::file_time_type::clock::now();
  fs::recursive_directory_iterator entry(folder_ / "entries", error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code ignored_error;
    if (!entry->is_regular_file(ignored_error)) continue;
    const auto time = entry->last_write_time(ignored_error);
    const std::uintmax_t size = entry->file_size(ignored_error);
    if (ignored_error) continue;
    const bool unfinished = entry->path().filename().string().find(".tmp-") != std::string::npos;
    if (unfinished && current_time - time < kMinLeftoverAge) continue;
    entries.emplace_back(unfinished ? fs::file_time_type::min() : time, size, entry->path());
    bytes += size;
  }
  std::sort(entries.begin(), entries.end());
  for (const auto& [time, size, path] : entries) {
    if (bytes <= max_bytes && time != fs::file_time_type::min()) break;
    fs::remove(path, error);
    bytes -= size;
  }
}

}  // namespace kiln
