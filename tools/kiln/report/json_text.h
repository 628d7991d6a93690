// JSON as text, also where a path in it is no UTF-8.
#pragma once

#include <string>
#include <string_view>

#include "report/json.h"

namespace kiln::cli {

/// Bytes of the UTF-8 character at the start; 0 where there is none (RFC 3629: neither too long a form,
/// nor half of a surrogate, nor beyond U+10FFFF). \param text  not empty
std::size_t utf8_length(std::string_view text);

/// UTF-8 of any bytes, such as a path's: a byte that is no part of UTF-8 becomes \xNN, two hexadecimal
/// digits. So does a backslash before what would read as such (\x5c): whoever puts the byte NN for every
/// \xNN has the bytes back. Other text stays as it is.
std::string escape_bytes(std::string_view bytes);

/// The bytes that escape_bytes was given.
std::string unescape_bytes(std::string_view text);

/// Two blanks a level, and a line's end. Every string and key is escaped as above.
std::string to_text(const Json& json);

}  // namespace kiln::cli
