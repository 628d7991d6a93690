// Does a device compute, to the bit, what Kiln's kernels need?
#pragma once

#include <string>

#include "cl/context.h"

namespace kiln::ocl {

/// Runs the self-test (kernels/cl/selftest.cl). \returns what the device computes wrongly, for a message; empty: nothing
///
/// Results are held to the host's own arithmetic, and rays to a scene in which all is exact. Division and root may
/// have any bits where the device says that they are not exact.
/// \param more  options of the compiler: a test makes a device compute wrongly
std::string selftest_fault(Context& context, const std::string& more = {});

}  // namespace kiln::ocl
