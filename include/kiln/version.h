#pragma once

#include "kiln/export.h"

/// Version of these headers. Before 1.0 the API may change with every minor version, and so does the shared
/// library's name (libkiln.so.0.3); patch versions are compatible both ways.
#define KILN_VERSION_MAJOR 0  ///< Incompatible changes
#define KILN_VERSION_MINOR 3  ///< New features; before 1.0 also incompatible changes
#define KILN_VERSION_PATCH 0  ///< Bug fixes
/// The version as one number, 10000 * major + 100 * minor + patch, for comparisons: `#if KILN_VERSION >= 100`.
#define KILN_VERSION (KILN_VERSION_MAJOR * 10000 + KILN_VERSION_MINOR * 100 + KILN_VERSION_PATCH)

namespace KILN_PUBLIC kiln {

/// "MAJOR.MINOR.PATCH" of the linked library, which may be newer than these headers. Any thread; the text
/// has static lifetime.
const char* version() noexcept;

}  // namespace kiln
