// Lists in text files: parts that belong together (--match-list), views that are likely (--view-weight).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kiln/bake.h"
#include "kiln/match.h"
#include "kiln/message.h"

namespace kiln {

/// Lines LOW = HIGH, HIGH; empty ones and those after # say nothing.
/// \param what  begins the message, such as "--match-list 'pairs.txt'"
/// \throws Error(input) for a line that is none, and where there is no pair
std::vector<PartPair> parse_part_list(const std::string& list, const Message& what);

/// Lines "X Y Z WEIGHT", ended by LF, CR LF or CR: directions from the mesh to the viewer, and how likely
/// each is. Empty lines, and what follows a #, are skipped. At most 65,536 directions.
/// \param name  for messages
/// \throws Error(input) that names the line
std::vector<VisibilityOptions::Likelihood> parse_likelihoods(std::string_view text,
                                                             const std::string& name);

/// The same of a file: a regular one of at most 16 MiB. \throws Error(input)
std::vector<VisibilityOptions::Likelihood> load_likelihoods(const std::string& path);

}  // namespace kiln
