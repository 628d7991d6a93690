// Runs what needs the library's code and its OpenCL dependency, but no device; and catches what it throws.
#include <kiln/kiln.h>

#include <cstdio>
#include <cstring>

static_assert(KILN_VERSION >= 100);

int main() {
  try {
    kiln::validate(kiln::BakeOptions{.width = 0});
  } catch (const kiln::Error& error) {
    if (std::strcmp(error.id(), "option-range") != 0) return 1;
    std::printf("kiln %s, %zu OpenCL devices\n", kiln::version(), kiln::list_devices().size());
    return 0;
  }
  return 2;
}
