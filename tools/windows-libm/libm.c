// Functions of glibc's libm that Kiln's results depend on, under C's names, for MinGW-w64. Like libm.so, they take the code
// for FMA instructions on processors that have them and AVX2: its results differ in the last place.
#define BOTH_1(name)            \
  double name##_sse2(double x); \
  double name##_fma(double x);  \
  double name(double x) { return has_fma() ? name##_fma(x) : name##_sse2(x); }
#define BOTH_2(name)                      \
  double name##_sse2(double x, double y); \
  double name##_fma(double x, double y);  \
  double name(double x, double y) { return has_fma() ? name##_fma(x, y) : name##_sse2(x, y); }
#define ONE_1(name)             \
  double name##_sse2(double x); \
  double name(double x) { return name##_sse2(x); }
#define ONE_2(name)                       \
  double name##_sse2(double x, double y); \
  double name(double x, double y) { return name##_sse2(x, y); }

static int has_fma(void) { return __builtin_cpu_supports("fma") && __builtin_cpu_supports("avx2"); }

BOTH_1(acos)
BOTH_1(asin)
BOTH_1(atan)
BOTH_1(cos)
BOTH_1(exp)
BOTH_1(log)
BOTH_1(log2)
BOTH_1(sin)
BOTH_1(tan)
BOTH_2(atan2)
BOTH_2(pow)
// libm.so has these once.
ONE_1(exp2)
ONE_1(log10)
ONE_2(hypot)

// MinGW-w64's rounds twice, to an extended double first. Compilers emit the instruction themselves where they optimise.
double sqrt(double x) {
  double root;
  __asm__("sqrtsd %1, %0" : "=x"(root) : "x"(x));
  return root;
}

// GCC's own word for both of one angle.
void sincos(double x, double* s, double* c) {
  *s = sin(x);
  *c = cos(x);
}
