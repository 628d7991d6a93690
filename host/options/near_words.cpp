#include "options/near_words.h"

#include <algorithm>
#include <array>
#include <span>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "kiln/map.h"
#include "kiln/match.h"

namespace kiln {
namespace {

/// A synonym in other programs. Synonyms of maps and matches are in the rows of their registries.
struct Alias {
  std::string_view other_word, kiln_word;
};

constexpr std::array kAliases = {
    Alias{"none", "mark"},
    Alias{"keep", "low"},
    Alias{"world", "object"},
    Alias{"png", "png16"},
    Alias{"openexr", "exr"},
    Alias{"hdr", "exr"},
    // Synonyms of commands.
    Alias{"decimate", "simplify"},
    Alias{"reduce", "simplify"},
    Alias{"lowpoly", "simplify"},
    Alias{"compare", "diff"},
    Alias{"view", "render"},
    Alias{"rate", "measure"},
    Alias{"extract", "volume"},
    Alias{"device", "devices"},
    // Synonyms of flags. A flag is only suggested in commands that have it.
    Alias{"azimuth", "view"},
    Alias{"elevation", "view"},
    Alias{"o", "out"},
    Alias{"output", "out"},
    Alias{"output_dir", "out"},
    Alias{"out_dir", "out"},
    Alias{"outdir", "out"},
    Alias{"j", "json"},
    Alias{"report", "json"},
    Alias{"q", "quiet"},
    Alias{"silent", "quiet"},
    Alias{"gpu", "device"},
    Alias{"resolution", "size"},
    Alias{"res", "size"},
    Alias{"ao_map", "occlusion"},
    Alias{"camera", "view"},
    Alias{"threshold", "iso"},
    Alias{"isovalue", "iso"},
    Alias{"iso_value", "iso"},
    Alias{"preserve_uvs", "keep-uvs"},
    Alias{"tolerance", "max-error"},
    Alias{"flip_green", "flip-y"},
    Alias{"margin", "gutter"},
    Alias{"memory", "memory-limit"},
};

bool is_in_word_list(std::string_view word, std::string_view list) {
  for (;;) {
    const std::size_t blank = list.find(' ');
    if (list.substr(0, blank) == word) return true;
    if (blank == std::string_view::npos) return false;
    list.remove_prefix(blank + 1);
  }
}

/// Removes suffixes and prefixes that are not part of a map's name: "height-map" and "render-height" become "height".
std::string canonical_name(const std::string& word) {
  std::string name = word;
  std::replace(name.begin(), name.end(), '-', '_');
  std::replace(name.begin(), name.end(), ' ', '_');
  for (const std::string_view start : {"bake_", "render_"}) {
    if (name.starts_with(start)) name.erase(0, start.size());
  }
  if (name.ends_with("_map")) name.resize(name.size() - 4);
  return name;
}

template <typename Row, typename Name>
const Row* find_named_row(const std::string& word, std::span<const Row> rows, const Name& name_of) {
  std::string name = canonical_name(word);
  const auto find = [&]() -> const Row* {
    for (const Row& row : rows) {
      if (name_of(row) == name || is_in_word_list(name, row.other_names)) return &row;
    }
    return nullptr;
  };
  const Row* const row = find();
  if (row != nullptr || !name.ends_with('s')) return row;
  name.pop_back();
  return find();
}

}  // namespace

const MapInfo* find_map_by_word(const std::string& word) {
  return find_named_row(word, maps(), [](const MapInfo& map) { return map.kind.name; });
}

const MatchInfo* find_match_by_word(const std::string& word) {
  return find_named_row(word, matches(), [](const MatchInfo& match) { return match.method.name; });
}

std::size_t edit_distance(const std::string& a, const std::string& b) {
  // Rows i - 2, i - 1 and i of the table of edit distances between prefixes of both words.
  std::vector<std::size_t> row_before_last, previous_row, row(b.size() + 1);
  for (std::size_t k = 0; k <= b.size(); ++k) row[k] = k;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row_before_last = std::move(previous_row);
    previous_row = row;
    row[0] = i;
    for (std::size_t k = 1; k <= b.size(); ++k) {
      row[k] = std::min({previous_row[k] + 1, row[k - 1] + 1,
                         previous_row[k - 1] + (a[i - 1] == b[k - 1] ? 0 : 1)});
      const bool is_transposition = i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1];
      if (is_transposition) row[k] = std::min(row[k], row_before_last[k - 2] + 1);
    }
  }
  return row[b.size()];
}

std::string nearest_word(const std::string& word, const std::vector<std::string>& words) {
  std::string name = word;
  std::replace(name.begin(), name.end(), '-', '_');
  const auto is_known = [&](std::string_view kiln_word) {
    return std::find(words.begin(), words.end(), kiln_word) != words.end();
  };
  for (const Alias& other : kAliases) {
    if (other.other_word == name && is_known(other.kiln_word)) return std::string(other.kiln_word);
  }
  const MapInfo* const map = find_map_by_word(word);
  if (map != nullptr && is_known(map->kind.name)) return std::string(map->kind.name);
  const MatchInfo* const match = find_match_by_word(word);
  if (match != nullptr && is_known(match->method.name)) return std::string(match->method.name);
  std::string nearest;
  // About two thirds of the letters must agree.
  std::size_t max_distance = std::min<std::size_t>(4, word.size() / 3 + 1);
  for (const std::string& known : words) {
    const std::size_t distance = edit_distance(word, known);
    if (distance < max_distance) {
      max_distance = distance;
      nearest = known;
    }
  }
  return nearest;
}

std::string unknown_word_error(const std::string& word, const std::vector<std::string>& words) {
  const std::string nearest = nearest_word(word, words);
  std::string text =
      word.empty() ? "the value is empty" : "'" + word + "' is not one of its values";
  if (!nearest.empty()) text += "; did you mean " + nearest + "?";
  text += nearest.empty() ? ": give " : " Give ";
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
  }
  return text;
}

}  // namespace kiln
