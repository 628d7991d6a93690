// Declarations of the built-in functions that Kiln's kernels call: a stand-in for Clang's opencl-c.h.
//
// PoCL includes opencl-c.h, 18,000 lines, before each program: parsing the header takes 0.2 processor seconds a
// program, and preprocessing it takes 0.04, which PoCL repeats on each run to look a program up in its cache. So Kiln
// defines that header's include guard, _OPENCL_H_, and puts this file before each source (host/cl/program.cpp).
// Types, as_type() and limits are in opencl-c-base.h, which stays.
//
// A function that is missing here fails to compile, and a source that fails is compiled again with the whole header.
// tests/cl/build_test.cpp checks that all of Kiln's programs compile with the short one, and the lint compiles this
// file together with the whole header, so that no declaration contradicts it.
//
// No kernels. Defines: none. Limits: users' sources (own maps) may call any function, so they get the whole header.
#define BUILTIN __attribute__((overloadable, const))
#define BUILTIN_LOAD __attribute__((overloadable, pure))
#define BUILTIN_STORE __attribute__((overloadable))

// Functions of scalars, and of vectors of N lanes, lane by lane.
#define BUILTIN_INTEGER(T, UNSIGNED, MASK)                                     \
  T BUILTIN min(T, T);                                                         \
  T BUILTIN max(T, T);                                                         \
  T BUILTIN clamp(T, T, T);                                                    \
  UNSIGNED BUILTIN abs(T);                                                     \
  T BUILTIN clz(T);                                                            \
  T BUILTIN popcount(T);                                                       \
  T BUILTIN select(T, T, UNSIGNED);                                            \
  T BUILTIN select(T, T, MASK);
#define BUILTIN_FLOAT(T, UNSIGNED, MASK)                                       \
  T BUILTIN min(T, T);                                                         \
  T BUILTIN max(T, T);                                                         \
  T BUILTIN clamp(T, T, T);                                                    \
  T BUILTIN fabs(T);                                                           \
  T BUILTIN floor(T);                                                          \
  T BUILTIN rint(T);                                                           \
  T BUILTIN round(T);                                                          \
  T BUILTIN sqrt(T);                                                           \
  T BUILTIN fma(T, T, T);                                                      \
  T BUILTIN fmax(T, T);                                                        \
  T BUILTIN copysign(T, T);                                                    \
  T BUILTIN select(T, T, UNSIGNED);                                            \
  T BUILTIN select(T, T, MASK);
#define BUILTIN_CONVERT_TO(T, N)                                               \
  T##N BUILTIN convert_##T##N(char##N);                                        \
  T##N BUILTIN convert_##T##N(uchar##N);                                       \
  T##N BUILTIN convert_##T##N(short##N);                                       \
  T##N BUILTIN convert_##T##N(ushort##N);                                      \
  T##N BUILTIN convert_##T##N(int##N);                                         \
  T##N BUILTIN convert_##T##N(uint##N);                                        \
  T##N BUILTIN convert_##T##N(long##N);                                        \
  T##N BUILTIN convert_##T##N(ulong##N);                                       \
  T##N BUILTIN convert_##T##N(float##N);
#define BUILTINS(N)                                                            \
  BUILTIN_INTEGER(int##N, uint##N, int##N)                                     \
  BUILTIN_INTEGER(uint##N, uint##N, int##N)                                    \
  BUILTIN_INTEGER(long##N, ulong##N, long##N)                                  \
  BUILTIN_INTEGER(ulong##N, ulong##N, long##N)                                 \
  BUILTIN_FLOAT(float##N, uint##N, int##N)                                     \
  BUILTIN_CONVERT_TO(uchar, N)                                                 \
  BUILTIN_CONVERT_TO(short, N)                                                 \
  BUILTIN_CONVERT_TO(ushort, N)                                                \
  BUILTIN_CONVERT_TO(int, N)                                                   \
  BUILTIN_CONVERT_TO(uint, N)                                                  \
  BUILTIN_CONVERT_TO(long, N)                                                  \
  BUILTIN_CONVERT_TO(ulong, N)                                                 \
  BUILTIN_CONVERT_TO(float, N)
BUILTINS()
BUILTINS(4)
BUILTINS(8)
BUILTINS(16)
BUILTIN_FLOAT(float2, uint2, int2)
BUILTIN_FLOAT(float3, uint3, int3)
BUILTIN_CONVERT_TO(float, 3)
int BUILTIN convert_int_sat(float);
int BUILTIN isfinite(float);

// Operations of a vector with a scalar, and reductions over the lanes of a vector.
#define BUILTIN_LANES_OF(T, N)                                                 \
  T##N BUILTIN min(T##N, T);                                                   \
  T##N BUILTIN max(T##N, T);                                                   \
  T##N BUILTIN clamp(T##N, T, T);
#define BUILTIN_LANES(N)                                                       \
  BUILTIN_LANES_OF(int, N)                                                     \
  BUILTIN_LANES_OF(uint, N)                                                    \
  BUILTIN_LANES_OF(long, N)                                                    \
  BUILTIN_LANES_OF(ulong, N)                                                   \
  BUILTIN_LANES_OF(float, N)                                                   \
  int BUILTIN any(int##N);                                                     \
  int BUILTIN all(int##N);
BUILTIN_LANES_OF(float, 3)
BUILTIN_LANES(4)
BUILTIN_LANES(8)
BUILTIN_LANES(16)

// Functions that load vectors from memory and store them.
#define BUILTIN_MEMORY_OF(T, N)                                                \
  T##N BUILTIN_LOAD vload##N(size_t, const constant T*);                       \
  T##N BUILTIN_LOAD vload##N(size_t, const global T*);                         \
  T##N BUILTIN_LOAD vload##N(size_t, const local T*);                          \
  T##N BUILTIN_LOAD vload##N(size_t, const private T*);                        \
  void BUILTIN_STORE vstore##N(T##N, size_t, global T*);                       \
  void BUILTIN_STORE vstore##N(T##N, size_t, local T*);                        \
  void BUILTIN_STORE vstore##N(T##N, size_t, private T*);
#define BUILTIN_MEMORY(T)                                                      \
  BUILTIN_MEMORY_OF(T, 4)                                                      \
  BUILTIN_MEMORY_OF(T, 8)                                                      \
  BUILTIN_MEMORY_OF(T, 16)
BUILTIN_MEMORY(char)
BUILTIN_MEMORY(uchar)
BUILTIN_MEMORY(short)
BUILTIN_MEMORY(ushort)
BUILTIN_MEMORY(int)
BUILTIN_MEMORY(uint)
BUILTIN_MEMORY(ulong)
BUILTIN_MEMORY(float)
BUILTIN_MEMORY_OF(uchar, 3)
BUILTIN_MEMORY_OF(ushort, 3)
BUILTIN_MEMORY_OF(int, 3)
BUILTIN_MEMORY_OF(uint, 3)
BUILTIN_MEMORY_OF(float, 2)
BUILTIN_MEMORY_OF(float, 3)

// Atomic operations.
#define BUILTIN_ATOMIC(T)                                                      \
  T BUILTIN_STORE atomic_inc(volatile global T*);                              \
  T BUILTIN_STORE atomic_min(volatile global T*, T);                           \
  T BUILTIN_STORE atomic_max(volatile global T*, T);
BUILTIN_ATOMIC(int)
BUILTIN_ATOMIC(uint)
#ifdef cl_khr_int64_extended_atomics
#pragma OPENCL EXTENSION cl_khr_int64_extended_atomics : enable
ulong BUILTIN_STORE atom_min(volatile global ulong*, ulong);
#pragma OPENCL EXTENSION cl_khr_int64_extended_atomics : disable
#endif

// Functions of work-items.
size_t BUILTIN get_global_id(uint);
size_t BUILTIN get_local_id(uint);
size_t BUILTIN get_group_id(uint);
