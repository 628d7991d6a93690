// Functions of the C library that msvcrt.dll has, and so may differ between versions of Windows: from MinGW-w64's own of
// long double, which the program contains. The double nearest to these is glibc's in 998 of 1,000 arguments
// (host/base/README.md).
#include <math.h>

extern "C" {

double acos(double x) { return static_cast<double>(acosl(x)); }
double asin(double x) { return static_cast<double>(asinl(x)); }
double atan(double x) { return static_cast<double>(atanl(x)); }
double tan(double x) { return static_cast<double>(tanl(x)); }
double log10(double x) { return static_cast<double>(log10l(x)); }
double hypot(double x, double y) { return static_cast<double>(hypotl(x, y)); }

}  // extern "C"
