// Normals stored as n/2 + 1/2, compared.
#pragma once

#include <cstdint>
#include <vector>

namespace kiln {

/// Degrees between two decoded normals: atan2(|a x b|, a . b) in double precision. Both zero: 0; one
/// zero: 180; shorter than 0.01 counts as zero. Not finite in one only, or differently: 180.
double normal_angle_degrees(const float* texel_a, const float* texel_b);

/// The value of nearest rank: the smallest that at least so many hundredths of all do not exceed. Reorders.
/// \param values  not empty
double percentile(std::vector<double>& values, std::uint64_t hundredths);

}  // namespace kiln
