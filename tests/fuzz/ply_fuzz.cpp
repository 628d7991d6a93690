#include "mesh_fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return kiln::test::fuzz_mesh(data, size, kiln::MeshFormat::ply);
}
