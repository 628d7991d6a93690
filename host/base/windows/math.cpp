// Replaces functions of msvcrt.dll, whose results may differ between versions of Windows, by MinGW-w64's long double
// functions, which are linked into the program. The results, rounded to double, equal glibc's for 998 of 1,000
// arguments (host/base/README.md). Sine and cosine are replaced because the processor's instructions reduce arguments by
// a pi of 66 bits, which leaves few correct digits near their zeros.
#include <math.h>

namespace {

struct Reduced {
  long double angle;  ///< At most an eighth of a turn
  unsigned quarters;  ///< Quarters of a turn that were taken off
};

/// Takes quarters of a turn off by a pi / 2 of 144 bits, in three parts. The first two have 41 and 40 bits, so that
/// products with counts below 2^23 are exact.
Reduced reduced(double x) {
  constexpr long double kHigh = 0x1.921fb54442p0L, kMiddle = 0x0.d18469898cp-40L,
                        kLow = 0x0.c51701b839a25204p-80L,
                        kQuartersPerUnit = 0xa.2f9836e4e44152ap-4L;
  const long double count = roundl(x * kQuartersPerUnit);
  return {((x - count * kHigh) - count * kMiddle) - count * kLow,
          static_cast<unsigned>(static_cast<long long>(count)) & 3U};
}

/// The sine of an angle and quarters of a turn.
double sine(const Reduced& of) {
  const long double size = (of.quarters & 1U) != 0 ? cosl(of.angle) : sinl(of.angle);
  return static_cast<double>((of.quarters & 2U) != 0 ? -size : size);
}

constexpr double kMaxReduced = 1e7;  // 2^23 quarters of a turn are 1.3e7

}  // namespace

extern "C" {

double acos(double x) { return static_cast<double>(acosl(x)); }
double asin(double x) { return static_cast<double>(asinl(x)); }
double atan(double x) { return static_cast<double>(atanl(x)); }
double sin(double x) {
  return fabs(x) < kMaxReduced ? sine(reduced(x)) : static_cast<double>(sinl(x));
}
double cos(double x) {
  if (!(fabs(x) < kMaxReduced)) return static_cast<double>(cosl(x));
  Reduced of = reduced(x);
  ++of.quarters;
  return sine(of);
}
// GCC's own word for both of one angle.
void sincos(double x, double* s, double* c) {
  *s = sin(x);
  *c = cos(x);
}
double tan(double x) { return static_cast<double>(tanl(x)); }
double log10(double x) { return static_cast<double>(log10l(x)); }
double hypot(double x, double y) { return static_cast<double>(hypotl(x, y)); }

}  // extern "C"
