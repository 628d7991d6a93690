// What was meant by a word that is not known.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace kiln::cli {

/// Letters to change, add or leave out to get from one word to another (Levenshtein 1966).
std::size_t edits(const std::string& a, const std::string& b);

/// The one of `words` that is nearest by letters, or that other bakers call so; empty where none is near.
std::string nearest_word(const std::string& word, const std::vector<std::string>& words);

/// "'cavity' is none of its values; did you mean curvature? Give normal, ao or mask".
std::string not_one_of(const std::string& word, const std::vector<std::string>& words);

}  // namespace kiln::cli
