#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// A part of a message: a text; or an option with the value that it has or should get.
struct MessagePiece {
  std::string text = {};  ///< Empty: the piece is an option
  /// As set_option() takes it, "match.max_distance", "max_distance"; or a function, "unwrap()". Empty:
  /// the piece is a text
  std::string option = {};
  std::string value = {};  ///< Of the option; empty: none is named

  bool operator==(const MessagePiece&) const = default;  ///< All members
};

/// How a reader knows an option: option_as_flag() and its like in kiln/option_error.h.
using OptionSpelling = std::string (*)(std::string_view option, std::string_view value);

/// A sentence or two in which options are data, so that each program spells them as its users know them.
class Message {
 public:
  /// Nothing.
  Message() = default;
  /// A text.
  Message(std::string text);
  /// A text.
  Message(std::string_view text) : Message(std::string(text)) {}
  /// A text.
  Message(const char* text) : Message(std::string(text)) {}
  /// An option. \param name, value  as MessagePiece has them
  static Message option(std::string_view name, std::string_view value = {});

  /// Appends all pieces of another one.
  Message& operator+=(const Message& other);
  /// One after the other.
  friend Message operator+(Message first, const Message& second) {
    first += second;
    return first;
  }
  bool operator==(const Message&) const = default;  ///< The same pieces

  /// In their order; no two texts follow each other.
  const std::vector<MessagePiece>& pieces() const { return pieces_; }
  /// True if there is nothing in it.
  bool empty() const { return pieces_.empty(); }
  /// True if an option is in it.
  bool names_options() const;
  /// With options as "`match.max_distance`", and values after them.
  std::string text() const;
  /// With options as a function spells them.
  std::string text(OptionSpelling spelling) const;

 private:
  std::vector<MessagePiece> pieces_;
};

}  // namespace kiln
