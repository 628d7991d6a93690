// Cache of built programs, which later runs load instead of compiling sources.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/device.h"

namespace kiln::ocl {

/// Binaries of programs, one file each.
///
/// The result of the self-test is always stored. For each program that a CPU driver has compiled, a file of one byte
/// records this fact. Programs are stored for PoCL if KILN_KEEP_BINARIES is 1: to create a binary, PoCL compiles each
/// kernel of a program a second time, for work-groups of any size, which doubles the time of a first bake. Other
/// drivers cache programs effectively themselves.
///
/// Files that are incomplete, from another driver, or writable by others are ignored. Files are replaced atomically, so
/// any number of processes may share a folder. Above kMaxBinaries, the oldest files are removed.
class BinaryCache {
 public:
  static constexpr std::size_t kMaxBinaries = 256;

  /// \param folder  empty: disables the cache. Created with the first file, for this user only
  /// \param driver text that identifies everything that binaries depend on except source and options
  /// \param programs  true: binaries of programs are stored, too
  BinaryCache(std::filesystem::path folder, std::string driver, bool programs = true);
  /// Creates the cache of a device. It is disabled if POCL_KERNEL_CACHE or KILN_KEEP_BINARIES is 0. If
  /// KILN_KEEP_BINARIES is 1 and the driver is PoCL, binaries of programs are stored, too; otherwise only test results
  /// and records of compiled programs.
  /// \param folder  KernelFolder::kiln
  static BinaryCache of(const DeviceInfo& device, std::string_view platform_version,
                        const std::filesystem::path& folder);

  std::optional<std::vector<unsigned char>> find(std::string_view source,
                                                 std::string_view options) const;
  /// Stores a binary; does nothing if it cannot be written.
  void store(std::string_view source, std::string_view options,
             const std::vector<unsigned char>& binary) const noexcept;
  /// Removes a binary that the driver rejected.
  void remove(std::string_view source, std::string_view options) const noexcept;
  bool keeps_programs() const { return keeps_programs_ && !folder_.empty(); }

 private:
  std::string key(std::string_view source, std::string_view options) const;
  std::filesystem::path path_of_file(const std::string& key) const;
  void remove_oldest() const;

  std::filesystem::path folder_;
  std::string driver_;
  bool keeps_programs_;
};

}  // namespace kiln::ocl
