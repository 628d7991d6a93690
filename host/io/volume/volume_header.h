// Lines and numbers of the text headers of volumes.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/lower_case.h"
#include "io/file/text_scanner.h"
#include "io/volume/volume_reader.h"

namespace kiln {

/// A field of a header: its line, name and value.
struct HeaderField {
  std::uint64_t line = 0;
  std::string key;           ///< Name of the field, normalised so that names can be compared
  std::string written_name;  ///< Name of the field as written in the file
  std::string value;         ///< Value without blanks at both ends

  std::string place() const { return "line " + std::to_string(line) + " (" + written_name + ")"; }
};

struct HeaderFields {
  std::vector<HeaderField> all;
  const HeaderField* find(std::string_view key) const {
    for (const HeaderField& field : all) {
      if (field.key == key) return &field;
    }
    return nullptr;
  }
};

/// Splits a text into lines, which end with LF or CR LF.
class HeaderLines {
 public:
  explicit HeaderLines(std::string_view text) : text_(text) {}
  /// The next line; nullopt at the end of the text.
  std::optional<std::string_view> next() {
    if (at_ >= text_.size()) return std::nullopt;
    const std::size_t end = text_.find('\n', at_);
    std::string_view line = text_.substr(at_, end == text_.npos ? text_.npos : end - at_);
    at_ = end == text_.npos ? text_.size() : end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    ++number_;
    return line;
  }
  /// Offset of the start of the next line.
  std::size_t offset() const { return at_; }
  std::uint64_t number() const { return number_; }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::uint64_t number_ = 0;
};

inline std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

inline std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> result;
  TextScanner scan(text);
  for (auto word = scan.token_in_line(); !word.empty(); word = scan.token_in_line()) {
    result.push_back(word);
  }
  return result;
}

/// The numbers that a text consists of; nullopt if one of its words is not a number.
inline std::optional<std::vector<double>> to_doubles(std::string_view text) {
  std::vector<double> result;
  for (const std::string_view word : words(text)) {
    const auto number = to_double(word);
    if (!number) return std::nullopt;
    result.push_back(*number);
  }
  return result;
}

constexpr const char* kCorrectHeader = "Correct the header, or export the volume again.";

/// Adds a field.
/// \throws Error(input) if there already is a field of this name
void add_field(const VolumeInput& input, HeaderField field, HeaderFields& fields);

/// The field with the given name, which must exist.
/// \param example  a line that the error message suggests if the field is missing
const HeaderField& require_field(const VolumeInput& input, const HeaderFields& fields,
                                 std::string_view key, const char* example);

/// Parses an integer of 0 or more.
/// \throws Error(input)
std::uint64_t integer(const VolumeInput& input, const HeaderField& field, std::string_view word);

/// \throws Error(input) if a list does not have one entry per dimension
void check_count(const VolumeInput& input, const HeaderField& field, std::size_t found,
                 std::size_t expected);

/// The voxel type with the given lower-case name.
/// \throws Error(input) for an unknown name
VoxelType voxel_type_in(const VolumeInput& input, const HeaderField& field,
                        std::span<const std::pair<std::string_view, VoxelType>> names);

}  // namespace kiln
