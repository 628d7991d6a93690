// Self-test: checks that a device computes Kiln's operations exactly.
#pragma once

#include <string>

#include "cl/context.h"

namespace kiln::ocl {

/// Runs the self-test (kernels/cl/selftest.cl). \returns a part of a message that names the wrong results;
/// empty if there are none
///
/// Results are compared with the host's arithmetic, and rays with a scene whose results are exact. Division and square
/// root are exempt if the device reports that they are not correctly rounded.
/// \param extra_options compiler options by which a test makes a device compute wrong results
std::string selftest_fault(Context& context, const std::string& extra_options = {});

}  // namespace kiln::ocl
