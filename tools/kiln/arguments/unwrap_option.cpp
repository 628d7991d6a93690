#include "arguments/unwrap_option.h"

#include <algorithm>

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

Option* add_density_option(Command& command, std::string& density, const char* high) {
  return command
      .add_option(
          "--density", density,
          std::string("Of large charts that Kiln lays out: texels by area, or more where ") + high +
              " has more detail")
      ->check(one_of(kDensities))
      ->capture_default_str();
}

void check_density(bool given, const std::string& method) {
  if (!given || (method != "pairs" && method != "squares")) return;
  throw Error(ErrorCode::usage, "--density is for large charts, but --unwrap " + method +
                                    " makes others: leave it out, or unwrap by charts.");
}

}  // namespace kiln::cli
