#include "report/flags.h"

#include <array>
#include <cstddef>

namespace kiln::cli {
namespace {

struct Flag {
  std::string_view parameter;
  std::string_view flag;
};

// Of two that begin alike the longer one comes first.
constexpr std::array kFlags = {
    Flag{"MatchOptions::fallback", "--fallback"},
    Flag{"MatchOptions::cage", "--cage"},
    Flag{"Device::open", "--device"},
    Flag{"RayRule::outermost", "--ray outermost"},
    Flag{"ExtractOptions::size", "--size"},
    Flag{"MatchMethod::", "--match "},
    Flag{"PartNames::low", "--low-names"},
    Flag{"PartNames::high", "--high-names"},
    Flag{"curvature_radius", "--curvature-radius"},
    Flag{"raise the memory limit", "raise --memory-limit"},
    Flag{"keep_uvs", "--keep-uvs"},
    Flag{"keep_topology = false", "--topology free"},
    Flag{"max_distance", "--max-distance"},
    Flag{"min_part", "--min-part P"},
    Flag{"outer_gap", "--outer-gap N"},
    Flag{"outer_only", "--outer"},
    Flag{"raise uv.max_distance", "add --force-uv"},
    Flag{"raise uv.max_overlap", "add --force-uv"},
    Flag{"SetsBy::", "--sets "},
    Flag{"save_match()", "--save-match"},
    Flag{"simplify() makes a low poly to unwrap",
         "`kiln bake` without LOW makes a low poly that has them"},
    Flag{"two_component", "--two-component"},
    Flag{"two_sided", "--two-sided"},
    Flag{"ray.edge_width", "--edge-width"},
    Flag{"unwrap()", "`kiln bake --unwrap`"},
    Flag{"views.count", "--views"},
    Flag{"views.size", "--view-size"},
};

/// True if a name may begin after this text: not within a word, a quote or a path.
bool may_begin(std::string_view before) {
  return before.empty() || before.back() == ' ' || before.back() == '(';
}

bool may_end(std::string_view after) {
  if (after.empty() || std::string_view(" ,:;)").find(after[0]) != std::string_view::npos) {
    return true;
  }
  return after[0] == '.' && (after.size() == 1 || after[1] == ' ');
}

}  // namespace

std::string with_flags(std::string_view message) {
  std::string text;
  for (std::size_t at = 0; at < message.size();) {
    const std::string_view rest = message.substr(at);
    const Flag* found = nullptr;
    for (const Flag& known : kFlags) {
      if (rest.starts_with(known.parameter) && may_begin(message.substr(0, at)) &&
          (known.parameter.ends_with(':') || may_end(rest.substr(known.parameter.size())))) {
        found = &known;
        break;
      }
    }
    text += found != nullptr ? found->flag : rest.substr(0, 1);
    at += found != nullptr ? found->parameter.size() : 1;
  }
  return text;
}

}  // namespace kiln::cli
