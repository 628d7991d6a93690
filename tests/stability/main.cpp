// stability_survey: prints the tables of tests/stability/README.md.
#include <cstdio>

#include "kiln/device.h"
#include "stability/survey.h"

int main() {
  try {
    const kiln::Device device = kiln::Device::open();
    std::fputs(kiln::test::Survey(device).tables().c_str(), stdout);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "stability_survey: %s\n", error.what());
    return 1;
  }
}
