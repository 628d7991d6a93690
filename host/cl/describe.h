// Properties of a device, as its driver gives them.
#pragma once

#include "cl/context.h"

namespace kiln {

/// All but its index, which a device that nobody listed has not.
DeviceInfo describe_device(cl_platform_id platform, cl_device_id device);

}  // namespace kiln
