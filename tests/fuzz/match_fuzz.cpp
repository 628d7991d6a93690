// A saved match, as --load-match reads it.
#include "image_fuzz.h"
#include "io/image/match_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return kiln::test::fuzz_bytes(data, size, [](const kiln::ByteSource& source) {
    const kiln::Match match = kiln::parse_match(source, "input", kiln::test::kFuzzLimits);
    const std::size_t count = std::size_t{match.width} * match.height;
    if (count == 0 || match.samples == 0 || match.width % match.samples != 0 ||
        match.triangle.size() != count || match.status.size() != count) {
      std::abort();
    }
  });
}
