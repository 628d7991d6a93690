// Binary or text: the content says which. Files beside it are none of a fuzzer's business.
#include "asset/gltf.h"
#include "mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const kiln::MeshInput input{"input", {reinterpret_cast<const char*>(data), size}};
    kiln::read_gltf_materials(input);
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return kiln::test::fuzz_mesh(data, size, kiln::MeshFormat::gltf);
}
