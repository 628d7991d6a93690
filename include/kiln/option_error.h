/// \file
/// Errors about an option's value, and spellings of options. Programs that have names of their own for options spell
/// messages anew; what() has the members of a Job.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/message.h"

namespace KILN_PUBLIC kiln {

/// An error about options of a job, whose what() names members of Job. Copies share the data.
class OptionError : public Error {
 public:
  /// The option and the remedies are those that the message names.
  explicit OptionError(const Message& message, ErrorCode code = ErrorCode::usage,
                       const char* id = nullptr);
  /// One about a value that an option cannot have. \param allowed  "1 to 16", "{exr,png16}"
  OptionError(const OptionError& error, std::string value, std::string allowed);
  OptionError(const OptionError&) = default;             ///< Does not throw
  OptionError& operator=(const OptionError&) = default;  ///< Does not throw
  ~OptionError() override;                               ///< In the library

  /// The value that the option was given; empty: it is not about a value.
  const std::string& value() const noexcept { return data_->value; }
  /// Values that the option takes, as help has them; empty: it is not about a value.
  const std::string& allowed() const noexcept { return data_->allowed; }

 private:
  struct Data {
    std::string value, allowed;
  };
  std::shared_ptr<const Data> data_;
};

/// Options that a message names after the first, in order, with values that they could get: what to change.
std::vector<MessagePiece> remedies_of(const Message& message);

/// Spellings of an option or function, as MessagePiece has it. \param value  empty: none
std::string option_as_flag(std::string_view name, std::string_view value);
/// `max_distance="2%"`, `faces=500`, or `max_distance`
std::string option_as_keyword(std::string_view name, std::string_view value);
/// "job.bake.match.max_distance = 2%"
std::string option_as_member(std::string_view name, std::string_view value);

}  // namespace kiln
