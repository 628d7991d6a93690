// Correspondences of some samples on the host.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/kernels_shared.h"
#include "texel/device_correspondence.h"

namespace kiln {

struct HostCorrespondence {
  std::vector<std::uint32_t> triangle;
  std::vector<float> u, v, distance;
  std::vector<std::uint8_t> status;

  /// Initialises all samples as misses.
  explicit HostCorrespondence(std::uint32_t count)
      : triangle(count, KILN_NO_TRIANGLE),
        u(count),
        v(count),
        distance(count),
        status(count, KILN_STATUS_MISS) {}

  HostCorrespondence(cl::Context& context, const DeviceCorrespondence& match, std::uint32_t count)
      : HostCorrespondence(count) {
    match.triangle.read(context, triangle);
    match.barycentric.read(context, u);
    match.barycentric.read(context, v, match.capacity);
    match.distance.read(context, distance);
    match.status.read(context, status);
  }

  /// Copies triangle, weights and distance of sample `from` of another correspondence, without its status.
  void take(std::size_t i, const HostCorrespondence& other, std::size_t from) {
    triangle[i] = other.triangle[from];
    u[i] = other.u[from];
    v[i] = other.v[from];
    distance[i] = other.distance[from];
  }

  void write(cl::Context& context, DeviceCorrespondence& match) const {
    match.triangle.write(context, std::span(triangle));
    match.barycentric.write(context, std::span(u));
    match.barycentric.write(context, std::span(v), match.capacity);
    match.distance.write(context, std::span(distance));
    match.status.write(context, std::span(status));
  }
};

}  // namespace kiln
