#include "arguments/unwrap_option.h"

#include <algorithm>

namespace kiln::cli {

UnwrapOptions unwrap_options(const std::string& method, std::uint32_t size) {
  UnwrapOptions options;
  options.size = std::clamp(size, 16U, 65536U);
  options.method = method == "pairs" ? UnwrapMethod::pairs : UnwrapMethod::charts;
  if (method != "pairs") options.border_texels = std::max(2U, options.size / 256);
  return options;
}

}  // namespace kiln::cli
