// OptionError: errors that name options. Builds without file formats include this file, too.
#include "kiln/option_error.h"

#include <utility>

namespace kiln {

OptionError::OptionError(const Message& message, ErrorCode code, const char* id)
    : Error(code, message, message.text(option_as_member), id),
      data_(std::make_shared<const Data>()) {}

OptionError::OptionError(const OptionError& error, std::string value, std::string allowed)
    : Error(error),
      data_(std::make_shared<const Data>(Data{std::move(value), std::move(allowed)})) {}

OptionError::~OptionError() = default;

std::vector<MessagePiece> remedies_of(const Message& message) {
  std::vector<MessagePiece> options;
  for (const MessagePiece& piece : message.pieces()) {
    if (!piece.option.empty()) options.push_back(piece);
  }
  if (!options.empty()) options.erase(options.begin());
  return options;
}

}  // namespace kiln
