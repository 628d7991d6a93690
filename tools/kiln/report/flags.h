// The library's messages name its own parameters; people at the command line know flags.
#pragma once

#include <string>
#include <string_view>

namespace kiln::cli {

/// A message of the library with the flag for each parameter that it names: "raise max_distance" becomes
/// "raise --max-distance". Names in quotes and in paths stay as they are.
std::string with_flags(std::string_view message);

}  // namespace kiln::cli
