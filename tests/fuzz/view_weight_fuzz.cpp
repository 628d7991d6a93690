// --view-weight FILE: directions of finite length above 0, weights of 0 or more, or kiln::Error.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "job/lists.h"
#include "kiln/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    for (const auto& entry :
         kiln::parse_likelihoods({reinterpret_cast<const char*>(data), size}, "input")) {
      const kiln::Vec3& d = entry.direction;
      const double length = std::hypot(double{d.x}, double{d.y}, double{d.z});
      const bool good = length > 0 && std::isfinite(length) && entry.weight >= 0;
      if (!good || !std::isfinite(entry.weight)) std::abort();
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input) std::abort();
  }
  return 0;
}
