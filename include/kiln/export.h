#pragma once

/// \def KILN_PUBLIC
/// Marks `namespace KILN_PUBLIC kiln` in public headers: the shared library exports these
/// declarations and nothing else. A static library exports nothing, so that a plugin that links
/// Kiln statically does not export it. The CMake package and pkg-config define KILN_STATIC for it.
/// \def KILN_HIDDEN
/// Hides the definition of a type that a public class declares but only the library defines.
/// \def KILN_OPAQUE
/// Hides a private type at its declaration in the public class. Clang needs the
/// attribute there; GCC would warn of it.
#if defined(__GNUC__)
#define KILN_HIDDEN __attribute__((visibility("hidden")))
#else
#define KILN_HIDDEN
#endif
#if defined(__clang__)
#define KILN_OPAQUE KILN_HIDDEN
#else
#define KILN_OPAQUE
#endif
#if defined(__GNUC__) && !defined(KILN_STATIC)
#define KILN_PUBLIC [[gnu::visibility("default")]]
#else
#define KILN_PUBLIC
#endif
