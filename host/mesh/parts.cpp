// Groups of two meshes paired by their names.
#include "kiln/parts.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <string_view>
#include <utility>

namespace kiln {
namespace {

constexpr std::size_t kMostNamed = 5;  // in a warning

/// Whether text fits a pattern; `*` is any text.
bool fits(std::string_view text, std::string_view pattern) {
  if (pattern.empty()) return text.empty();
  if (pattern[0] != '*') {
    return !text.empty() && text[0] == pattern[0] && fits(text.substr(1), pattern.substr(1));
  }
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (fits(text.substr(i), pattern.substr(1))) return true;
  }
  return false;
}

/// The text of a pattern's first `*`: the shortest that fits.
std::optional<std::string> first_star(std::string_view text, std::string_view pattern) {
  const std::size_t star = pattern.find('*');
  if (text.substr(0, star) != pattern.substr(0, star)) return std::nullopt;
  for (std::size_t end = star; end <= text.size(); ++end) {
    if (fits(text.substr(end), pattern.substr(star + 1))) {
      return std::string(text.substr(star, end - star));
    }
  }
  return std::nullopt;
}

/// The name of the part that a group is of.
std::string part_name(const std::string& group, const std::vector<std::string>& patterns) {
  for (const std::string& pattern : patterns) {
    if (const auto name = first_star(group, pattern)) return *name;
  }
  return group;
}

/// How many letters must change (Levenshtein).
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t corner = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t changed = corner + (a[i - 1] == b[j - 1] ? 0 : 1);
      corner = std::exchange(row[j], std::min({changed, row[j] + 1, row[j - 1] + 1}));
    }
  }
  return row.back();
}

std::string nearest_name(const std::string& name, const std::vector<std::string>& others) {
  return *std::min_element(
      others.begin(), others.end(),
      [&](const std::string& a, const std::string& b) { return edits(name, a) < edits(name, b); });
}

/// A mesh's groups, by the parts that they are of.
struct Groups {
  std::vector<std::string> used;     ///< Names of groups that have triangles
  std::vector<std::string> part_of;  ///< Of each group

  Groups(const Mesh& mesh, const std::vector<std::string>& patterns, const char* which) {
    if (mesh.groups.size() != mesh.triangles.size()) {
      throw Error(ErrorCode::input, std::string(which) + " '" + mesh.name +
                                        "' has no groups or objects to pair by name: use an OBJ "
                                        "whose parts have names (lines `o NAME` or `g NAME`).");
    }
    std::vector<bool> has(mesh.group_names.size());
    for (const std::uint32_t group : mesh.groups) has.at(group) = true;
    for (std::size_t g = 0; g < mesh.group_names.size(); ++g) {
      part_of.push_back(part_name(mesh.group_names[g], patterns));
      if (has[g]) used.push_back(mesh.group_names[g]);
    }
  }
};

/// Adds a warning that names groups without a pair.
void warn(const char* which, const Groups& groups, const std::vector<std::string>& patterns,
          const Groups& others, const std::map<std::string, std::uint32_t>& pairs,
          std::vector<Warning>& warnings) {
  std::string names;
  std::size_t count = 0;
  for (const std::string& name : groups.used) {
    if (pairs.contains(part_name(name, patterns))) continue;
    if (++count > kMostNamed) continue;
    names += (count == 1 ? "'" : ", '") + name + "' (nearest: '" + nearest_name(name, others.used) +
             "')";
  }
  if (count == 0) return;
  if (count > kMostNamed) names += " and " + std::to_string(count - kMostNamed) + " more";
  warnings.push_back({"unmatched-parts",
                      "Groups of the " + std::string(which) +
                          " mesh without a pair of their name: " + names +
                          ". All that has no pair is matched together.",
                      count});
}

void check_patterns(const std::vector<std::string>& patterns) {
  for (const std::string& pattern : patterns) {
    if (pattern.find('*') != std::string::npos) continue;
    throw Error(ErrorCode::usage, "The pattern '" + pattern +
                                      "' of part names has no *: the text that * stands for is the "
                                      "part's name.");
  }
}

}  // namespace

Parts pair_parts(const Mesh& high, const Mesh& low, const PartNames& names) {
  check_patterns(names.low);
  check_patterns(names.high);
  const Groups of_high(high, names.high, "The dense mesh");
  const Groups of_low(low, names.low, "The light mesh");
  std::map<std::string, std::uint32_t> pairs;
  for (const std::string& name : of_low.used) {
    const std::string part = part_name(name, names.low);
    const bool has = std::any_of(of_high.used.begin(), of_high.used.end(), [&](const auto& other) {
      return part_name(other, names.high) == part;
    });
    if (has) pairs.emplace(part, 0);
  }
  Parts parts;
  if (pairs.empty()) {
    throw Error(ErrorCode::input, "No group of the light mesh has its name in the dense one: '" +
                                      of_low.used.front() + "' is nearest to '" +
                                      nearest_name(of_low.used.front(), of_high.used) +
                                      "'. The patterns of part names say which belong together.");
  }
  for (auto& [name, part] : pairs) {
    part = parts.count++;
    parts.names.push_back(name);
  }
  bool rest = false;
  const auto number = [&](const Mesh& mesh, const Groups& groups) {
    std::vector<std::uint32_t> result;
    result.reserve(mesh.groups.size());
    for (const std::uint32_t group : mesh.groups) {
      const auto pair = pairs.find(groups.part_of[group]);
      rest = rest || pair == pairs.end();
      result.push_back(pair == pairs.end() ? static_cast<std::uint32_t>(pairs.size())
                                           : pair->second);
    }
    return result;
  };
  parts.low = number(low, of_low);
  parts.high = number(high, of_high);
  if (rest) {
    ++parts.count;
    parts.names.emplace_back();
  }
  warn("light", of_low, names.low, of_high, pairs, parts.warnings);
  warn("dense", of_high, names.high, of_low, pairs, parts.warnings);
  return parts;
}

}  // namespace kiln
