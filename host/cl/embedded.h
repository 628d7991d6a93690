// The kernels' sources, embedded at build time by cmake/EmbedKernel.cmake.
#pragma once

#include <string_view>

namespace kiln::ocl {

/// The flattened source of kernels/<family>.cl in consecutive pieces, ended by a null pointer; null if there is no such
/// family. Pieces are short, since compilers limit the length of literals.
const char* const* embedded_pieces(std::string_view family);

/// The flattened source of kernels/<family>.cl, with #line directives; empty if there is no such family. It is joined
/// at its first use, and valid for the rest of the program. Thread-safe.
std::string_view embedded_source(std::string_view family);

}  // namespace kiln::ocl
