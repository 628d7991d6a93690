// What a bake can do with a high poly that is larger than memory.
#pragma once

#include "kiln/bake.h"
#include "kiln/message.h"

namespace kiln {

/// What a bake asks for that needs the whole high poly in memory, as a sentence with its remedy; empty: nothing.
Message streaming_obstacle(const BakeOptions& options);

/// \throws Error(usage) if there is an obstacle
void refuse_streaming(const BakeOptions& options);

}  // namespace kiln
