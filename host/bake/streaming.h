// What a bake can do with a high poly that is larger than memory.
#pragma once

#include "kiln/bake.h"
#include "kiln/message.h"

namespace kiln {

/// Names the first requested feature that needs the whole high poly in memory, in a sentence with its remedy; empty if
/// there is none.
Message streaming_obstacle(const BakeOptions& options);

/// \throws Error(usage) if there is an obstacle
void refuse_streaming(const BakeOptions& options);

}  // namespace kiln
