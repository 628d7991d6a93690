// Guesses for a word that is not known.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "kiln/map.h"
#include "kiln/match.h"

namespace kiln {

/// The map that a word names, as Kiln or another baker calls it: "ao", "bent-normals", "height map".
/// Null: no map.
const MapInfo* map_called(const std::string& word);
/// The match that a word names. Null: no match.
const MatchInfo* match_called(const std::string& word);

/// Letters to change, add, leave out or swap with the next to get from one word to another (Damerau 1964).
std::size_t edits(const std::string& a, const std::string& b);

/// The one of `words` that is nearest by letters, or that other bakers call so; empty where none is near.
std::string nearest_word(const std::string& word, const std::vector<std::string>& words);

/// "'cavity' is not one of its values; did you mean curvature? Give normal, ao or mask".
std::string not_one_of(const std::string& word, const std::vector<std::string>& words);

}  // namespace kiln
