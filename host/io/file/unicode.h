// Conversion of Unicode text files to UTF-8.
#pragma once

#include <string>
#include <string_view>

namespace kiln {

/// The text after a byte-order mark: UTF-8 unchanged, UTF-16 of either byte order converted. Without a mark, the
/// bytes unchanged. Unpaired surrogates become U+FFFD. Memory is at most 1.5 times the bytes.
/// \param storage  holds converted text, and must outlive the result
std::string_view as_utf8(std::string_view bytes, std::string& storage);

}  // namespace kiln
