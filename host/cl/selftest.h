// Does a device compute, to the bit, what Kiln's kernels need?
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "cl/context.h"

namespace kiln::ocl {

/// What a device computes: KILN_SELFTEST_RESULTS planes of KILN_SELFTEST_ITEMS words (kernels/shared/selftest.h).
/// \param defines  more options of the compiler: a test makes it compute wrongly
std::vector<std::uint32_t> selftest_results(Context& context, const std::string& defines = {});

/// What is wrong with them, for a message; empty: nothing. They are held to the host's own arithmetic, and rays to
/// a scene in which all is exact. Division and root may be of any bits where the device says that they are not exact.
std::string selftest_fault(const DeviceInfo& info, std::span<const std::uint32_t> results);

}  // namespace kiln::ocl
