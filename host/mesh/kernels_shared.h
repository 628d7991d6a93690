// Includes the structs that host and kernels share.
#pragma once

#include "shared/assess.h"
#include "shared/common.h"
#include "shared/detail.h"
#include "shared/match.h"
#include "shared/raster.h"
#include "shared/render.h"
#include "shared/texel.h"
#include "shared/views.h"
#include "shared/visibility.h"
