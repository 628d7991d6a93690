// Angles between normals that are stored as n/2 + 1/2.
#pragma once

#include <cstdint>
#include <vector>

namespace kiln {

/// Degrees between two decoded normals: atan2(|a x b|, a . b) in double precision. Vectors shorter than 0.01 count as
/// zero. The angle is 0 between two zero vectors, 180 between a zero vector and another one, and 180 for non-finite
/// values that differ.
double normal_angle_degrees(const float* texel_a, const float* texel_b);

/// The nearest-rank percentile: the smallest value that at least this many hundredths of all values do not exceed.
/// Reorders `values`.
/// \param values  not empty
double percentile(std::vector<double>& values, std::uint64_t hundredths);

}  // namespace kiln
