#include "report/console.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "base/formatted.h"
#include "base/terminal.h"
#include "interrupt.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/option_error.h"
#include "options/json.h"

namespace kiln::cli {
namespace {

/// True for characters that could disguise a name: C0 except tabs and line breaks, DEL, C1 (U+0080 to U+009F, where
/// U+009B starts escape sequences), Unicode line breaks, and changes of writing direction.
bool is_control(std::string_view character) {
  const auto first = static_cast<unsigned char>(character[0]);
  if (character.size() == 1)
    return (first < 0x20 && first != '\t' && first != '\n') || first == 0x7F;
  const auto second = static_cast<unsigned char>(character[1]);
  if (character.size() == 2) return first == 0xC2 && second < 0xA0;
  const auto third = static_cast<unsigned char>(character[2]);
  if (character.size() != 3 || first != 0xE2) return false;
  return (second == 0x80 && ((third >= 0xA8 && third <= 0xAE) || third == 0x8E || third == 0x8F)) ||
         (second == 0x81 && third >= 0xA6 && third <= 0xA9);
}

}  // namespace

std::string printable(std::string_view text) {
  constexpr const char* kHexDigits = "0123456789abcdef";
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const std::size_t valid_length = utf8_length(text),
                      length = valid_length == 0 ? 1 : valid_length;
    const std::string_view character = text.substr(0, length);
    if (valid_length != 0 && !is_control(character)) {
      result += character;
    } else {
      for (const char c : character) {
        const auto byte = static_cast<unsigned char>(c);
        result += {'\\', 'x', kHexDigits[byte >> 4], kHexDigits[byte & 15]};
      }
    }
    text.remove_prefix(length);
  }
  return result;
}

std::string_view first_columns(std::string_view text, std::size_t columns) {
  std::size_t end = 0;
  for (; end < text.size() && columns > 0; --columns) end += utf8_length(text.substr(end));
  return text.substr(0, end);
}

void print_line(std::FILE* to, std::string_view text) {
  std::string indented_text;
  for (const char c : text) {
    indented_text += c;
    if (c == '\n') indented_text += "  ";
  }
  print_text(to, indented_text);
}

void print_text(std::FILE* to, std::string_view text) {
  std::fprintf(to, "%s\n", printable(text).c_str());
  std::fflush(to);
}

void finish_output() {
  const bool flushed = std::fflush(stdout) == 0;
  if ((flushed && std::ferror(stdout) == 0) || os::has_reader_closed(stdout)) return;
  throw Error(ErrorCode::output,
              std::string("Standard output could not be written: ") +
                  (os::is_closed(stdout)
                       ? "it is closed. Redirect it to a file or /dev/null, or add --quiet."
                       : "its disk is full, or the device failed. Write to another disk."));
}

Console::Console(bool quiet, const std::string& report)
    : quiet_(quiet), report_on_output_(report == "-"), terminal_(os::is_terminal(stderr)) {}

Console::~Console() { clear_bar(); }

void Console::clear_bar() {
  if (!bar_shown_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  bar_shown_ = false;
}

bool Console::progress(double share, std::string_view stage) {
  if (interrupted()) return false;
  if (quiet_ || !terminal_) return true;
  const int percent = std::clamp(static_cast<int>(share * 100), 0, 100);
  if (percent == last_percent_ && stage == last_stage_) return true;
  // A line that wraps could not be cleared, so the bar ends one column before the last.
  const std::size_t columns = os::terminal_columns() - 1;
  const std::size_t width = std::min<std::size_t>(32, columns / 3);
  const std::size_t filled = static_cast<std::size_t>(percent) * width / 100;
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  char numbers[64];
  std::snprintf(numbers, sizeof numbers, "] %3d%%  %5.1f s  ", percent, seconds);
  const std::string line = "[" + std::string(filled, '#') + std::string(width - filled, '.') +
                           numbers + printable(stage);
  const std::string_view visible_line = first_columns(line, columns);
  std::fprintf(stderr, "\r\033[K%.*s", static_cast<int>(visible_line.size()), visible_line.data());
  std::fflush(stderr);
  bar_shown_ = true;
  last_percent_ = percent;
  last_stage_ = stage;
  return true;
}

void Console::line(const std::string& text) {
  if (quiet_) return;
  clear_bar();
  print_line(report_on_output_ ? stderr : stdout, text);
}

void Console::warning(const Message& message) {
  clear_bar();
  print_line(stderr, "warning: " + message.text(option_as_flag));
}

std::string time_left(double share, double seconds) {
  constexpr double kMinShare = 0.01, kMinSeconds = 2;
  if (!(share >= kMinShare) || share >= 1 || seconds < kMinSeconds) return {};
  const double seconds_left = seconds * (1 - share) / share;
  if (seconds_left < 60) return formatted("about %.0f s left, ", std::max(1.0, seconds_left));
  if (seconds_left < 3600) return formatted("about %.0f min left, ", seconds_left / 60);
  return formatted("about %.1f h left, ", seconds_left / 3600);
}

void print_warnings(Console& console, const std::vector<Warning>& general,
                    const std::vector<Warning>& of_settings, const std::string& report) {
  for (const Warning& warning : general) console.warning(warning.message);
  std::map<std::string, std::pair<const Warning*, std::size_t>> kinds;
  for (const Warning& warning : of_settings) {
    auto& [first, count] = kinds[warning.code];
    if (first == nullptr) first = &warning;
    ++count;
  }
  for (const auto& [code, kind] : kinds) {
    const auto& [warning, count] = kind;
    console.warning(warning->message + (count > 1 ? " (The same or a similar warning occurred at " +
                                                        std::to_string(count - 1) +
                                                        " further settings; see " + report + ".)"
                                                  : ""));
  }
}

void save_report(const std::filesystem::path& path, const std::string& report) {
  if (path != "-") {
    save_text(path, report);
    return;
  }
  std::fwrite(report.data(), 1, report.size(), stdout);
  finish_output();
}

void save_report(const std::filesystem::path& path, const Json& report) {
  save_report(path, to_text(report));
}

}  // namespace kiln::cli
