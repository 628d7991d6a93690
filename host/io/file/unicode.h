// Text files of whatever Unicode encoding as UTF-8.
#pragma once

#include <string>
#include <string_view>

namespace kiln {

/// The text behind a byte-order mark: UTF-8 as it is, UTF-16 of either byte order converted. Without a mark, the
/// bytes as they are. Halves of surrogate pairs become U+FFFD. Memory is at most 1.5 times the bytes.
/// \param storage  holds what was converted, and must outlive the result
std::string_view as_utf8(std::string_view bytes, std::string& storage);

}  // namespace kiln
