// Checks of option values, with their error messages.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

/// The words that the user gave for an option; at least one.
using OptionWords = std::vector<std::string>;

/// Checks a value, and may normalise it.
class Check {
 public:
  /// Creates a check.
  /// \param function  returns the error in a value, worded as a continuation of the option's name; empty if the value
  /// is valid. The function may normalise the value
  /// \param words  allowed values, for help
  Check(std::function<std::string(std::string&)> function, std::string_view words)
      : function_(std::move(function)), words_(words) {}

  /// The error in a value, such as " is '0': give 1 to 16"; empty if it is valid.
  std::string operator()(std::string& value) const { return function_(value); }
  /// The allowed values, for help.
  const std::string& words() const { return words_; }

 private:
  std::function<std::string(std::string&)> function_;
  std::string words_;
};

/// A check for numbers within a range. The unsigned overload allows integers alone.
Check range(double low, double high);
Check range(unsigned low, unsigned high);
/// A check for names, ignoring case and surrounding spaces. It replaces the value by the name.
Check one_of(const std::vector<std::string>& names);

/// Parses a text that consists of one number; a leading plus sign is allowed.
/// \returns false for other texts
template <typename Number>
bool read_number(std::string_view text, Number& value);

}  // namespace kiln
