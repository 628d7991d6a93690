#include "report/console.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <utility>

#include "interrupt.h"
#include "report/flags.h"
#include "report/terminal.h"

namespace kiln::cli {

Console::Console(bool quiet, const std::string& report)
    : quiet_(quiet), report_on_output_(report == "-"), terminal_(isatty(STDERR_FILENO) != 0) {
  // Without a name it says nothing of what it can do.
  const char* kind = std::getenv("TERM");
  if (kind == nullptr || *kind == '\0' || std::string_view(kind) == "dumb") terminal_ = false;
}

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
  // A line that wraps would not be cleared: it ends a column before the last one.
  const std::size_t columns = terminal_columns() - 1;
  const std::size_t width = std::min<std::size_t>(32, columns / 3);
  const std::size_t filled = static_cast<std::size_t>(percent) * width / 100;
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  char numbers[64];
  std::snprintf(numbers, sizeof numbers, "] %3d%%  %5.1f s  ", percent, seconds);
  const std::string line = "[" + std::string(filled, '#') + std::string(width - filled, '.') +
                           numbers + printable(stage);
  const std::string_view shown = first_columns(line, columns);
  std::fprintf(stderr, "\r\033[K%.*s", static_cast<int>(shown.size()), shown.data());
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

void Console::warning(const std::string& text) {
  clear_bar();
  print_line(stderr, "warning: " + with_flags(text));
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
    console.warning(warning->message +
                    (count > 1 ? " (And so, or likewise, at " + std::to_string(count - 1) +
                                     " further settings: see " + report + ".)"
                               : ""));
  }
}

}  // namespace kiln::cli
