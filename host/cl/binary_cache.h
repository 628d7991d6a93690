// Built programs that later runs load in place of their sources.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/device.h"

namespace kiln::ocl {

/// Binaries of programs, a file each.
///
/// PoCL keeps what it compiles, but runs the preprocessor over each source to find it: 25 to 45 ms of a core for
/// each of a bake's eight programs. From a binary it takes 1 to 5. Other drivers find theirs by themselves, so
/// nothing is kept for them.
///
/// A file that is not whole, or of another driver, is as if it were not there. Files are replaced as a whole, so
/// any number of processes may share a folder. The oldest go where there are more than kMostBinaries.
class BinaryCache {
 public:
  static constexpr std::size_t kMostBinaries = 256;

  /// \param folder  empty: nothing is kept or found. Made with the first file
  /// \param driver  all that binaries depend on, besides source and options
  BinaryCache(std::filesystem::path folder, std::string driver);
  /// Cache of a device: `kiln` in POCL_CACHE_DIR, or else in XDG_CACHE_HOME or ~/.cache. Keeps nothing where
  /// POCL_KERNEL_CACHE is 0, or for drivers other than PoCL.
  static BinaryCache of(const DeviceInfo& device, std::string_view platform_version);

  std::optional<std::vector<unsigned char>> find(std::string_view source,
                                                 std::string_view options) const;
  /// Nothing where it cannot be written.
  void keep(std::string_view source, std::string_view options,
            const std::vector<unsigned char>& binary) const noexcept;
  /// Removes what the driver would not load.
  void forget(std::string_view source, std::string_view options) const noexcept;
  bool keeps_any() const { return !folder_.empty(); }

 private:
  std::string key(std::string_view source, std::string_view options) const;
  std::filesystem::path file(const std::string& key) const;
  void remove_oldest() const;

  std::filesystem::path folder_;
  std::string driver_;
};

}  // namespace kiln::ocl
