#include "kiln/message.h"

#include <algorithm>
#include <utility>

namespace kiln {
namespace {

std::string option_in_backticks(std::string_view option, std::string_view value) {
  std::string text = "`" + std::string(option) + "`";
  if (!value.empty()) text.append(" ").append(value);
  return text;
}

}  // namespace

Message::Message(std::string text) {
  if (!text.empty()) pieces_.push_back({.text = std::move(text)});
}

Message Message::option(std::string_view name, std::string_view value) {
  Message message;
  message.pieces_.push_back({.option = std::string(name), .value = std::string(value)});
  return message;
}

Message& Message::operator+=(const Message& other) {
  if (&other == this) return *this += Message(other);
  for (const MessagePiece& piece : other.pieces_) {
    if (piece.option.empty() && !pieces_.empty() && pieces_.back().option.empty()) {
      pieces_.back().text += piece.text;
    } else {
      pieces_.push_back(piece);
    }
  }
  return *this;
}

bool Message::has_options() const {
  return std::any_of(pieces_.begin(), pieces_.end(),
                     [](const MessagePiece& piece) { return !piece.option.empty(); });
}

std::string Message::text() const { return text(option_in_backticks); }

std::string Message::text(OptionSpelling spelling) const {
  std::string text;
  for (const MessagePiece& piece : pieces_) {
    text += piece.option.empty() ? piece.text : spelling(piece.option, piece.value);
  }
  return text;
}

}  // namespace kiln
