#include "cl/binary_cache.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "base/fnv.h"
#include "cl/private_file.h"

namespace kiln::ocl {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMagic = "kiln binary 1\n";
// maximum size of a cached file in bytes
constexpr std::uint64_t kMaxFileBytes = std::uint64_t{64} << 20U;
constexpr const char* kFileExtension = ".bin";

std::string hex(std::uint64_t number) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(number));
  return text;
}

}  // namespace

BinaryCache::BinaryCache(fs::path folder, std::string driver_text, bool programs)
    : folder_(std::move(folder)), driver_(std::move(driver_text)), keeps_programs_(programs) {}

BinaryCache BinaryCache::of(const DeviceInfo& device, std::string_view platform_version,
                            const fs::path& folder) {
  const auto is = [](const char* name, const char* wanted) {
    const char* value = std::getenv(name);
    return value != nullptr && std::string_view(value) == wanted;
  };
  const bool is_enabled = !is("POCL_KERNEL_CACHE", "0") && !is("KILN_KEEP_BINARIES", "0");
  const bool programs = is("KILN_KEEP_BINARIES", "1");
  std::string driver_text =
      device.name + '\n' + device.driver + '\n' + device.opencl_version + '\n';
  driver_text += platform_version;
  return {is_enabled ? folder : fs::path(), std::move(driver_text),
          programs && device.platform == "Portable Computing Language"};
}

std::string BinaryCache::key(std::string_view source, std::string_view options) const {
  return driver_ + '\n' + std::string(options) + '\n' + std::to_string(source.size()) + ' ' +
         hex(fnv1a(source)) + hex(fnv1a(source, 0x9E3779B97F4A7C15U)) + '\n';
}

fs::path BinaryCache::path_of_file(const std::string& key) const {
  return folder_ / (hex(fnv1a(key)) + kFileExtension);
}

// File format: magic bytes, key, hash of the binary, binary.
std::optional<std::vector<unsigned char>> BinaryCache::find(std::string_view source,
                                                            std::string_view options) const {
  if (folder_.empty()) return std::nullopt;
  const std::string file_key = key(source, options);
  std::error_code file_error;
  const fs::path path = path_of_file(file_key);
  const std::uintmax_t size =
      fs::file_size(path, file_error);  // fails if the path does not name a regular file
  const std::size_t header = kMagic.size() + file_key.size() + 17;
  if (file_error || size <= header || size > kMaxFileBytes) return std::nullopt;
  // Skips files that other users may replace. kernel_folder() has warned about the folder itself.
  if (os::find_unsafe_level(path).filename() == path.filename()) return std::nullopt;
  std::string text(size, '\0');
  std::ifstream in(path, std::ios::binary);
  if (!in.read(text.data(), static_cast<std::streamsize>(size))) return std::nullopt;
  const std::string_view all = text, binary = all.substr(header);
  const std::string expected = std::string(kMagic) + file_key + hex(fnv1a(binary)) + '\n';
  if (all.substr(0, header) != expected) return std::nullopt;
  return std::vector<unsigned char>(binary.begin(), binary.end());
}

void BinaryCache::store(std::string_view source, std::string_view options,
                        const std::vector<unsigned char>& binary) const noexcept {
  if (folder_.empty() || binary.empty() || binary.size() > kMaxFileBytes / 2) return;
  try {
    const std::string file_key = key(source, options);
    const fs::path path = path_of_file(file_key);
    std::error_code file_error;
    std::string text(kMagic);
    const std::string_view binary_bytes(reinterpret_cast<const char*>(binary.data()),
                                        binary.size());
    text += file_key + hex(fnv1a(binary_bytes)) + '\n';
    text += binary_bytes;
    replace_private_file(path, text);
    remove_oldest();
  } catch (const std::exception&) {
    // errors are ignored: without a cached binary, the next run builds the program again
  }
}

void BinaryCache::remove(std::string_view source, std::string_view options) const noexcept {
  if (folder_.empty()) return;
  try {
    std::error_code file_error;
    fs::remove(path_of_file(key(source, options)), file_error);
  } catch (const std::exception&) {
  }
}

/// This also removes incomplete files of killed processes: they are never loaded, so they become the oldest files.
void BinaryCache::remove_oldest() const {
  std::error_code file_error;
  std::vector<std::pair<fs::file_time_type, fs::path>> cached_files;
  for (fs::directory_iterator at(folder_, file_error), end; !file_error && at != end;
       at.increment(file_error)) {
    std::error_code remove_error;
    const fs::file_time_type time = fs::last_write_time(at->path(), remove_error);
    if (!remove_error && at->is_regular_file(remove_error))
      cached_files.emplace_back(time, at->path());
  }
  if (cached_files.size() <= kMaxBinaries) return;
  std::sort(cached_files.begin(), cached_files.end());
  for (std::size_t i = 0; i < cached_files.size() - kMaxBinaries; ++i)
    fs::remove(cached_files[i].second, file_error);
}

}  // namespace kiln::ocl
