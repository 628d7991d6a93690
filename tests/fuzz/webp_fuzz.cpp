#include "image_fuzz.h"
#include "io/image/picture.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return kiln::test::fuzz_bytes(data, size, [](const kiln::ByteSource& source) {
    kiln::test::check_image(kiln::parse_webp(source, "input", kiln::test::kFuzzLimits));
  });
}
