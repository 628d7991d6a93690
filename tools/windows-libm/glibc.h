// What sources of glibc's libm take from glibc's private headers, for MinGW-w64: tools/windows-libraries includes it before
// each of them. Rounding is to nearest, always, so that nothing sets it.
#pragma once

#include <errno.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#define LITTLE_ENDI 1
#define HIGH_HALF 1
#define LOW_HALF 0

#define attribute_hidden
#define __always_inline inline __attribute__((always_inline))
#define __glibc_likely(condition) __builtin_expect((condition), 1)
#define __glibc_unlikely(condition) __builtin_expect((condition), 0)
#define __set_errno(number) (errno = (number))

// Names that only libm.so has.
#define strong_alias(function, name)
#define libm_alias_finite(function, name)
#define libm_alias_double(function, name)
#define libm_alias_double_other(function, name)
#define libm_alias_float(function, name)
#define libm_alias_float_other(function, name)
#define versioned_symbol(library, function, name, version)
#define LIBM_SVID_COMPAT 0

#define SET_RESTORE_ROUND(mode)
#define SET_RESTORE_ROUND_53BIT(mode)

// Floating-point exceptions are not read.
#define math_narrow_eval(value) (value)
#define math_force_eval(value) ((void)(value))
#define math_check_force_underflow(value) ((void)(value))
#define math_check_force_underflow_nonneg(value) ((void)(value))
#define math_opt_barrier(value)       \
  ({                                  \
    __typeof(value) hidden = (value); \
    __asm__("" : "+x"(hidden));       \
    hidden;                           \
  })

#define FIX_INT_FP_CONVERT_ZERO 0
#define HIGH_ORDER_BIT_IS_SET_FOR_SNAN 0
#define USE_FMAX_BUILTIN 0
#define USE_FMIN_BUILTIN 0

#define EXTRACT_WORDS64(to, from) memcpy(&(to), &(from), sizeof(double))
#define INSERT_WORDS64(to, from) memcpy(&(to), &(from), sizeof(double))
