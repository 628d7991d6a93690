// Messages that name options, and how doors spell these.
#include "kiln/message.h"

#include <algorithm>
#include <cctype>

#include "job/job_options.h"
#include "options/parse.h"

namespace kiln {

std::string Message::text() const { return text(option_as_member); }

std::string Message::text(const OptionSpelling& spelling) const {
  std::string text;
  for (const MessagePiece& piece : pieces_) {
    text += piece.option.empty() ? piece.text : spelling(piece.option, piece.value);
  }
  return text;
}

OptionError::OptionError(const Message& message, ErrorCode code, const char* id)
    : Error(code, message.text(), id) {
  auto data = std::make_shared<Data>();
  data->message = message;
  for (const MessagePiece& piece : message.pieces()) {
    if (piece.option.empty()) continue;
    if (data->name.empty()) {
      data->name = piece.option;
    } else {
      data->remedies.push_back(piece);
    }
  }
  data_ = std::move(data);
}

OptionError::OptionError(const OptionError& error, std::string value, std::string allowed)
    : Error(error) {
  auto data = std::make_shared<Data>(*error.data_);
  data->value = std::move(value);
  data->allowed = std::move(allowed);
  data_ = std::move(data);
}

OptionError::~OptionError() = default;

void fail_usage(const Message& message) {
  const std::vector<MessagePiece>& pieces = message.pieces();
  const bool names_options =
      std::any_of(pieces.begin(), pieces.end(),
                  [](const MessagePiece& piece) { return !piece.option.empty(); });
  if (names_options) throw OptionError(message);
  throw Error(ErrorCode::usage, message.text());
}

Message message_of(const Error& error) {
  const auto* const of_options = dynamic_cast<const OptionError*>(&error);
  return of_options != nullptr ? of_options->message() : Message(error.what());
}

Message option_of(std::string_view flag, std::string_view value) {
  std::string name(flag.substr(std::min(flag.find_first_not_of('-'), flag.size())));
  std::replace(name.begin(), name.end(), '-', '_');
  return Message::option(name, value);
}

std::string option_as_flag(std::string_view name, std::string_view value) {
  std::string text = "--" + std::string(name);
  std::replace(text.begin(), text.end(), '_', '-');
  return value.empty() ? text : text + " " + std::string(value);
}

std::string option_as_keyword(std::string_view name, std::string_view value) {
  const std::string text(name);
  if (value.empty()) return text;
  double number = 0;
  const bool is_plain = read_number(value, number);
  return text + "=" + (is_plain ? std::string(value) : "\"" + std::string(value) + "\"");
}

std::string option_as_member(std::string_view name, std::string_view value) {
  std::string flag = option_as_flag(name, {});
  const OptionRow* const row = find_row(bake_rows(), flag);
  std::string member = row == nullptr ? std::string(name) : row->value.member;
  member = member.substr(0, member.find(','));
  if (row != nullptr) member = "job." + member;
  return value.empty() ? member : member + " = " + std::string(value);
}

}  // namespace kiln
