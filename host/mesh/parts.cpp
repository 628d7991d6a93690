// Pairs the groups of two meshes by name.
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "base/counted.h"
#include "base/lower_case.h"
#include "base/option.h"
#include "kiln/match.h"

namespace kiln {
namespace {

constexpr std::size_t kMaxNamesInWarning = 5;  // Maximum number of names in a warning
// Longer names are shortened in messages, to this many characters
constexpr std::size_t kMaxNameLength = 80;
// A name is not similar if its edit distance is larger
constexpr std::size_t kMaxEdits = 32;
// Maximum number of names from which patterns are guessed
constexpr std::size_t kMaxSampledNames = 64;
constexpr std::size_t kMaxPatternGuesses = 8;

/// The shortest text that the first `*` of the pattern can stand for; empty for a pattern without one. nullopt if the
/// text does not match. Texts between stars are matched at their first occurrence, which suffices.
std::optional<std::string_view> text_of_first_star(std::string_view text,
                                                   std::string_view pattern) {
  const std::size_t first = pattern.find('*'), last = pattern.rfind('*');
  if (first == std::string_view::npos) {
    return text == pattern ? std::optional(text.substr(0, 0)) : std::nullopt;
  }
  const std::string_view head = pattern.substr(0, first), tail = pattern.substr(last + 1);
  if (text.size() < head.size() + tail.size() || !text.starts_with(head) || !text.ends_with(tail)) {
    return std::nullopt;
  }
  const std::string_view middle_text = text.substr(0, text.size() - tail.size());
  std::size_t at = first, star_end = middle_text.size();
  for (std::size_t p = first + 1; p <= last;) {
    const std::size_t next = pattern.find('*', p);
    const std::string_view piece = pattern.substr(p, next - p);
    const std::size_t found = middle_text.find(piece, at);
    if (found == std::string_view::npos) return std::nullopt;
    if (p == first + 1) star_end = found;
    at = found + piece.size();
    p = next + 1;
  }
  return text.substr(first, star_end - first);
}

/// The name without Blender's copy suffix, such as `.001`, if it has one.
std::string_view without_copy_number(std::string_view name) {
  const std::size_t dot_position = name.find_last_not_of("0123456789");
  const bool has_copy_number = dot_position != std::string_view::npos &&
                               name[dot_position] == '.' && name.size() - dot_position > 3;
  return has_copy_number ? name.substr(0, dot_position) : name;
}

enum class PartSide { low, high };

/// Maps names of groups to names of parts, by patterns or by a list.
class PartNamer {
 public:
  explicit PartNamer(const PartNames& names) : names_(names) {
    for (const std::string& pattern : names.low) low_.push_back(lower_case(pattern));
    for (const std::string& pattern : names.high) high_.push_back(lower_case(pattern));
    for (std::size_t i = 0; i < names.list.size(); ++i) {
      of_low_.add(names.list[i].low, i);
      for (const std::string& pattern : names.list[i].high) of_high_.add(pattern, i);
    }
  }

  /// The part that a group belongs to.
  std::string operator()(const std::string& group, PartSide side) const {
    if (auto part = match_rule(group, side)) return *part;
    // A list names all pairs, so a name that is not listed has no part.
    if (names_.by != PartsBy::list) return group;
    return (side == PartSide::low ? "low\n" : "high\n") + group;
  }

  /// The part by the patterns or the list; nullopt if the name matches none of them.
  std::optional<std::string> match_rule(const std::string& group, PartSide side) const {
    if (names_.by == PartsBy::list) {
      const auto pair = (side == PartSide::low ? of_low_ : of_high_).first(group);
      return pair ? std::optional(names_.list[*pair].low) : std::nullopt;
    }
    if (names_.by != PartsBy::name) return std::nullopt;
    for (const std::string_view name : {std::string_view(group), without_copy_number(group)}) {
      const std::string text = lower_case(name);
      // A low poly that was simplified from the high poly has the high poly's names, so the high poly's patterns are
      // also tried for the low poly.
      const bool is_low = side == PartSide::low;
      for (const auto* patterns : {is_low ? &low_ : &high_, is_low ? &high_ : nullptr}) {
        if (patterns == nullptr) continue;
        for (const std::string& pattern : *patterns) {
          const auto part = text_of_first_star(text, pattern);
          if (part && !part->empty()) return group.substr(pattern.find('*'), part->size());
        }
      }
    }
    return std::nullopt;
  }

 private:
  /// The patterns of a list for one mesh (LOW or HIGH). The first pattern that matches a name counts. Patterns are
  /// indexed by the text before the first star, the text after the last one, and the longest text between stars, so
  /// that a name need not be compared with every pattern.
  class PatternList {
   public:
    void add(const std::string& pattern, std::size_t pair) {
      const std::size_t first = pattern.find('*');
      if (first == std::string::npos) {
        pair_of_plain_name_.emplace(pattern, pair);
        return;
      }
      const std::size_t last = pattern.rfind('*');
      std::string longest_middle;
      for (std::size_t p = first + 1; p <= last;) {
        const std::size_t next = pattern.find('*', p);
        if (next - p > longest_middle.size()) longest_middle = pattern.substr(p, next - p);
        p = next + 1;
      }
      const std::string head = pattern.substr(0, first), tail = pattern.substr(last + 1);
      patterns_[{head.size(), tail.size(), longest_middle.size()}][head + tail + longest_middle]
          .emplace_back(pattern, pair);
    }
    std::optional<std::size_t> first(const std::string& name) const {
      std::optional<std::size_t> pair;
      if (const auto exact_match = pair_of_plain_name_.find(name);
          exact_match != pair_of_plain_name_.end())
        pair = exact_match->second;
      std::unordered_set<const Patterns*> tried_patterns;
      for (const auto& [sizes, by_key] : patterns_) {
        const auto& [head, tail, longest_middle] = sizes;
        if (head + tail + longest_middle > name.size()) continue;
        const std::size_t end = name.size() - tail;
        std::string key = name.substr(0, head) + name.substr(end);
        const std::size_t fixed_length = key.size();
        for (std::size_t at = head; at + longest_middle <= (longest_middle == 0 ? head : end);
             ++at) {
          key.replace(fixed_length, key.size() - fixed_length, name, at, longest_middle);
          const auto patterns_of_key = by_key.find(key);
          if (patterns_of_key == by_key.end() ||
              !tried_patterns.insert(&patterns_of_key->second).second)
            continue;
          for (const auto& [pattern, number] : patterns_of_key->second) {
            if (pair && *pair <= number) break;
            if (text_of_first_star(name, pattern)) pair = number;
          }
        }
      }
      return pair;
    }

   private:
    using Patterns = std::vector<std::pair<std::string, std::size_t>>;
    std::unordered_map<std::string, std::size_t> pair_of_plain_name_;
    /// Patterns by the lengths of the three texts of their key, then by the key.
    std::map<std::array<std::size_t, 3>, std::unordered_map<std::string, Patterns>> patterns_;
  };

  const PartNames& names_;
  std::vector<std::string> low_, high_;  // Names in lower case
  PatternList of_low_, of_high_;
};

/// Edit distance (Levenshtein) of two names if it is below `limit`, else `limit`. Only computes the band around the
/// diagonal (Ukkonen 1985).
std::size_t edit_distance(std::string_view a, std::string_view b, std::size_t limit) {
  if (a.size() > b.size()) std::swap(a, b);
  if (b.size() - a.size() >= limit) return limit;
  std::vector<std::size_t> row(b.size() + 1, limit);
  for (std::size_t j = 0; j <= std::min(b.size(), limit); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    const std::size_t from = i > limit ? i - limit : 1, to = std::min(b.size(), i + limit);
    std::size_t corner = std::exchange(row[from - 1], from == 1 ? std::min(i, limit) : limit);
    std::size_t smallest_in_row = row[from - 1];
    for (std::size_t j = from; j <= to; ++j) {
      const std::size_t edits = corner + (a[i - 1] == b[j - 1] ? 0 : 1);
      corner = std::exchange(row[j], std::min({edits, row[j] + 1, row[j - 1] + 1, limit}));
      smallest_in_row = std::min(smallest_in_row, row[j]);
    }
    if (smallest_in_row >= limit) return limit;
  }
  return row.back();
}

/// The most similar name, or the first of several equally similar ones; null if no name is similar.
const std::string* most_similar_name(const std::string& name,
                                     const std::vector<std::string>& others) {
  const std::string* nearest_name = nullptr;
  std::size_t smallest_distance = kMaxEdits;
  for (const std::string& other : others) {
    const std::size_t edits = edit_distance(name, other, smallest_distance);
    if (edits < smallest_distance)
      std::tie(smallest_distance, nearest_name) = std::pair(edits, &other);
  }
  return nearest_name;
}

std::string quote_name(const std::string& name) {
  return "'" + (name.size() > kMaxNameLength ? name.substr(0, kMaxNameLength) + "..." : name) + "'";
}

/// The words for a kind of names in messages, and the statement that sets it in an OBJ file.
struct NameKind {
  const char* one;
  const char* many;
  const char* advice;
};

NameKind name_kind_of(PartsBy by) {
  if (by == PartsBy::object) {
    return {"object", "objects", "use an OBJ whose objects have names (lines `o NAME`)"};
  }
  if (by == PartsBy::material) {
    return {"material", "materials", "use an OBJ with materials (lines `usemtl NAME`)"};
  }
  return {"group", "groups or objects",
          "use an OBJ whose parts have names (lines `o NAME` or `g NAME`)"};
}

/// A mesh's groups, objects or materials, and the parts to which they belong.
struct NamedGroups {
  const std::vector<std::uint32_t>* of;    ///< Group of each triangle
  std::vector<std::string> used;           ///< Names of the groups that have triangles
  std::vector<std::string> parts_of_used;  ///< Part of each name in `used`
  std::vector<std::string> part_of;        ///< Part of each group
  std::vector<std::size_t> used_groups;    ///< Number of groups with each name in `used`
  /// For each OBJ group with several names ("g head_high skin"), the parts of its single words, which are used if the
  /// whole name matches nothing. The first list has the words that match a pattern or the list of names, the second
  /// list the other words. Empty for most groups.
  std::vector<std::array<std::vector<std::string>, 2>> parts_of_group_words;

  NamedGroups(const Mesh& mesh, const PartNames& names, const PartNamer& part_name, PartSide side) {
    // Formats without groups, such as glTF, have objects only.
    const bool materials = names.by == PartsBy::material;
    const bool objects = names.by == PartsBy::object || (!materials && mesh.groups.empty());
    of = objects ? &mesh.objects : materials ? &mesh.materials : &mesh.groups;
    const std::vector<std::string>& all = objects     ? mesh.object_names
                                          : materials ? mesh.material_names
                                                      : mesh.group_names;
    const NameKind kind = name_kind_of(names.by);
    if (of->size() != mesh.triangles.size()) {
      throw Error(ErrorCode::input, std::string(side == PartSide::low ? "The low" : "The high") +
                                        " poly '" + mesh.name + "' has no " + kind.many +
                                        " to pair: " + kind.advice + ".");
    }
    std::vector<bool> has(all.size());
    for (const std::uint32_t group : *of) has.at(group) = true;
    const bool has_several = !objects && !materials;
    const std::unordered_set<std::string_view> object_names_of_mesh(mesh.object_names.begin(),
                                                                    mesh.object_names.end());
    parts_of_group_words.resize(all.size());
    for (std::size_t g = 0; g < all.size(); ++g) {
      part_of.push_back(part_name(all[g], side));
      // The name of an object (`o`) is a single name, even if it contains blanks.
      if (has_several && !object_names_of_mesh.contains(all[g])) {
        parts_of_group_words[g] = parts_of_words(all[g], part_name, side, names.by);
      }
      if (!has[g]) continue;
      used.push_back(all[g]);
      parts_of_used.push_back(part_of[g]);
      used_groups.push_back(g);
    }
  }

 private:
  static std::array<std::vector<std::string>, 2> parts_of_words(const std::string& group,
                                                                const PartNamer& part_name,
                                                                PartSide side, PartsBy by) {
    std::array<std::vector<std::string>, 2> parts;
    const std::string_view all = group;
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t end = std::min(all.find_first_of(" \t", at), all.size());
      const std::string word(all.substr(at, end - at));
      at = end + 1;
      if (word.empty() || word.size() == all.size()) continue;
      if (auto part = part_name.match_rule(word, side)) {
        parts[0].push_back(std::move(*part));
      } else if (by != PartsBy::list) {
        parts[1].push_back(word);
      }
    }
    return parts;
  }
};

/// Pairs groups with several names by one of these names, if their whole names have no partner. Among the names that
/// both meshes have, a name that matches a pattern or the list comes first, then the name of the fewest groups (which
/// is the most specific), then the first in alphabetical order. So both meshes choose the same name.
void pair_by_words(NamedGroups& low, NamedGroups& high, std::vector<Warning>& warnings) {
  struct WordUse {
    std::array<std::size_t, 2> groups{};
    bool are_both_used() const { return groups[0] != 0 && groups[1] != 0; }
    std::size_t all() const { return groups[0] + groups[1]; }
  };
  std::unordered_map<std::string, WordUse> word_uses;
  NamedGroups* const sides[] = {&low, &high};
  for (std::size_t s = 0; s < 2; ++s) {
    for (const std::size_t g : sides[s]->used_groups) {
      std::unordered_set<std::string> words_of_side(sides[s]->parts_of_group_words[g][0].begin(),
                                                    sides[s]->parts_of_group_words[g][0].end());
      words_of_side.insert(sides[s]->parts_of_group_words[g][1].begin(),
                           sides[s]->parts_of_group_words[g][1].end());
      words_of_side.insert(sides[s]->part_of[g]);
      for (const std::string& part : words_of_side) ++word_uses[part].groups[s];
    }
  }
  std::uint64_t groups_paired_by_word = 0;
  std::string example;
  for (NamedGroups* const side : sides) {
    for (std::size_t i = 0; i < side->used.size(); ++i) {
      const std::size_t g = side->used_groups[i];
      if (word_uses[side->part_of[g]].are_both_used()) continue;
      const std::string* best = nullptr;
      for (const std::vector<std::string>& parts_of_group_words : side->parts_of_group_words[g]) {
        for (const std::string& word : parts_of_group_words) {
          if (!word_uses[word].are_both_used()) continue;
          const auto rank = [&](const std::string& w) { return std::pair(word_uses[w].all(), w); };
          if (best == nullptr || rank(word) < rank(*best)) best = &word;
        }
        if (best == nullptr) continue;
        if (&parts_of_group_words == &side->parts_of_group_words[g][1] &&
            groups_paired_by_word++ == 0) {
          example = kiln::quote_name(side->used[i]) + " by " + kiln::quote_name(*best);
        }
        break;
      }
      if (best != nullptr) side->part_of[g] = side->parts_of_used[i] = *best;
    }
  }
  if (groups_paired_by_word == 0) return;
  warnings.push_back({"parts-by-word",
                      counted(groups_paired_by_word, "group") + " of several names (`g A B`) " +
                          (groups_paired_by_word == 1 ? "was" : "were") +
                          " paired by one of the names, which no pattern matches: " + example +
                          (groups_paired_by_word == 1
                               ? ". If that is wrong, give it another name, or a list."
                               : " for one. Where that is wrong, give them other names, or a "
                                 "list."),
                      groups_paired_by_word});
}

/// A pattern for each mesh. Together they map two names to the same part.
struct PatternPair {
  std::string low, high;
  auto operator<=>(const PatternPair&) const = default;
};

/// Makes pairs of patterns from the common prefix and from the common suffix of two names. Each gives two pairs: in
/// one, * stands for all of it, in the other for its whole words only. Names of parts have at least two letters.
std::vector<PatternPair> patterns_of(std::string_view low, std::string_view high) {
  constexpr std::string_view kWordSeparators = "_-. ";
  const auto head = static_cast<std::size_t>(
      std::mismatch(low.begin(), low.end(), high.begin(), high.end()).first - low.begin());
  const auto tail = static_cast<std::size_t>(
      std::mismatch(low.rbegin(), low.rend(), high.rbegin(), high.rend()).first - low.rbegin());
  std::vector<PatternPair> patterns;
  const std::string_view first = low.substr(0, head), last = low.substr(low.size() - tail);
  for (const std::size_t end : {first.size(), first.find_last_of(kWordSeparators)}) {
    // The separator belongs to the suffix, not to the name.
    const std::size_t name = first.substr(0, end).find_last_not_of(kWordSeparators) + 1;
    if (end > head || name < 2) continue;
    patterns.push_back({"*" + std::string(low.substr(name)), "*" + std::string(high.substr(name))});
  }
  for (const std::size_t begin : {std::size_t{0}, last.find_first_of(kWordSeparators)}) {
    const std::size_t at = last.find_first_not_of(kWordSeparators, begin);
    if (at == std::string_view::npos || tail - at < 2) continue;
    const std::size_t name = tail - at;
    patterns.push_back({std::string(low.substr(0, low.size() - name)) + "*",
                        std::string(high.substr(0, high.size() - name)) + "*"});
  }
  return patterns;
}

std::size_t count_pairs_by(const PartNames& names, const NamedGroups& low,
                           const NamedGroups& high) {
  const PartNamer part_name(names);
  std::unordered_set<std::string> parts;
  for (const std::string& name : high.used) parts.insert(part_name(name, PartSide::high));
  return static_cast<std::size_t>(std::count_if(
      low.used.begin(), low.used.end(),
      [&](const std::string& name) { return parts.contains(part_name(name, PartSide::low)); }));
}

/// Describes patterns that would pair more groups of the low poly; empty if there are none. Each unpaired name and its
/// most similar name suggest patterns; the result is the patterns that fit most of these pairs.
Message suggest_name_patterns(const PartNames& names, const NamedGroups& low,
                              const NamedGroups& high,
                              const std::map<std::string, std::uint32_t>& pairs) {
  if (names.by != PartsBy::name) return {};
  std::map<PatternPair, std::size_t> pattern_votes;
  std::size_t sampled_names = 0, paired_groups = 0;
  for (std::size_t g = 0; g < low.used.size(); ++g) {
    if (pairs.contains(low.parts_of_used[g])) {
      ++paired_groups;
      continue;
    }
    if (++sampled_names > kMaxSampledNames || low.used[g].size() > kMaxNameLength) continue;
    const std::string* similar_name = most_similar_name(low.used[g], high.used);
    if (similar_name == nullptr || similar_name->size() > kMaxNameLength) continue;
    for (const PatternPair& patterns : patterns_of(low.used[g], *similar_name))
      ++pattern_votes[patterns];
  }
  std::vector<std::pair<std::size_t, PatternPair>> pattern_guesses;
  for (const auto& [patterns, count] : pattern_votes) pattern_guesses.emplace_back(count, patterns);
  std::sort(pattern_guesses.rbegin(), pattern_guesses.rend());
  if (pattern_guesses.size() > kMaxPatternGuesses) pattern_guesses.resize(kMaxPatternGuesses);
  // If several patterns fit equally many pairs, the most specific one is chosen.
  std::tuple<std::size_t, std::size_t, PatternPair> best;
  for (const auto& [count, patterns] : pattern_guesses) {
    const std::size_t pair_count = count_pairs_by({{patterns.low}, {patterns.high}}, low, high);
    const std::size_t pattern_length = patterns.low.size() + patterns.high.size();
    best = std::max(best, std::tuple(pair_count, pattern_length, patterns));
  }
  const auto& [pair_count, pattern_length, patterns] = best;
  if (pair_count <= paired_groups) return {};
  return " With " + option("part_names.low") + " '" + patterns.low + "' and " +
         option("part_names.high") + " '" + patterns.high + "' " + std::to_string(pair_count) +
         " of " + std::to_string(low.used.size()) + " would have a pair.";
}

/// Adds a warning that lists names of unpaired groups.
void warn(PartSide side, const NamedGroups& groups, PartsBy by, const NamedGroups& others,
          const std::map<std::string, std::uint32_t>& pairs, const Message& remedy,
          std::vector<Warning>& warnings) {
  std::string list;
  std::size_t count = 0;
  for (std::size_t g = 0; g < groups.used.size(); ++g) {
    if (pairs.contains(groups.parts_of_used[g])) continue;
    if (++count > kMaxNamesInWarning) continue;
    list += (count == 1 ? "" : ", ") + quote_name(groups.used[g]);
    const std::string* similar_name = most_similar_name(groups.used[g], others.used);
    if (similar_name != nullptr) list += " (nearest: " + quote_name(*similar_name) + ")";
  }
  if (count == 0) return;
  if (count > kMaxNamesInWarning)
    list += " and " + std::to_string(count - kMaxNamesInWarning) + " more";
  std::string kind = name_kind_of(by).one;
  kind[0] = static_cast<char>(kind[0] - 'a' + 'A');
  warnings.push_back({"unmatched-parts",
                      kind + "s of the " + (side == PartSide::low ? "low" : "high") +
                          " poly without a pair" +
                          (by == PartsBy::list ? " in the list: " : " of their name: ") + list +
                          ". Parts without a pair are matched together, as one." + remedy,
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
  const PartNamer part_name(names);
  NamedGroups part_of_high_name(high, names, part_name, PartSide::high);
  NamedGroups part_of_low_name(low, names, part_name, PartSide::low);
  for (const auto& [groups, mesh] :
       {std::pair(&part_of_low_name, &low), std::pair(&part_of_high_name, &high)}) {
    if (groups->used.empty()) {
      throw Error(ErrorCode::input,
                  "'" + mesh->name + "' has no triangles: there are no parts to pair.");
    }
  }
  Parts parts;
  pair_by_words(part_of_low_name, part_of_high_name, parts.warnings);
  const std::unordered_set<std::string> high_parts(part_of_high_name.parts_of_used.begin(),
                                                   part_of_high_name.parts_of_used.end());
  std::map<std::string, std::uint32_t> pairs;
  for (const std::string& part : part_of_low_name.parts_of_used) {
    if (high_parts.contains(part)) pairs.emplace(part, 0);
  }
  const Message remedy = suggest_name_patterns(names, part_of_low_name, part_of_high_name, pairs);
  if (pairs.empty()) {
    const std::string& name = part_of_low_name.used.front();
    const std::string* similar_name = most_similar_name(name, part_of_high_name.used);
    throw Error(
        ErrorCode::input,
        "No " + std::string(name_kind_of(names.by).one) +
            (names.by == PartsBy::list ? " of the low poly has a pair in the list: "
                                       : " of the low poly has its name in the high poly: ") +
            quote_name(name) + " is " +
            (similar_name != nullptr ? "nearest to " + quote_name(*similar_name)
                                     : "similar to no name of the high poly, such as " +
                                           kiln::quote_name(part_of_high_name.used.front())) +
            "." +
            (names.by == PartsBy::name && remedy.empty()
                 ? " " + option("part_names.low") + " and " + option("part_names.high") +
                       " say which belong together."
                 : remedy));
  }
  for (auto& [name, part] : pairs) {
    part = parts.count++;
    parts.names.push_back(name);
  }
  bool has_unpaired = false;
  const auto number = [&](const NamedGroups& groups) {
    const auto none = static_cast<std::uint32_t>(pairs.size());
    std::vector<std::uint32_t> part_of;
    for (const std::string& part : groups.part_of) {
      const auto pair = pairs.find(part);
      part_of.push_back(pair == pairs.end() ? none : pair->second);
    }
    std::vector<std::uint32_t> result;
    result.reserve(groups.of->size());
    for (const std::uint32_t group : *groups.of) {
      result.push_back(part_of[group]);
      has_unpaired = has_unpaired || part_of[group] == none;
    }
    return result;
  };
  parts.low = number(part_of_low_name);
  parts.high = number(part_of_high_name);
  if (has_unpaired) {
    ++parts.count;
    parts.names.emplace_back();
  }
  warn(PartSide::low, part_of_low_name, names.by, part_of_high_name, pairs, remedy, parts.warnings);
  warn(PartSide::high, part_of_high_name, names.by, part_of_low_name, pairs, "", parts.warnings);
  return parts;
}

}  // namespace kiln
