// Properties of a device, as its driver gives them, and whether it computes as it should.
#pragma once

#include "cl/context.h"

namespace kiln {

/// All but its index, which a device that nobody listed has not.
DeviceInfo describe_device(cl_platform_id platform, cl_device_id device);

/// \throws Error(device) as Context::require_sound()
Device sound_device(std::shared_ptr<ocl::Context> context);

}  // namespace kiln
