/// \file
/// Kiln bakes the detail of high polys into the textures of low polys. This header is the core: devices, meshes,
/// sources, matches, maps, bakes, images, errors. By name:
/// - a whole `kiln bake` in one call: job.h; its options as text and JSON: options.h; errors about them, and
///   their names in messages: option_error.h
/// - low polys: clean.h, simplify.h, normals.h, unwrap.h, cage.h, height_field.h
/// - files: asset.h (glTF and OBJ with their maps), files.h (atomic output of several files), material.h (materials
///   and pictures of meshes), texture_sets.h (and UDIM)
/// - bakes: mesh_view.h (meshes in the caller's memory), session.h (repeated bakes of changing meshes), attribute.h
///   (the caller's own values), reasons.h (misses)
/// - volumes: volume.h, contour.h, gradient.h
/// - measures and plans: render.h, measure.h, layout.h, assess.h, plan.h
/// - opencl.h, which needs OpenCL's headers, and kiln_c.h, for C
#pragma once

#include "kiln/bake.h"
#include "kiln/device.h"
#include "kiln/error.h"
#include "kiln/export.h"
#include "kiln/image.h"
#include "kiln/limits.h"
#include "kiln/map.h"
#include "kiln/match.h"
#include "kiln/mesh.h"
#include "kiln/progress.h"
#include "kiln/source.h"
#include "kiln/texture.h"
#include "kiln/types.h"
#include "kiln/validate.h"
#include "kiln/version.h"
