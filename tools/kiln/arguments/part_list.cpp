#include "arguments/part_list.h"

#include <algorithm>
#include <sstream>
#include <string_view>

#include "arguments/bake_job.h"
#include "arguments/small_file.h"

namespace kiln::cli {
namespace {

constexpr std::size_t kMostListBytes = std::size_t{16} << 20;

std::string trimmed(std::string_view text) {
  const std::string_view space = " \t\r";
  const std::size_t first = text.find_first_not_of(space);
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(space) - first + 1));
}

/// A line LOW = HIGH, HIGH.
PartPair parse_pair(const std::string& line, const std::string& place) {
  const std::size_t equals = line.find('=');
  PartPair pair;
  pair.low = trimmed(std::string_view(line).substr(0, equals));
  if (equals != std::string::npos) {
    std::istringstream rest(line.substr(equals + 1));
    for (std::string name; std::getline(rest, name, ',');) {
      if (name = trimmed(name); !name.empty()) pair.high.push_back(name);
    }
  }
  if (pair.low.empty() || pair.high.empty()) {
    throw Error(ErrorCode::input, place + " is '" + line +
                                      "': write LOW = HIGH, or LOW = HIGH, HIGH, with names of "
                                      "groups or objects.");
  }
  return pair;
}

}  // namespace

std::vector<PartPair> parse_part_list(const std::string& list, const std::string& what) {
  std::vector<PartPair> pairs;
  std::istringstream text(list);
  std::size_t number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    line = trimmed(line);
    if (line.empty() || line[0] == '#') continue;
    pairs.push_back(parse_pair(line, what + ", line " + std::to_string(number) + ","));
  }
  if (pairs.empty()) throw Error(ErrorCode::input, what + " has no pairs.");
  return pairs;
}

PartNames part_names(const BakeJob& a) {
  PartNames names = a.part_names;
  names.by = a.parts_by.value();
  if (names.by != PartsBy::list) return names;
  const std::string what = "--match-list '" + a.match_list + "'";
  names.list = parse_part_list(read_small_file(a.match_list, kMostListBytes, what), what);
  return names;
}

}  // namespace kiln::cli
