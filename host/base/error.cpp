#include "kiln/error.h"

namespace kiln {

Error::~Error() = default;

std::string_view Error::option() const noexcept {
  const std::string_view message = what();
  const std::size_t open = message.find('`');
  const std::size_t close = open == message.npos ? open : message.find('`', open + 1);
  return close == message.npos ? std::string_view() : message.substr(open + 1, close - open - 1);
}

}  // namespace kiln
