#include "image_fuzz.h"
#include "io/image/picture.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return kiln::test::fuzz_bytes(data, size, [](const kiln::ByteSource& source) {
    const bool is_dds = kiln::is_dds(source.head(4));
    kiln::test::check_image(is_dds ? kiln::parse_dds(source, "input", kiln::test::kFuzzLimits)
                                   : kiln::parse_ktx2(source, "input", kiln::test::kFuzzLimits));
  });
}
