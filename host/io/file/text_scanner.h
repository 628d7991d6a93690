// A cursor over text in memory that tracks line numbers.
#pragma once

#include <charconv>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace kiln {

/// Splits text into tokens, which are separated by blanks. A line ends with LF, CR LF or CR.
/// Numbers are read by std::from_chars: independent of the locale, correctly rounded, and including
/// "nan" and "inf"; a leading '+' is allowed, too.
class TextScanner {
 public:
  /// \param comment       a word that begins with this character is a comment; 0: there are no
  ///   comments
  /// \param continuation  true: a backslash at the end of a line joins it with the next line
  /// \param line  number of the text's first line
  explicit TextScanner(std::string_view text, char comment = 0, bool continuation = false,
                       std::uint64_t line = 1)
      : at_(text.data()),
        begin_(at_),
        end_(at_ + text.size()),
        comment_(comment),
        continuation_(continuation),
        line_(line) {}

  std::uint64_t line() const { return line_; }
  std::size_t offset() const { return static_cast<std::size_t>(at_ - begin_); }
  std::size_t remaining() const { return static_cast<std::size_t>(end_ - at_); }
  std::string place() const { return "line " + std::to_string(line_); }

  /// The next token in this line; empty at the end of the line.
  std::string_view token_in_line() {
    skip_blanks();
    const char* start = at_;
    while (at_ != end_ && !is_blank(*at_) && !ends_line(*at_) && !joins_lines()) ++at_;
    return {start, static_cast<std::size_t>(at_ - start)};
  }

  /// The next token in this line or a later one; empty at the end of the text.
  std::string_view token() {
    for (;;) {
      const std::string_view found = token_in_line();
      if (!found.empty() || at_ == end_) return found;
      next_line();
    }
  }

  /// The rest of this line as a name, without blanks at both ends. Comments are not recognised,
  /// since names may contain their character ("Material #25").
  std::string_view rest_of_line() {
    while (at_ != end_ && (is_blank(*at_) || joins_lines())) {
      if (is_blank(*at_)) {
        ++at_;
      } else {
        join_lines();
      }
    }
    const char* start = at_;
    while (at_ != end_ && !ends_line(*at_)) ++at_;
    const char* stop = at_;
    while (stop != start && is_blank(stop[-1])) --stop;
    return {start, static_cast<std::size_t>(stop - start)};
  }

  /// The comment at the start of a line, including its first character; empty if there is none. May
  /// only be called at the start of a line.
  std::string_view comment() {
    while (at_ != end_ && is_blank(*at_)) ++at_;
    if (comment_ == 0 || at_ == end_ || *at_ != comment_) return {};
    return rest_of_line();
  }

  /// Moves to the start of the next line. Returns false at the end of the text.
  bool next_line() {
    while (at_ != end_ && !ends_line(*at_)) {
      if (!joins_lines()) {
        ++at_;
      } else {
        join_lines();
      }
    }
    if (at_ == end_) return false;
    step_over_end();
    return true;
  }

 private:
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }
  static bool ends_line(char c) { return c == '\n' || c == '\r'; }

  void step_over_end() {
    if (*at_ == '\r' && at_ + 1 != end_ && at_[1] == '\n') ++at_;
    ++at_;
    ++line_;
  }

  bool joins_lines() const {
    if (!continuation_ || *at_ != '\\') return false;
    const char* next = at_ + 1;
    return next != end_ && ends_line(*next);
  }
  void join_lines() {
    ++at_;
    step_over_end();
  }

  void skip_blanks() {
    while (at_ != end_) {
      if (is_blank(*at_)) {
        ++at_;
      } else if (comment_ != 0 && *at_ == comment_) {
        while (at_ != end_ && !ends_line(*at_)) ++at_;
      } else if (joins_lines()) {
        join_lines();
      } else {
        return;
      }
    }
  }

  const char* at_;
  const char* begin_;
  const char* end_;
  char comment_;
  bool continuation_;
  std::uint64_t line_;
};

/// Parses the non-finite numbers that Microsoft's C library writes, such as "1.#INF00" and
/// "-1.#IND".
inline std::optional<double> to_non_finite(std::string_view token) {
  const double sign = token.starts_with('-') ? -1 : 1;
  if (sign < 0) token.remove_prefix(1);
  if (token.starts_with("1.#INF")) return sign * std::numeric_limits<double>::infinity();
  for (const char* nan : {"1.#QNAN", "1.#SNAN", "1.#IND"}) {
    if (token.starts_with(nan)) return std::numeric_limits<double>::quiet_NaN();
  }
  return std::nullopt;
}

/// The number that a token consists of; nullopt if it is not a number. Numbers beyond the range of
/// double become infinity or zero.
inline std::optional<double> to_double(std::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
  double value = 0;
  const auto [stop, status] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (stop != token.data() + token.size() || token.empty()) return to_non_finite(token);
  if (status == std::errc::result_out_of_range) {
    const bool is_negative = token[0] == '-';
    const std::size_t exponent = token.find_first_of("eE");
    const bool is_below_range = exponent != token.npos ? token.find('-', exponent) != token.npos
                                                       : token[is_negative ? 1 : 0] == '0';
    const double magnitude = is_below_range ? 0.0 : std::numeric_limits<double>::infinity();
    return is_negative ? -magnitude : magnitude;
  }
  if (status != std::errc()) return std::nullopt;
  return value;
}

inline std::optional<std::int64_t> to_integer(std::string_view token) {
  if (token.size() > 1 && token[0] == '+' && token[1] != '-') token.remove_prefix(1);
  std::int64_t value = 0;
  const auto [stop, status] = std::from_chars(token.data(), token.data() + token.size(), value);
  if (status != std::errc() || stop != token.data() + token.size()) return std::nullopt;
  return value;
}

/// A token as shown in messages: at most 40 characters, with '?' for unprintable ones.
inline std::string printable(std::string_view token) {
  std::string text(token.substr(0, 40));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126) c = '?';
  }
  return token.size() > 40 ? text + "..." : text;
}

}  // namespace kiln
