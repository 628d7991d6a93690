// Included before every source of a shared library that Clang builds. Clang takes a namespace's visibility for
// the declarations in that block alone, so a function that a public header declares would be hidden by its
// definition in a source's plain `namespace kiln`. This pragma marks the declarations themselves, and
// definitions inherit that. GCC needs none of it.
#pragma once

#include "kiln/export.h"
#undef KILN_PUBLIC
#define KILN_PUBLIC  // a namespace's own attribute would end the pragma's effect in it

#pragma GCC visibility push(default)
#include "kiln/kiln.h"
#include "kiln/assess.h"
#include "kiln/contour.h"
#include "kiln/depth.h"
#include "kiln/gradient.h"
#include "kiln/height_field.h"
#include "kiln/layout.h"
#include "kiln/measure.h"
#include "kiln/normals.h"
#include "kiln/plan.h"
#include "kiln/render.h"
#include "kiln/simplify.h"
#include "kiln/texture_sets.h"
#include "kiln/unwrap.h"
#include "kiln/volume.h"
#include "kiln/opencl.h"
#pragma GCC visibility pop
