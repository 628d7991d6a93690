// A match's result on the device, read by the maps.
#pragma once

#include <cstdint>

#include "cl/context.h"

namespace kiln {

/// For every sample of a band: triangle of the high poly, barycentric weights of its corners 1 and
/// 2, signed distance along the sample's direction (frame units, outward positive), and status.
struct DeviceCorrespondence {
  std::uint32_t count = 0;
  std::uint32_t capacity = 0;         ///< Elements of one plane
  cl::Array<std::uint32_t> triangle;  ///< KILN_NO_TRIANGLE for a miss
  /// Two arrays, one after the other: weights of corner 1, then of corner 2
  cl::Array<float> barycentric;
  cl::Array<float> distance;
  cl::Array<std::uint8_t> status;  ///< kiln_sample_status of each sample
  /// Visibility directions, 3 planes: the mean of the directions that see the sample, in object space. Empty if not
  /// requested.
  cl::Array<float> seen;

  DeviceCorrespondence() = default;
  DeviceCorrespondence(cl::Context& context, std::uint32_t plane_capacity, bool with_seen = false);
};

}  // namespace kiln
