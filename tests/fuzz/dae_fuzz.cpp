// Collada through Assimp, which a child process tries first.
#include "asset/assimp.h"
#include "mesh_fuzz.h"

/// Assimp leaks parts of what it has read; what is looked for here is worse.
extern "C" int __lsan_is_turned_off() { return 1; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const kiln::MeshInput input{"input.dae", {reinterpret_cast<const char*>(data), size}};
  try {
    const std::string broken = kiln::test::broken_promise(kiln::read_by_assimp(input).mesh);
    if (!broken.empty()) {
      std::fprintf(stderr, "%s\n", broken.c_str());
      std::abort();
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}
