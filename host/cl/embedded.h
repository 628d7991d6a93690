// The kernels' sources, embedded at build time by cmake/EmbedKernel.cmake.
#pragma once

#include <string_view>

namespace kiln::ocl {

/// The flattened source of kernels/<family>.cl, with #line directives; empty if there is no such family.
std::string_view embedded_source(std::string_view family);

}  // namespace kiln::ocl
