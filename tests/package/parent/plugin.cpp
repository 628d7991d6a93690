// Throws and catches across libraries, and asks for a file format that is not there.
#include <kiln/kiln.h>

#include <cstring>

extern "C" [[gnu::visibility("default")]] int plugin_check() {
  try {
    kiln::load_mesh("high.ply");
  } catch (const kiln::Error& error) {
    return std::strcmp(error.id(), "no-files") == 0 ? 0 : 1;
  }
  return 2;
}
