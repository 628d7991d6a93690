/// \file
/// Kiln bakes the detail of dense meshes into the textures of light ones. This header includes the
/// whole public API; each part's header documents it.
#pragma once

#include "kiln/assess.h"
#include "kiln/bake.h"
#include "kiln/contour.h"
#include "kiln/depth.h"
#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/gradient.h"
#include "kiln/height_field.h"
#include "kiln/image.h"
#include "kiln/lowpoly.h"
#include "kiln/map.h"
#include "kiln/match.h"
#include "kiln/measure.h"
#include "kiln/memory.h"
#include "kiln/mesh.h"
#include "kiln/plan.h"
#include "kiln/ray.h"
#include "kiln/render.h"
#include "kiln/session.h"
#include "kiln/source.h"
#include "kiln/types.h"
#include "kiln/version.h"
#include "kiln/volume.h"
