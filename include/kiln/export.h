#pragma once

/// \def KILN_PUBLIC
/// Stands in `namespace KILN_PUBLIC kiln` in public headers: the shared library
/// exports these declarations and nothing else. A static library exports nothing, so that a plugin
/// that carries Kiln does not show it. The CMake package and pkg-config define KILN_STATIC for it.
/// \def KILN_HIDDEN
/// Stands in the definition of a type that a public class declares and the library keeps to itself.
/// \def KILN_OPAQUE
/// Stands where the public class declares it. Clang wants to know there; GCC warns of it there.
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
