#include "arguments/unwrap_option.h"

#include <algorithm>

#include "kiln/error.h"
#include "kiln/unwrap.h"

namespace kiln::cli {

UnwrapOptions unwrap_options(const std::string& method, std::uint32_t size, const Mesh* high) {
  UnwrapOptions options;
  options.size = std::clamp(size, 16U, 65536U);
  options.method = method == "pairs"     ? UnwrapMethod::pairs
                   : method == "squares" ? UnwrapMethod::squares
                                         : UnwrapMethod::charts;
  if (options.method == UnwrapMethod::charts)
    options.border_texels = std::max(2U, options.size / 256);
  options.detail_of = high;
  return options;
}

void check_density(bool given, const std::string& method) {
  if (!given || (method != "pairs" && method != "squares")) return;
  throw Error(ErrorCode::usage, "--density is for large charts, but --unwrap " + method +
                                    " makes others: leave it out, or unwrap by charts.");
}

}  // namespace kiln::cli
