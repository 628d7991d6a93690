#include "job/root_causes.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace kiln {
namespace {

struct WarningCause {
  std::string_view code;
  std::string_view causing_code;
  bool is_about_high_file = false;  // true if the causing warning is about the high poly's file
};

constexpr std::array kCauses = {
    // warnings about the high poly whose cause is another warning about its file
    WarningCause{"source-skipped", "degenerate-triangles", true},
    WarningCause{"source-skipped", "non-finite-vertices", true},
    WarningCause{"source-rounded", "rounded-triangles", true},
    WarningCause{"coarse-source", "coarse-coordinates", true},
    // warnings of the low poly and its UVs
    WarningCause{"low-degenerate", "rounded-triangles"},
    WarningCause{"coarse-low", "coarse-coordinates"},
    // The low poly is stored relative to the high poly's origin.
    WarningCause{"coarse-low", "coarse-coordinates", true},
    WarningCause{"low-degenerate", "degenerate-triangles"},
    WarningCause{"low-degenerate", "non-finite-vertices"},
    WarningCause{"uv-degenerate", "missing-uvs"},
    WarningCause{"uv-degenerate", "non-finite-uvs"},
    WarningCause{"uv-missing", "missing-uvs"},
    WarningCause{"uv-missing", "non-finite-uvs"},
    WarningCause{"uv-outside", "missing-uvs"},
    WarningCause{"uv-outside", "non-finite-uvs"},
    WarningCause{"no-texels", "missing-uvs"},
    WarningCause{"no-texels", "non-finite-uvs"},
    WarningCause{"no-texels", "uv-degenerate"},
    WarningCause{"no-texels", "uv-missing"},
    WarningCause{"no-texels", "uv-outside"},
    // Warnings of the bake about misses. The warning about a missed error bound is always printed, since it decides the
    // exit code.
    WarningCause{"many-misses", "high-inside-out"},
    WarningCause{"many-misses", "coarse-views"},
    WarningCause{"many-misses", "short-rays"},
    WarningCause{"many-misses", "uv-source-degenerate"},
    WarningCause{"many-misses", "uv-source-outside"},
};

}  // namespace

std::vector<Warning> root_causes(const std::vector<Warning>& warnings, std::size_t of_high) {
  const auto has_warning = [&](std::string_view code, bool is_about_high_file) {
    for (std::size_t i = 0; i < warnings.size(); ++i) {
      if ((i < of_high) == is_about_high_file && warnings[i].code == code) return true;
    }
    return false;
  };
  std::vector<Warning> warnings_without_cause;
  for (const Warning& warning : warnings) {
    const bool has_cause =
        std::any_of(kCauses.begin(), kCauses.end(), [&](const WarningCause& row) {
          return warning.code == row.code && has_warning(row.causing_code, row.is_about_high_file);
        });
    if (!has_cause) warnings_without_cause.push_back(warning);
  }
  return warnings_without_cause;
}

}  // namespace kiln
