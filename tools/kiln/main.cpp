#include <cstdio>

#include "kiln/kiln.h"

int main() {
  for (const kiln::DeviceInfo& info : kiln::list_devices()) std::printf("%s\n", info.name.c_str());
  return 0;
}
