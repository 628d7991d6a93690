// The correspondence on the device, between matching (F) and reading detail (D).
#pragma once

#include <cstdint>

#include "cl/context.h"

namespace kiln {

/// For every sample of a band: the source triangle; the barycentric weights of its corners 1 and 2;
/// the signed distance along the sample's direction (frame units, outward positive); the status.
struct DeviceCorrespondence {
  std::uint32_t count = 0;
  std::uint32_t capacity = 0;         ///< Elements of one plane
  cl::Array<std::uint32_t> triangle;  ///< KILN_NO_TRIANGLE where nothing was found
  cl::Array<float> barycentric;       ///< 2 planes
  cl::Array<float> distance;
  cl::Array<std::uint8_t> status;  ///< kiln_sample_status
  /// Directions of visibility, if asked for: 3 planes, the mean of the directions that see the
  /// sample's place, object space. Empty: not asked for.
  cl::Array<float> seen;

  DeviceCorrespondence() = default;
  DeviceCorrespondence(cl::Context& context, std::uint32_t plane_capacity, bool with_seen = false);
};

}  // namespace kiln
