// Formats the names of options for messages.
#pragma once

#include <string_view>

#include "kiln/message.h"

namespace kiln {

/// Makes the part of a message that names an option: see Message::option().
inline Message option(std::string_view name, std::string_view value = {}) {
  return Message::option(name, value);
}

}  // namespace kiln
