// The library's messages name its own options; people at the command line know flags.
#pragma once

#include <string>
#include <string_view>

namespace kiln {

struct OptionRow;

/// True if a row's members, "bake.width, bake.height", have one of this name, with or without "bake." before it.
bool has_member(const OptionRow& row, std::string_view name);

/// A message of the library with the flag for each option that it names (Error::option()): "raise
/// `match.max_distance`" becomes "raise --max-distance", by the rows of bake_rows(), or else by the name itself.
std::string with_flags(std::string_view message);

}  // namespace kiln
