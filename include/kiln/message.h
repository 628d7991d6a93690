#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// A piece of a message: text; or an option, with the value that it has or should get.
struct MessagePiece {
  std::string text = {};  ///< Literal text of this piece; empty if the piece names an option
  /// Name as for set_option(), "match.max_distance" or "max_distance"; or a function, "unwrap()". Empty: the piece
  /// is text
  std::string option = {};
  std::string value = {};  ///< Value of the option; empty: none is named

  bool operator==(const MessagePiece&) const = default;  ///< True if all members are equal
};

/// A function that spells an option as users of a program know it: option_as_flag() and others in
/// kiln/option_error.h.
using OptionSpelling = std::string (*)(std::string_view option, std::string_view value);

/// A message of one or two sentences that stores options as data, so that each program can spell them as its users
/// know them.
class Message {
 public:
  /// An empty message.
  Message() = default;
  /// A text.
  Message(std::string text);
  /// A text.
  Message(std::string_view text) : Message(std::string(text)) {}
  /// A text.
  Message(const char* text) : Message(std::string(text)) {}
  /// A message that consists of one option. \param name, value  as MessagePiece::option and MessagePiece::value
  static Message option(std::string_view name, std::string_view value = {});

  /// Appends all pieces of another message.
  Message& operator+=(const Message& other);
  /// Concatenates two messages.
  friend Message operator+(Message first, const Message& second) {
    first += second;
    return first;
  }
  bool operator==(const Message&) const = default;  ///< True if all pieces are equal

  /// The message's pieces in order; adjacent texts are merged.
  const std::vector<MessagePiece>& pieces() const { return pieces_; }
  /// True if the message has no pieces.
  bool empty() const { return pieces_.empty(); }
  /// True if a piece is an option.
  bool has_options() const;
  /// The message as text, with options in backticks ("`match.max_distance`") and values after them.
  std::string text() const;
  /// The message as text, with options as a function spells them.
  std::string text(OptionSpelling spelling) const;

 private:
  std::vector<MessagePiece> pieces_;
};

}  // namespace kiln
