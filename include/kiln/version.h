#pragma once

#include "kiln/export.h"

/// Version of these headers. Before 1.0 the API may change with every minor version, and so does the shared
/// library's name (libkiln.so.0.3); patch versions are compatible both ways.
#define KILN_VERSION_MAJOR 0  ///< Changes where programs have to
#define KILN_VERSION_MINOR 3  ///< Changes with new features
#define KILN_VERSION_PATCH 0  ///< Changes with repairs
/// One number to compare, 10000 a major version and 100 a minor one: `#if KILN_VERSION >= 100`.
#define KILN_VERSION (KILN_VERSION_MAJOR * 10000 + KILN_VERSION_MINOR * 100 + KILN_VERSION_PATCH)

namespace KILN_PUBLIC kiln {

/// "MAJOR.MINOR.PATCH" of the library that is linked, which may be newer than these headers. Any thread; the
/// text lives as long as the program.
const char* version() noexcept;

}  // namespace kiln
