// Self-test: checks that a device computes Kiln's operations exactly.
#pragma once

#include <string>

#include "cl/context.h"

namespace kiln::ocl {

/// Runs the self-test (kernels/cl/selftest.cl). \returns a message part naming the wrong results; empty: none
///
/// Results are compared with the host's arithmetic, and rays with a scene whose results are exact. Division and square
/// root are exempt if the device reports that they are not correctly rounded.
/// \param more  compiler options, by which a test makes a device compute wrongly
std::string selftest_fault(Context& context, const std::string& more = {});

}  // namespace kiln::ocl
