// A PNG or EXR as a high poly.
#include <cstdio>

#include "image_fuzz.h"
#include "kiln/height_field.h"
#include "support/mesh_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return kiln::test::fuzz_bytes(data, size, [](const kiln::ByteSource& source) {
    const kiln::ImageLimits limits{std::uint64_t{1} << 16};
    const kiln::Mesh mesh = kiln::height_field_mesh(kiln::parse_image(source, "input", limits));
    const std::string broken = kiln::test::broken_promise(mesh);
    if (!broken.empty()) {
      std::fprintf(stderr, "%s\n", broken.c_str());
      std::abort();
    }
  });
}
