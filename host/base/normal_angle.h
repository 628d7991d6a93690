// Angles between normals stored as n/2 + 1/2.
#pragma once

#include <cstdint>
#include <vector>

namespace kiln {

/// Degrees between two decoded normals: atan2(|a x b|, a . b) in double precision. Vectors shorter than 0.01 count as
/// zero. Both zero: 0; one zero: 180. Non-finite values that differ: 180.
double normal_angle_degrees(const float* texel_a, const float* texel_b);

/// The nearest-rank percentile: the smallest value that at least this many hundredths of all values do not exceed.
/// Reorders.
/// \param values  not empty
double percentile(std::vector<double>& values, std::uint64_t hundredths);

}  // namespace kiln
