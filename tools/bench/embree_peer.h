// Casts rays by Embree through each of its interfaces, for comparison with Kiln.
#pragma once

#include <embree3/rtcore.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "kiln/types.h"

namespace kiln::bench {

/// Rays as arrays of the components of origins and directions, with a common range of distances.
struct RayPlanes {
  /// 7 planes with `capacity` elements each, as in TexelBand::points
  std::span<const float> planes;
  std::size_t count = 0;
  std::size_t capacity = 0;
  float offset = 0;  ///< Distance by which origins are moved along the direction
  float sign = 1;    ///< 1, or -1 to cast against the direction
  float t_min = 0;
  float t_max = 1;
  bool coherent = true;
};

struct RayResults {
  std::vector<std::uint32_t> triangle;  ///< Index of the hit triangle; KILN_NO_TRIANGLE for misses
  std::vector<float> t, u, v;
};

enum class EmbreeMode { single_ray, packet8, packet16, stream_1m, stream_np };
const char* embree_mode_name(EmbreeMode mode);
inline constexpr EmbreeMode kEmbreeModes[] = {EmbreeMode::single_ray, EmbreeMode::packet8,
                                              EmbreeMode::packet16, EmbreeMode::stream_1m,
                                              EmbreeMode::stream_np};

class EmbreeScene {
 public:
  EmbreeScene(std::span<const Vec3> positions, std::span<const Triangle> triangles, bool robust);
  ~EmbreeScene();
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;

  /// Finds nearest hits, with thread_count() threads over contiguous ranges.
  void intersect(const RayPlanes& rays, EmbreeMode mode, RayResults& results) const;
  /// Finds whether each ray hits anything.
  void occluded(const RayPlanes& rays, EmbreeMode mode, std::vector<std::uint8_t>& hit) const;

  /// Finds nearest points within `t_max` by rtcPointQuery with a callback (embree_point.cpp). If not two-sided, back
  /// faces are skipped. `seeded`: the search radius starts at an upper bound that follows from the previous result, as
  /// in Kiln. Distances are written to `t`.
  void closest(const RayPlanes& rays, bool two_sided, bool seeded, RayResults& results) const;

  double build_seconds() const { return build_seconds_; }
  /// Processor seconds of all threads
  double build_cpu_seconds() const { return build_cpu_seconds_; }

 private:
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  std::vector<std::array<Vec3, 3>> corners_;  ///< Corners of each triangle, for point queries
  double build_seconds_ = 0;
  double build_cpu_seconds_ = 0;
};

}  // namespace kiln::bench
