// Formats numbers independently of the locale.
#pragma once

#include <clocale>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <string>

namespace kiln {

/// Formats like vprintf(), to any length, with decimal points in any locale (on Windows, with the locale's
/// separator).
[[gnu::format(printf, 1, 0)]] inline std::string formatted_list(const char* format,
                                                                std::va_list values) {
#ifndef _WIN32
  static const locale_t classic = newlocale(LC_ALL_MASK, "C", nullptr);
  const locale_t previous_locale = uselocale(classic);
#endif
  std::va_list values_copy;
  va_copy(values_copy, values);
  std::string text(static_cast<std::size_t>(std::vsnprintf(nullptr, 0, format, values)), '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, values_copy);
  va_end(values_copy);
#ifndef _WIN32
  uselocale(previous_locale);
#endif
  return text;
}

/// Formats like printf(), to any length, with decimal points in any locale.
[[gnu::format(printf, 1, 2)]] inline std::string formatted(const char* format, ...) {
  std::va_list values;
  va_start(values, format);
  std::string text = formatted_list(format, values);
  va_end(values);
  return text;
}

/// Formats a number for a message: 0.5, 1e+30.
inline std::string decimal(double value) { return formatted("%.6g", value); }

/// Formats a position for a message: (0.5, 1, 1e+30).
inline std::string place_text(double x, double y, double z) {
  return formatted("(%.6g, %.6g, %.6g)", x, y, z);
}

}  // namespace kiln
