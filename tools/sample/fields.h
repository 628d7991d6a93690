// Solids as scalar fields, and volumes sampled from them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "kiln/volume.h"
#include "noise.h"

namespace kiln::sample {

/// A field: positive inside the solid, negative outside, zero on the surface. All solids lie within the
/// ball of radius 1 around the origin.
using Field = double (*)(const Point&);

/// Distance to the ball of radius 0.9.
double sphere_field(const Point& p);

/// Distance to the torus around the z axis with radii 0.65 and 0.25.
double torus_field(const Point& p);

/// A sheet along the gyroid, sin x cos y + sin y cos z + sin z cos x = 0 with three periods in two units, cut off at
/// the sphere of radius 0.95. The field equals the distance to the surface to first order.
double gyroid_field(const Point& p);

/// A box with a rotated bar across it, a rotated bar cut out and a step: flat faces, convex and concave sharp edges and
/// corners. The field is a minimum or maximum of distances to boxes, so its zero set is exact.
double boxes_field(const Point& p);

/// The field named "sphere", "torus", "gyroid" or "boxes"; nullopt for other names.
std::optional<Field> field_of(std::string_view name);

/// The value on the surface: 0 for floats, else the middle of the type's range, as 127.5 for u8.
double surface_value(VoxelType type);

/// The field over the cube [-1.1, 1.1]^3, with size^3 voxels (at least 2). Floats store the field itself. Integers
/// store it clamped to 4 voxels on each side of the surface, mapped to the type's whole range.
/// \param type  u8, u16 or f32
/// \throws Error(usage) another type or size
Volume sample_volume(Field field, std::uint32_t size, VoxelType type);

}  // namespace kiln::sample
