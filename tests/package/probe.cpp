// Runs what needs the library's code and its OpenCL dependency, but no device.
#include <kiln/kiln.h>

#include <cstdio>

int main() {
  std::printf("kiln %s, %zu OpenCL devices\n", kiln::version(), kiln::list_devices().size());
}
