#include "kiln/error.h"

namespace kiln {
namespace {

const char* name_of(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::usage:
      return "usage";
    case ErrorCode::input:
      return "input";
    case ErrorCode::device:
      return "device";
    case ErrorCode::output:
      return "output";
    case ErrorCode::cancelled:
      return "cancelled";
    case ErrorCode::internal:
      break;
  }
  return "internal";
}

}  // namespace

Error::Error(ErrorCode code, const Message& message, const char* id)
    : Error(code, message, message.text(), id) {}

Error::Error(ErrorCode code, const Message& message, const std::string& what, const char* id)
    : std::runtime_error(what), code_(code), id_(id != nullptr ? id : name_of(code)) {
  if (message.has_options()) message_ = std::make_shared<const Message>(message);
}

Error::~Error() = default;

Message Error::message() const { return message_ != nullptr ? *message_ : Message(what()); }

std::string_view Error::option() const noexcept {
  if (message_ == nullptr) return {};
  for (const MessagePiece& piece : message_->pieces()) {
    if (!piece.option.empty()) return piece.option;
  }
  return {};
}

}  // namespace kiln
