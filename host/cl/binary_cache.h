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
/// no programs are kept for them: only that they passed the self-test.
///
/// A file that is not whole, of another driver, or that others may write to is as if it were not there. Files are replaced as a whole, so
/// any number of processes may share a folder. The oldest go where there are more than kMostBinaries.
class BinaryCache {
 public:
  static constexpr std::size_t kMostBinaries = 256;

  /// \param folder  empty: nothing is kept or found. Made with the first file, for this user alone
  /// \param driver  all that binaries depend on, besides source and options
  /// \param programs  programs are kept, too
  BinaryCache(std::filesystem::path folder, std::string driver, bool programs = true);
  /// Cache of a device. Keeps nothing where POCL_KERNEL_CACHE or KILN_KEEP_BINARIES is 0, and programs for PoCL alone.
  /// \param folder  KernelFolder::kiln
  static BinaryCache of(const DeviceInfo& device, std::string_view platform_version,
                        const std::filesystem::path& folder);

  std::optional<std::vector<unsigned char>> find(std::string_view source,
                                                 std::string_view options) const;
  /// Nothing where it cannot be written.
  void keep(std::string_view source, std::string_view options,
            const std::vector<unsigned char>& binary) const noexcept;
  /// Removes what the driver would not load.
  void forget(std::string_view source, std::string_view options) const noexcept;
  bool keeps_programs() const { return programs_ && !folder_.empty(); }

 private:
  std::string key(std::string_view source, std::string_view options) const;
  std::filesystem::path file(const std::string& key) const;
  void remove_oldest() const;

  std::filesystem::path folder_;
  std::string driver_;
  bool programs_;
};

}  // namespace kiln::ocl
