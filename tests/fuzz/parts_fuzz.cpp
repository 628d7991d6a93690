// Names of parts and lists of patterns: pairs as a plain search finds them, or kiln::Error. Lines: names of LOW, an empty
// line, names of HIGH, an empty line, and a file of --match-list.
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "job/lists.h"
#include "kiln/error.h"
#include "kiln/match.h"
#include "kiln/mesh.h"

namespace {

bool fits(std::string_view text, std::string_view pattern) {
  std::size_t t = 0, p = 0, star = std::string_view::npos, from = 0;
  while (t < text.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      from = t;
    } else if (p < pattern.size() && pattern[p] == text[t]) {
      ++p;
      ++t;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      t = ++from;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

kiln::Mesh with(const std::vector<std::string>& names) {
  kiln::Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.group_names = names;
  for (std::uint32_t i = 0; i < names.size(); ++i) {
    mesh.triangles.push_back({0, 1, 2});
    mesh.groups.push_back(i);
  }
  return mesh;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream lines(std::string(reinterpret_cast<const char*>(data), size));
  std::vector<std::string> low, high;
  kiln::PartNames names;
  std::string list;
  for (std::vector<std::string>* section : {&low, &high}) {
    for (std::string line; std::getline(lines, line) && !line.empty();) section->push_back(line);
  }
  std::getline(lines, list, '\0');
  try {
    if (!list.empty()) names.list = kiln::parse_part_list(list, "input");
    names.by = list.empty() ? kiln::PartsBy::name : kiln::PartsBy::list;
    const kiln::Parts parts = kiln::pair_parts(with(high), with(low), names);
    if (parts.low.size() != low.size() || parts.high.size() != high.size()) std::abort();
    for (const std::uint32_t part : parts.low) {
      if (part >= parts.count) std::abort();
    }
    for (std::size_t i = 0; i < low.size() && !names.list.empty(); ++i) {
      std::string first;
      for (std::size_t k = names.list.size(); k-- > 0;) {
        if (fits(low[i], names.list[k].low)) first = names.list[k].low;
      }
      // A pair whose other side no name fits is none.
      const std::string& found = parts.names.at(parts.low[i]);
      if (!found.empty() && found != first) std::abort();
    }
  } catch (const kiln::Error& error) {
    if (error.code() != kiln::ErrorCode::input && error.code() != kiln::ErrorCode::usage)
      std::abort();
  }
  return 0;
}
