// Formats percentages for messages.
#pragma once

#include <cmath>
#include <string>

#include "base/formatted.h"

namespace kiln {

/// A share in percent with the given significant digits, never with an exponent: "0.0031%", "12.3%", "750%".
inline std::string percent(double share, int digits = 3) {
  constexpr double kMaxPercent = 1e6;
  constexpr int kMaxDecimals = 6;
  const double value = 100 * share;
  if (!(value < kMaxPercent)) return "over 1000000%";
  int decimals = 0;
  const double min_scaled = std::pow(10.0, digits - 1);
  for (double v = value; v > 0 && v < min_scaled && decimals < kMaxDecimals; v *= 10) ++decimals;
  std::string number = formatted("%.*f", decimals, value);
  if (decimals > 0) number.erase(number.find_last_not_of('0') + 1);
  if (number.back() == '.') number.pop_back();
  return number + "%";
}

}  // namespace kiln
