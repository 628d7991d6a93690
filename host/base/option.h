// Options in messages.
#pragma once

#include <string_view>

#include "kiln/message.h"

namespace kiln {

/// An option in a message: see Message::option().
inline Message option(std::string_view name, std::string_view value = {}) {
  return Message::option(name, value);
}

}  // namespace kiln
