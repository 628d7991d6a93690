// Parsers of text files with lists: pairs of parts (--match-list), weights of views (--view-weight).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kiln/match.h"
#include "kiln/message.h"

namespace kiln {

/// Parses lines LOW = HIGH, HIGH. Empty lines and those that start with # are skipped.
/// \param what  start of the message, such as "--match-list 'pairs.txt'"
/// \throws Error(input) for an invalid line, and if there is no pair
std::vector<PartPair> parse_part_list(const std::string& list, const Message& what);

/// Parses lines "X Y Z WEIGHT" that end with LF, CR LF or CR: a direction from the mesh to the viewer, and its weight.
/// Empty lines, and text after #, are skipped. At most 65,536 directions.
/// \param name  for messages
/// \throws Error(input) that names the line
std::vector<VisibilityOptions::Likelihood> parse_likelihoods(std::string_view text,
                                                             const std::string& name);

/// Reads a file in the format of parse_likelihoods(). It must be a regular file of at most 16 MiB. \throws Error(input)
std::vector<VisibilityOptions::Likelihood> load_likelihoods(const std::string& path);

}  // namespace kiln
