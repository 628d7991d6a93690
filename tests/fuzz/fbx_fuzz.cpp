// FBX, text or binary.
#include "asset/fbx.h"
#include "mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const kiln::MeshInput input{"input.fbx", {reinterpret_cast<const char*>(data), size}};
  try {
    const std::string broken = kiln::test::broken_promise(kiln::read_fbx(input).mesh);
    if (!broken.empty()) {
      std::fprintf(stderr, "%s\n", broken.c_str());
      std::abort();
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}
