// Parses a saved match from memory; load_match() reads it from a file.
#pragma once

#include <string>

#include "io/file/bounds.h"
#include "io/file/byte_source.h"
#include "kiln/match.h"

namespace kiln {

/// \param file    file name for messages
/// \param limits  limits on the number of texel samples
/// \throws Error(input) that names the file and the field
Match parse_match(const ByteSource& source, const std::string& file, const ImageLimits& limits);

}  // namespace kiln
