// Basics of every struct that host and kernels share. Compiles as C++ and OpenCL C.
#ifndef KILN_SHARED_COMMON_H
#define KILN_SHARED_COMMON_H

#ifdef __OPENCL_C_VERSION__
typedef int kiln_int;
typedef uint kiln_uint;
typedef float kiln_float;
#else
#include <stdint.h>
typedef int32_t kiln_int;
typedef uint32_t kiln_uint;
typedef float kiln_float;
#endif

/// Fails to compile, in either language, if a shared struct has another size than stated.
#define KILN_CHECK_SIZE(type, bytes) \
  typedef char kiln_size_of_##type##_is_##bytes[sizeof(type) == (bytes) ? 1 : -1]

/// The triangle index of "no triangle".
#define KILN_NO_TRIANGLE 0xFFFFFFFFu

#endif
