// The folder of compiled kernels, which are code that runs here.
#pragma once

#include <filesystem>
#include <vector>

#include "kiln/error.h"

namespace kiln::ocl {

struct KernelFolder {
  std::filesystem::path kiln;          ///< Kiln's own binaries; PoCL's lie beside
  std::vector<Warning> warnings = {};  ///< That somebody else may put files there (`kernel-folder`)
};

/// Folder of compiled kernels, Kiln's and PoCL's: POCL_CACHE_DIR, or else `kiln` and `pocl` in XDG_CACHE_HOME or
/// ~/.cache. PoCL loads what lies there as code. A folder that other users own or may write to would let them run
/// theirs: os::shared_level() looks at every level. One that the user named by a variable is used with a warning,
/// ~/.cache is not. In its place, and where it is missing or cannot be written, stands `kiln-USER` in the folder for
/// temporary files, for this user alone; PoCL's own choice without HOME is /tmp/pocl/kcache, whoever made it. PoCL is
/// told by POCL_CACHE_DIR in the environment of this process, so this comes before its first call.
/// \throws Error(device), id `kernel-folder`, where `kiln-USER` is another's
KernelFolder kernel_folder();

}  // namespace kiln::ocl
