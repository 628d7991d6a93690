#include "job/root_causes.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace kiln {
namespace {

struct CausedBy {
  std::string_view code;
  std::string_view causing_code;
  bool of_high_file = false;  // true: the causing warning is about the high poly's file
};

constexpr std::array kCauses = {
    // warnings about the high poly whose cause is another warning about its file
    CausedBy{"source-skipped", "degenerate-triangles", true},
    CausedBy{"source-skipped", "non-finite-vertices", true},
    CausedBy{"source-rounded", "rounded-triangles", true},
    CausedBy{"coarse-source", "coarse-coordinates", true},
    // warnings of the low poly and its UVs
    CausedBy{"low-degenerate", "rounded-triangles"},
    CausedBy{"coarse-low", "coarse-coordinates"},
    // The low poly is stored relative to the high poly's origin.
    CausedBy{"coarse-low", "coarse-coordinates", true},
    CausedBy{"low-degenerate", "degenerate-triangles"},
    CausedBy{"low-degenerate", "non-finite-vertices"},
    CausedBy{"uv-degenerate", "missing-uvs"},
    CausedBy{"uv-degenerate", "non-finite-uvs"},
    CausedBy{"uv-missing", "missing-uvs"},
    CausedBy{"uv-missing", "non-finite-uvs"},
    CausedBy{"uv-outside", "missing-uvs"},
    CausedBy{"uv-outside", "non-finite-uvs"},
    CausedBy{"no-texels", "missing-uvs"},
    CausedBy{"no-texels", "non-finite-uvs"},
    CausedBy{"no-texels", "uv-degenerate"},
    CausedBy{"no-texels", "uv-missing"},
    CausedBy{"no-texels", "uv-outside"},
    // Warnings of the bake about misses. The warning about a missed error bound is always printed, since it decides the
    // exit code.
    CausedBy{"many-misses", "high-inside-out"},
    CausedBy{"many-misses", "coarse-views"},
    CausedBy{"many-misses", "short-rays"},
    CausedBy{"many-misses", "uv-source-degenerate"},
    CausedBy{"many-misses", "uv-source-outside"},
};

}  // namespace

std::vector<Warning> root_causes(const std::vector<Warning>& warnings, std::size_t of_high) {
  const auto has_warning = [&](std::string_view code, bool of_high_file) {
    for (std::size_t i = 0; i < warnings.size(); ++i) {
      if ((i < of_high) == of_high_file && warnings[i].code == code) return true;
    }
    return false;
  };
  std::vector<Warning> warnings_without_cause;
  for (const Warning& warning : warnings) {
    const bool has_cause = std::any_of(kCauses.begin(), kCauses.end(), [&](const CausedBy& row) {
      return warning.code == row.code && has_warning(row.causing_code, row.of_high_file);
    });
    if (!has_cause) warnings_without_cause.push_back(warning);
  }
  return warnings_without_cause;
}

}  // namespace kiln
