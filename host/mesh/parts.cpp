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

enum class Side { low, high };

/// The name of the part that a group is of.
std::string part_name(const std::string& group, const PartNames& names, Side side) {
  if (names.by == PartsBy::list) {
    for (const PartPair& pair : names.list) {
      const bool is =
          side == Side::low
              ? fits(group, pair.low)
              : std::any_of(pair.high.begin(), pair.high.end(),
                            [&](const std::string& pattern) { return fits(group, pattern); });
      if (is) return pair.low;
    }
    // No name of the other side: a list is all there is.
    return (side == Side::low ? "low " : "high ") + group;
  }
  if (names.by != PartsBy::name) return group;
  // What is made of the high poly keeps its names.
  const bool is_low = side == Side::low;
  for (const auto* patterns : {is_low ? &names.low : &names.high, is_low ? &names.high : nullptr}) {
    if (patterns == nullptr) continue;
    for (const std::string& pattern : *patterns) {
      if (const auto name = first_star(group, pattern)) return *name;
    }
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

/// What names of triangles are called, and how an OBJ has them.
struct Kind {
  const char* one;
  const char* many;
  const char* advice;
};

Kind kind_of(PartsBy by) {
  if (by == PartsBy::object) {
    return {"object", "objects", "use an OBJ whose objects have names (lines `o NAME`)"};
  }
  if (by == PartsBy::material) {
    return {"material", "materials", "use an OBJ with materials (lines `usemtl NAME`)"};
  }
  return {"group", "groups or objects",
          "use an OBJ whose parts have names (lines `o NAME` or `g NAME`)"};
}

/// A mesh's groups, objects or materials, by the parts that they are of.
struct Groups {
  const std::vector<std::uint32_t>* of;  ///< Of each triangle
  std::vector<std::string> used;         ///< Names of groups that have triangles
  std::vector<std::string> part_of;      ///< Of each group

  Groups(const Mesh& mesh, const PartNames& names, Side side) {
    const bool objects = names.by == PartsBy::object, materials = names.by == PartsBy::material;
    of = objects ? &mesh.objects : materials ? &mesh.materials : &mesh.groups;
    const std::vector<std::string>& all = objects     ? mesh.object_names
                                          : materials ? mesh.material_names
                                                      : mesh.group_names;
    const Kind kind = kind_of(names.by);
    if (of->size() != mesh.triangles.size()) {
      throw Error(ErrorCode::input, std::string(side == Side::low ? "The low" : "The high") +
                                        " poly '" + mesh.name + "' has no " + kind.many +
                                        " to pair: " + kind.advice + ".");
    }
    std::vector<bool> has(all.size());
    for (const std::uint32_t group : *of) has.at(group) = true;
    for (std::size_t g = 0; g < all.size(); ++g) {
      part_of.push_back(part_name(all[g], names, side));
      if (has[g]) used.push_back(all[g]);
    }
  }
};

/// Adds a warning that names groups without a pair.
void warn(Side side, const Groups& groups, const PartNames& names, const Groups& others,
          const std::map<std::string, std::uint32_t>& pairs, std::vector<Warning>& warnings) {
  std::string list;
  std::size_t count = 0;
  for (const std::string& name : groups.used) {
    if (pairs.contains(part_name(name, names, side))) continue;
    if (++count > kMostNamed) continue;
    list += (count == 1 ? "'" : ", '") + name + "' (nearest: '" + nearest_name(name, others.used) +
            "')";
  }
  if (count == 0) return;
  if (count > kMostNamed) list += " and " + std::to_string(count - kMostNamed) + " more";
  std::string kind = kind_of(names.by).one;
  kind[0] = static_cast<char>(kind[0] - 'a' + 'A');
  warnings.push_back({"unmatched-parts",
                      kind + "s of the " + (side == Side::low ? "low" : "high") +
                          " poly without a pair" +
                          (names.by == PartsBy::list ? " in the list: " : " of their name: ") +
                          list + ". All that has no pair is matched together.",
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
  if (names.by == PartsBy::name) {
    check_patterns(names.low);
    check_patterns(names.high);
  }
  if (names.by == PartsBy::list && names.list.empty()) {
    throw Error(ErrorCode::usage, "The list of parts is empty.");
  }
  const Groups of_high(high, names, Side::high);
  const Groups of_low(low, names, Side::low);
  std::map<std::string, std::uint32_t> pairs;
  for (const std::string& name : of_low.used) {
    const std::string part = part_name(name, names, Side::low);
    const bool has = std::any_of(of_high.used.begin(), of_high.used.end(), [&](const auto& other) {
      return part_name(other, names, Side::high) == part;
    });
    if (has) pairs.emplace(part, 0);
  }
  Parts parts;
  if (pairs.empty()) {
    throw Error(
        ErrorCode::input,
        "No " + std::string(kind_of(names.by).one) +
            (names.by == PartsBy::list ? " of the low poly has a pair in the list: '"
                                       : " of the low poly has its name in the high poly: '") +
            of_low.used.front() + "' is nearest to '" +
            nearest_name(of_low.used.front(), of_high.used) +
            (names.by == PartsBy::name ? "'. The patterns of part names say which belong together."
                                       : "'."));
  }
  for (auto& [name, part] : pairs) {
    part = parts.count++;
    parts.names.push_back(name);
  }
  bool rest = false;
  const auto number = [&](const Groups& groups) {
    std::vector<std::uint32_t> result;
    result.reserve(groups.of->size());
    for (const std::uint32_t group : *groups.of) {
      const auto pair = pairs.find(groups.part_of[group]);
      rest = rest || pair == pairs.end();
      result.push_back(pair == pairs.end() ? static_cast<std::uint32_t>(pairs.size())
                                           : pair->second);
    }
    return result;
  };
  parts.low = number(of_low);
  parts.high = number(of_high);
  if (rest) {
    ++parts.count;
    parts.names.emplace_back();
  }
  warn(Side::low, of_low, names, of_high, pairs, parts.warnings);
  warn(Side::high, of_high, names, of_low, pairs, parts.warnings);
  return parts;
}

}  // namespace kiln
