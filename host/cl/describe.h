// Properties of a device as reported by its driver, and a check that it computes correctly.
#pragma once

#include "cl/context.h"

namespace kiln {

/// Returns all properties except the index, which only listed devices have.
DeviceInfo describe_device(cl_platform_id platform, cl_device_id device);

/// Checks and wraps a context. \throws Error(device) as Context::require_correct_results()
Device checked_device(std::shared_ptr<ocl::Context> context);

}  // namespace kiln
