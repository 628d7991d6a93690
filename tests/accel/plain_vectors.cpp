// Code that compilers without vector types run.
#define KILN_PLAIN_VECTORS
#define kiln kiln_plain
#include "accel/vector_results.h"
#undef kiln

std::vector<std::uint64_t> plain_vector_results() { return kiln_plain::vector_results(); }
