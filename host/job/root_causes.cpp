#include "job/root_causes.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace kiln {
namespace {

struct Follows {
  std::string_view code;
  std::string_view cause;
  bool in_high = false;  // the cause is a warning about the high poly's file
};

constexpr std::array kFollows = {
    // Warnings of the high poly.
    Follows{"source-skipped", "degenerate-triangles", true},
    Follows{"source-skipped", "non-finite-vertices", true},
    Follows{"source-rounded", "rounded-triangles", true},
    Follows{"coarse-source", "coarse-coordinates", true},
    // Warnings of the low poly and its UVs.
    Follows{"low-degenerate", "rounded-triangles"},
    Follows{"coarse-low", "coarse-coordinates"},
    // the low poly is stored in the high poly's frame
    Follows{"coarse-low", "coarse-coordinates", true},
    Follows{"low-degenerate", "degenerate-triangles"},
    Follows{"low-degenerate", "non-finite-vertices"},
    Follows{"uv-degenerate", "missing-uvs"},
    Follows{"uv-degenerate", "non-finite-uvs"},
    Follows{"uv-missing", "missing-uvs"},
    Follows{"uv-missing", "non-finite-uvs"},
    Follows{"uv-outside", "missing-uvs"},
    Follows{"uv-outside", "non-finite-uvs"},
    Follows{"no-texels", "missing-uvs"},
    Follows{"no-texels", "non-finite-uvs"},
    Follows{"no-texels", "uv-degenerate"},
    Follows{"no-texels", "uv-missing"},
    Follows{"no-texels", "uv-outside"},
    // Warnings of the bake about misses. An error bound that was not reached decides the exit code, so it is always
    // printed.
    Follows{"many-misses", "high-inside-out"},
    Follows{"many-misses", "coarse-views"},
    Follows{"many-misses", "short-rays"},
    Follows{"many-misses", "uv-source-degenerate"},
    Follows{"many-misses", "uv-source-outside"},
};

}  // namespace

std::vector<Warning> root_causes(const std::vector<Warning>& warnings, std::size_t of_high) {
  const auto has = [&](std::string_view code, bool in_high) {
    for (std::size_t i = 0; i < warnings.size(); ++i) {
      if ((i < of_high) == in_high && warnings[i].code == code) return true;
    }
    return false;
  };
  std::vector<Warning> roots;
  for (const Warning& warning : warnings) {
    const bool follows = std::any_of(kFollows.begin(), kFollows.end(), [&](const Follows& row) {
      return warning.code == row.code && has(row.cause, row.in_high);
    });
    if (!follows) roots.push_back(warning);
  }
  return roots;
}

}  // namespace kiln
