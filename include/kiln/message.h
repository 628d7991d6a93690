/// \file
/// Errors about options, as data: which option, its value, what is allowed, and what to do. Programs that have names of
/// their own for options spell the message anew; what() has the members of a Job.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// A part of a message: a text; or an option by its name ("max_distance", as set_option() takes it), with the value that
/// it has or should get.
struct MessagePiece {
  std::string text = {};    ///< Empty: the piece is an option
  std::string option = {};  ///< Empty: the piece is a text
  std::string value = {};   ///< Of the option; empty: none is named
};

/// How a reader knows an option: "--max-distance 2%" at the command line, `max_distance="2%"` in Python.
using OptionSpelling = std::function<std::string(std::string_view option, std::string_view value)>;

/// A sentence or two as a list of pieces.
class Message {
 public:
  /// Nothing.
  Message() = default;
  /// A text.
  Message(std::string text) { add({std::move(text), {}, {}}); }
  /// A text.
  Message(std::string_view text) : Message(std::string(text)) {}
  /// A text.
  Message(const char* text) : Message(std::string(text)) {}

  /// Appends all pieces of another one.
  Message& operator+=(const Message& other) {
    for (const MessagePiece& piece : other.pieces_) add(piece);
    return *this;
  }
  /// One after the other.
  friend Message operator+(Message first, const Message& second) {
    first += second;
    return first;
  }

  /// In their order; no two texts follow each other.
  const std::vector<MessagePiece>& pieces() const { return pieces_; }
  /// True if there is nothing in it.
  bool empty() const { return pieces_.empty(); }
  /// With options as members of a Job: "job.bake.match.max_distance = 2%".
  std::string text() const;
  /// With options as a function spells them.
  std::string text(const OptionSpelling& spelling) const;

  /// An option in a message. \param name  as set_option() takes it: "max_distance" \param value  empty: none
  static Message option(std::string_view name, std::string_view value = {}) {
    Message message;
    message.pieces_.push_back({{}, std::string(name), std::string(value)});
    return message;
  }

 private:
  void add(MessagePiece piece) {
    if (piece.option.empty() && piece.text.empty()) return;
    if (piece.option.empty() && !pieces_.empty() && pieces_.back().option.empty()) {
      pieces_.back().text += piece.text;
    } else {
      pieces_.push_back(std::move(piece));
    }
  }

  std::vector<MessagePiece> pieces_;
};

/// An error about options of a job. Copies share the data.
class OptionError : public Error {
 public:
  /// The message, from which the option and the remedies follow.
  explicit OptionError(const Message& message, ErrorCode code = ErrorCode::usage,
                       const char* id = nullptr);
  /// One about a value that an option cannot have. \param allowed  "1 to 16", "{exr,png16}"
  OptionError(const OptionError& error, std::string value, std::string allowed);
  OptionError(const OptionError&) = default;             ///< Does not throw
  OptionError& operator=(const OptionError&) = default;  ///< Does not throw
  ~OptionError() override;                               ///< In the library

  /// All that it says.
  const Message& message() const noexcept { return data_->message; }
  /// The option that it is about: the first that the message names. As set_option() takes it.
  const std::string& name() const noexcept { return data_->name; }
  /// The value that the option was given; empty: it is not about a value.
  const std::string& value() const noexcept { return data_->value; }
  /// Values that the option takes, as help has them; empty: it is not about a value.
  const std::string& allowed() const noexcept { return data_->allowed; }
  /// Other options that the message names, in order, with values that they could get: what to change.
  const std::vector<MessagePiece>& remedies() const noexcept { return data_->remedies; }

 private:
  struct Data {
    Message message;
    std::string name, value, allowed;
    std::vector<MessagePiece> remedies;
  };
  std::shared_ptr<const Data> data_;
};

/// What an error says: an OptionError's message, or the text of another.
Message message_of(const Error& error);

/// Spellings of an option of a job. \param value  empty: none
std::string option_as_flag(std::string_view name, std::string_view value);
/// `max_distance="2%"`, `faces=500`, `flip_y=True`, or `max_distance`
std::string option_as_keyword(std::string_view name, std::string_view value);
/// "job.bake.match.max_distance = 2%"
std::string option_as_member(std::string_view name, std::string_view value);

}  // namespace kiln
