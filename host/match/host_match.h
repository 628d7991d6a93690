// Some samples' correspondences on the host.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mesh/kernels_shared.h"
#include "texel/correspondence.h"

namespace kiln {

struct HostMatch {
  std::vector<std::uint32_t> triangle;
  std::vector<float> u, v, distance;
  std::vector<std::uint8_t> status;

  /// All missed.
  explicit HostMatch(std::uint32_t count)
      : triangle(count, KILN_NO_TRIANGLE),
        u(count),
        v(count),
        distance(count),
        status(count, KILN_STATUS_MISS) {}

  HostMatch(cl::Context& context, const Correspondence& match, std::uint32_t count)
      : HostMatch(count) {
    match.triangle.read(context, triangle);
    match.barycentric.read(context, u);
    match.barycentric.read(context, v, match.capacity);
    match.distance.read(context, distance);
    match.status.read(context, status);
  }

  /// The point of another one's sample; not its status.
  void take(std::size_t i, const HostMatch& other, std::size_t from) {
    triangle[i] = other.triangle[from];
    u[i] = other.u[from];
    v[i] = other.v[from];
    distance[i] = other.distance[from];
  }

  void write(cl::Context& context, Correspondence& match) const {
    match.triangle.write(context, std::span(triangle));
    match.barycentric.write(context, std::span(u));
    match.barycentric.write(context, std::span(v), match.capacity);
    match.distance.write(context, std::span(distance));
    match.status.write(context, std::span(status));
  }
};

}  // namespace kiln
