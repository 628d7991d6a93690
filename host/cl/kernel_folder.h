// Folder of compiled kernels, which are executable code.
#pragma once

#include <filesystem>
#include <vector>

#include "kiln/error.h"

namespace kiln::ocl {

struct KernelFolder {
  std::filesystem::path kiln;  ///< Folder of Kiln's binaries, next to PoCL's
  /// Warnings if other users may put files into the folder (`kernel-folder`)
  std::vector<Warning> warnings = {};
};

/// Chooses the folders of compiled kernels, Kiln's and PoCL's: POCL_CACHE_DIR, or else `kiln` and `pocl` in
/// XDG_CACHE_HOME or ~/.cache. PoCL executes the files there, so a folder that other users own or may write to would
/// allow them to run code; os::find_unsafe_level() checks every level. If such a level is found in a folder that the
/// user set by a variable, the folder is still used, with a warning. If ~/.cache is needed, but unsafe, missing or not
/// writable, `kiln-USER` in the folder for temporary files replaces it, for this user only; PoCL's own choice without
/// HOME, /tmp/pocl/kcache, may belong to anyone. Relative paths start at the current folder of the first call. The
/// choice is passed to PoCL by POCL_CACHE_DIR in this process's environment, so this must run before PoCL's first call.
///
/// A POCL_CACHE_DIR that this process may not write to is not used directly, since PoCL always writes to its cache:
/// its files are copied to `kiln-USER`, provided that only root or this user may have put them there. So a container
/// image can contain kernels for any user, on a file system that is read-only except for /tmp.
/// \throws Error(device), id `kernel-folder`, if `kiln-USER` belongs to another user or cannot be written to
KernelFolder kernel_folder();

}  // namespace kiln::ocl
