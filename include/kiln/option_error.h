/// \file
/// Errors about an option's value, and spellings of options in messages. what() spells options as members of a Job;
/// programs whose users know options by other names convert message() with an OptionSpelling of their own.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/message.h"

namespace KILN_PUBLIC kiln {

/// An error about options of a job. what() names the options as members of Job. Copies share the
/// data.
class OptionError : public Error {
 public:
  /// option() and remedies() return the options that the message names.
  explicit OptionError(const Message& message, ErrorCode code = ErrorCode::usage,
                       const char* id = nullptr);
  /// An error about an invalid value of an option.
  /// \param value    the rejected value
  /// \param allowed  accepted values: "1 to 16", "{exr,png16}"
  OptionError(const OptionError& error, std::string value, std::string allowed);
  OptionError(const OptionError&) = default;             ///< Does not throw
  OptionError& operator=(const OptionError&) = default;  ///< Does not throw
  ~OptionError() override;  ///< Defined in the library, see the destructor of Error

  /// The rejected value; empty: the error is not about a value.
  const std::string& value() const noexcept { return data_->value; }
  /// Values that the option accepts, as its help states them; empty: the error is not about a value.
  const std::string& allowed() const noexcept { return data_->allowed; }

 private:
  struct Data {
    std::string value, allowed;
  };
  std::shared_ptr<const Data> data_;
};

/// The options that a message names after the first one, with suggested values, in their order: those that the
/// user may change to solve the problem.
std::vector<MessagePiece> remedies_of(const Message& message);

/// Spells an option as a flag of the command: "--max-distance 2%".
/// \param name  as MessagePiece::option
/// \param value  value of the option; empty: only the option is spelled
std::string option_as_flag(std::string_view name, std::string_view value);
/// Spells an option as a keyword argument of Python: `max_distance="2%"`, `faces=500`, or `max_distance`
std::string option_as_keyword(std::string_view name, std::string_view value);
/// Spells an option as a member of Job: "job.bake.match.max_distance = 2%"
std::string option_as_member(std::string_view name, std::string_view value);

}  // namespace kiln
