// Measures which choices of a device are the fastest: who builds BVHs, and work-group sizes.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "cl/context.h"
#include "cl/tuning.h"

namespace kiln::tune {

/// A BVH of the sample mesh, built by the host and by the device. Seconds are the least of several runs.
struct BuildTrial {
  std::uint64_t triangles = 0;
  double host_build = 0;          ///< Time to build and to upload the tree
  double host_rays = 0;           ///< A bake's rays, of texels and of occlusion, on the host's tree
  bool can_device_build = false;  ///< False: the device has too little memory
  double device_build = 0;        ///< Time to upload the mesh and to build
  double device_rays = 0;         ///< The same rays on the device's tree
  bool is_device_faster() const;
};

/// A kernel with several work-group sizes.
struct GroupTrial {
  std::string key;   ///< Of the tuning's file, such as "ray_group"
  std::string name;  ///< For people, such as "rays of texels"
  std::uint32_t cl::Tuning::*member = nullptr;
  std::vector<std::uint32_t> sizes;  ///< 0: the default
  std::vector<double> seconds;       ///< Per size
  std::uint32_t best = 0;
};

struct Result {
  cl::Tuning tuning;
  std::vector<BuildTrial> builds;  ///< By falling number of triangles
  std::vector<GroupTrial> groups;
};

/// The smallest number of triangles from which the device builds faster in all trials; Tuning::kNever if it does not
/// for the largest.
std::uint64_t choose_min_triangles(const std::vector<BuildTrial>& trials);

/// The size with the fewest seconds, if it gains enough over the default (the first) to be no noise; else 0.
std::uint32_t choose_group(const GroupTrial& trial);

/// Measures a device by a wavy sphere. Nothing else should use the device meanwhile. The context's tuning is unchanged
/// afterwards, even if this throws.
/// \param triangles  of the largest mesh, which also decide the number of rays: at least two per triangle
/// \param progress  called before each trial with its name
Result measure(cl::Context& context, std::uint64_t triangles,
               const std::function<void(std::string_view)>& progress);

}  // namespace kiln::tune
