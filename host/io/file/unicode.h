// Conversion of Unicode text files to UTF-8.
#pragma once

#include <string>
#include <string_view>

namespace kiln {

/// The text in UTF-8, without its byte-order mark. UTF-16 of both byte orders is converted; UTF-8, and bytes without
/// a mark, are unchanged. Unpaired surrogates become U+FFFD. Memory is at most 1.5 times the bytes.
/// \param storage  holds converted text, and must outlive the result
std::string_view as_utf8(std::string_view bytes, std::string& storage);

}  // namespace kiln
