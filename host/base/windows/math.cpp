// Replaces functions of msvcrt.dll, whose results may differ between versions of Windows, by MinGW-w64's long double
// functions, which are linked into the program. The results, rounded to double, equal glibc's for 998 of 1,000
// arguments (host/base/README.md).
#include <math.h>

extern "C" {

double acos(double x) { return static_cast<double>(acosl(x)); }
double asin(double x) { return static_cast<double>(asinl(x)); }
double atan(double x) { return static_cast<double>(atanl(x)); }
double tan(double x) { return static_cast<double>(tanl(x)); }
double log10(double x) { return static_cast<double>(log10l(x)); }
double hypot(double x, double y) { return static_cast<double>(hypotl(x, y)); }

}  // extern "C"
