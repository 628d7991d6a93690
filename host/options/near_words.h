// Suggests known words for unknown ones.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "kiln/map.h"
#include "kiln/match.h"

namespace kiln {

/// The map that a word names in Kiln or another baker: "ao", "bent-normals", "height map". Null if there is none.
const MapInfo* find_map_by_word(const std::string& word);
/// The match that a word names in Kiln or another baker. Null if there is none.
const MatchInfo* find_match_by_word(const std::string& word);

/// Edit distance of two words: the number of letters to replace, to insert, to delete, or to swap with the next
/// letter (Damerau 1964).
std::size_t edit_distance(const std::string& a, const std::string& b);

/// The element of `words` that is a synonym of `word` in other bakers, or the nearest by edit distance; empty if no
/// element is near.
std::string nearest_word(const std::string& word, const std::vector<std::string>& words);

/// An error text: "'cavity' is not one of its values; did you mean curvature? Give normal, ao or mask".
std::string unknown_word_error(const std::string& word, const std::vector<std::string>& words);

}  // namespace kiln
