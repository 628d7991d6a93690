#include "accel/tune.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <span>

#include "accel/closest.h"
#include "accel/depth_views.h"
#include "accel/device_bvh.h"
#include "accel/raster.h"
#include "accel/ray.h"
#include "base/stopwatch.h"

namespace kiln::tune {
namespace {

// A choice replaces the default if it takes at most this share of its time; repeated runs on an idle machine differ by
// about 2%.
constexpr double kMaxShare = 0.97;
constexpr int kRounds = 3;
// A run is repeated until it has taken this long, since clocks and launches blur shorter ones.
constexpr double kMinSeconds = 0.02;
// Rays are those of a square map with at least this many texels per triangle of the largest mesh, within limits of its
// side. Its texels are visited in tiles, as in bakes.
constexpr double kTexelsPerTriangle = 2;
constexpr std::uint32_t kMinMapSize = 64, kMaxMapSize = 2048, kTile = 8;
constexpr std::uint32_t kViews = 8;
// Each mesh of the builders' trial has a quarter of the triangles of the one before.
constexpr int kBuildTrials = 4;
constexpr double kRadius = 0.4, kWaves = 0.01;

struct SampleMesh {
  std::vector<Vec3> positions;
  std::vector<Triangle> triangles;
};

/// A sphere with waves of about 30 periods around it.
SampleMesh make_mesh(std::uint64_t triangles) {
  const auto rows = static_cast<std::uint32_t>(
      std::max(4.0, std::round(std::sqrt(static_cast<double>(triangles) / 4))));
  const std::uint32_t columns = 2 * rows;
  SampleMesh mesh;
  for (std::uint32_t row = 0; row <= rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const double latitude = std::numbers::pi * row / rows;
      const double longitude = 2 * std::numbers::pi * column / columns;
      const double radius = kRadius + kWaves * std::sin(30 * latitude) * std::cos(30 * longitude) *
                                          std::sin(latitude);
      mesh.positions.push_back(
          {static_cast<float>(radius * std::sin(latitude) * std::cos(longitude)),
           static_cast<float>(radius * std::sin(latitude) * std::sin(longitude)),
           static_cast<float>(radius * std::cos(latitude))});
    }
  }
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      const std::uint32_t next = (column + 1) % columns;
      const std::uint32_t a = row * columns + column, b = (row + 1) * columns + column,
                          c = (row + 1) * columns + next, d = row * columns + next;
      if (row + 1 < rows) mesh.triangles.push_back({a, b, c});
      if (row != 0) mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

/// Samples of a map of the sphere, ordered by tiles as in a bake. Their directions are the sphere's normals.
/// \param occlusion true: above the surface, with directions all over the hemisphere
cl::Array<float> make_samples(cl::Context& context, std::uint32_t map_size, bool occlusion) {
  const std::uint32_t count = map_size * map_size;
  std::vector<float> planes(std::size_t{7} * count);
  std::uint32_t sample = 0, random = 1;
  const auto unit = [&] {
    random = random * 1664525U + 1013904223U;
    return static_cast<double>(random >> 8) * 0x1p-24;
  };
  for (std::uint32_t tile = 0; tile < count / (kTile * kTile); ++tile) {
    for (std::uint32_t texel = 0; texel < kTile * kTile; ++texel, ++sample) {
      const std::uint32_t x = tile % (map_size / kTile) * kTile + texel % kTile;
      const std::uint32_t y = tile / (map_size / kTile) * kTile + texel / kTile;
      const double longitude = 2 * std::numbers::pi * (x + 0.5) / map_size;
      const double z = 1 - 2 * (y + 0.5) / map_size, width = std::sqrt(1 - z * z);
      const std::array<double, 3> normal{width * std::cos(longitude), width * std::sin(longitude),
                                         z};
      std::array<double, 3> direction = normal;
      if (occlusion) {
        // The normal plus a point of the unit sphere is distributed by the cosine.
        const double up = 2 * unit() - 1, turn = 2 * std::numbers::pi * unit();
        const double across = std::sqrt(1 - up * up);
        direction[0] += across * std::cos(turn);
        direction[1] += across * std::sin(turn);
        direction[2] += up;
        const double length = std::max(1e-6, std::hypot(direction[0], direction[1], direction[2]));
        for (double& part : direction) part /= length;
      }
      const double radius = kRadius + (occlusion ? kWaves / 2 : 0);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        planes[axis * count + sample] = static_cast<float>(radius * normal[axis]);
        planes[(3 + axis) * count + sample] = static_cast<float>(direction[axis]);
      }
    }
  }
  return {context, std::span<const float>(planes)};
}

/// Seconds of a run, repeated up to kMinSeconds.
double time_run(cl::Context& context, const std::function<void()>& run) {
  context.finish();
  const Stopwatch watch;
  int runs = 0;
  do {
    run();
    context.finish();
    ++runs;
  } while (watch.total() < kMinSeconds);
  return watch.total() / runs;
}

/// Restores a context's tuning at the end of a scope.
class TuningScope {
 public:
  explicit TuningScope(cl::Context& context) : context_(context), before_(context.tuning()) {}
  ~TuningScope() { context_.set_tuning(before_); }
  TuningScope(const TuningScope&) = delete;
  TuningScope& operator=(const TuningScope&) = delete;

 private:
  cl::Context& context_;
  cl::Tuning before_;
};

class Measurement {
 public:
  Measurement(cl::Context& context, std::uint32_t map_size)
      : context_(context),
        count_(map_size * map_size),
        samples_(make_samples(context, map_size, /*occlusion=*/false)),
        occlusion_samples_(make_samples(context, map_size, /*occlusion=*/true)),
        result_(context, count_),
        hit_(context, count_) {}

  BuildTrial try_builders(std::uint64_t triangles) {
    const SampleMesh mesh = make_mesh(triangles);
    BuildTrial trial;
    trial.triangles = mesh.triangles.size();
    trial.host_build = trial.host_rays = trial.device_build = trial.device_rays =
        std::numeric_limits<double>::infinity();
    for (int round = -1; round < kRounds; ++round) {
      for (const bool on_device : {false, true}) {
        cl::Tuning tuning;
        if (on_device) tuning.min_device_build_triangles = 0;
        context_.set_tuning(tuning);
        std::shared_ptr<const Tree> tree;
        const double build = time_run(context_, [&] {
          tree = std::make_shared<Tree>(context_, mesh.positions, mesh.triangles);
        });
        if (on_device) trial.can_device_build = tree->stats.built_on_device;
        const double rays = time_run(context_, [&] {
          cast_texel_rays(tree, mesh.triangles.size());
          cast_occlusion_rays(tree);
        });
        if (round < 0) continue;  // the first round compiles the kernels
        double& least_build = on_device ? trial.device_build : trial.host_build;
        double& least_rays = on_device ? trial.device_rays : trial.host_rays;
        least_build = std::min(least_build, build);
        least_rays = std::min(least_rays, rays);
      }
    }
    return trial;
  }

  GroupTrial try_groups(const std::string& key, const std::string& name,
                        std::uint32_t cl::Tuning::*member, const std::vector<std::uint32_t>& sizes,
                        const std::function<void()>& run) {
    GroupTrial trial{key, name, member, {0}, {}, 0};
    trial.sizes.insert(trial.sizes.end(), sizes.begin(), sizes.end());
    trial.seconds.assign(trial.sizes.size(), std::numeric_limits<double>::infinity());
    // Rounds are interleaved, so that a slow moment of the machine hits all sizes.
    for (int round = -1; round < kRounds; ++round) {
      for (std::size_t i = 0; i < trial.sizes.size(); ++i) {
        cl::Tuning tuning;
        tuning.*member = trial.sizes[i];
        context_.set_tuning(tuning);
        if (round < 0) {
          run();
        } else {
          trial.seconds[i] = std::min(trial.seconds[i], time_run(context_, run));
        }
      }
    }
    trial.best = choose_group(trial);
    return trial;
  }

  std::vector<GroupTrial> try_all_groups(std::uint64_t triangles,
                                         const std::function<void(std::string_view)>& progress) {
    const SampleMesh mesh = make_mesh(triangles);
    context_.set_tuning({});
    const auto tree = std::make_shared<const Tree>(context_, mesh.positions, mesh.triangles);
    const ClosestFinder finder(context_, tree);
    Rasterizer rasterizer(context_, mesh.positions, mesh.triangles);
    const ViewArea area{{}, rasterizer.radius()};
    const auto view_size = static_cast<std::uint32_t>(std::sqrt(count_));
    const kiln_view view = make_view({0, 0, 1}, area.radius, view_size);
    const DepthKeys keys(context_, DepthKeys::count(view_size, view_size));
    const DepthViews views(context_, rasterizer, spread_directions(kViews), view_size, false, area);
    const cl::Array<float> score(context_, count_);
    // On CPUs a work-item of rays, of nearest points and of pictures handles many samples.
    const bool is_gpu = context_.info().is_gpu;
    const std::vector<std::uint32_t> waves{32, 64, 128, 256};
    std::vector<GroupTrial> trials;
    const auto add =
        [&](const std::string& key, const std::string& name, std::uint32_t cl::Tuning::*member,
            const std::vector<std::uint32_t>& processor_sizes, const std::function<void()>& run) {
          progress(name);
          trials.push_back(try_groups(key, name, member, is_gpu ? waves : processor_sizes, run));
        };
    add("ray_group", "rays of texels", &cl::Tuning::ray_group, {8, 16, 32},
        [&] { cast_texel_rays(tree, mesh.triangles.size()); });
    add("closest_group", "nearest points", &cl::Tuning::closest_group, {4, 8, 32},
        [&] { finder.find(samples_, count_ / 4, count_, {.max_distance = 0.1F}, result_); });
    add("occlusion_group", "occlusion", &cl::Tuning::occlusion_group, {1, 8, 16},
        [&] { cast_occlusion_rays(tree); });
    // On CPUs a work-item draws a whole tile in private memory, so groups of more than one would overflow stacks.
    if (is_gpu) {
      add("raster_group", "depth views", &cl::Tuning::raster_group, {},
          [&] { rasterizer.draw(std::span(&view, 1), keys); });
    }
    add("view_group", "match by views", &cl::Tuning::view_group, {8, 16, 32}, [&] {
      DepthViews::reset(context_, count_, score, result_);
      views.match(samples_, count_, count_, {.max_distance = 0.1F, .area = area}, score, result_);
    });
    return trials;
  }

 private:
  void cast_texel_rays(const std::shared_ptr<const Tree>& tree, std::size_t triangles) {
    RayCaster(context_, tree)
        .intersect(samples_, count_, count_,
                   {.t_min = -0.1F,
                    .t_max = 0.1F,
                    .outward_first = true,
                    .triangles_per_ray = static_cast<double>(triangles) / count_},
                   result_);
  }
  void cast_occlusion_rays(const std::shared_ptr<const Tree>& tree) {
    RayCaster(context_, tree)
        .occluded(occlusion_samples_, count_, count_,
                  {.t_min = 1e-4F, .t_max = 1, .two_sided = true}, hit_);
  }

  cl::Context& context_;
  std::uint32_t count_;  ///< Samples
  cl::Array<float> samples_;
  cl::Array<float> occlusion_samples_;
  DeviceCorrespondence result_;
  cl::Array<std::uint8_t> hit_;
};

}  // namespace

bool BuildTrial::is_device_faster() const {
  return can_device_build && device_build + device_rays <= kMaxShare * (host_build + host_rays);
}

std::uint64_t choose_min_triangles(const std::vector<BuildTrial>& trials) {
  std::uint64_t least = cl::Tuning::kNever;
  for (const BuildTrial& trial : trials) {
    if (!trial.is_device_faster()) break;
    least = trial.triangles;
  }
  return least;
}

std::uint32_t choose_group(const GroupTrial& trial) {
  const auto best = std::min_element(trial.seconds.begin(), trial.seconds.end());
  if (best == trial.seconds.end() || !(*best <= kMaxShare * trial.seconds.front())) return 0;
  return trial.sizes[static_cast<std::size_t>(best - trial.seconds.begin())];
}

Result measure(cl::Context& context, std::uint64_t triangles,
               const std::function<void(std::string_view)>& progress) {
  const TuningScope scope(context);
  const auto side = static_cast<std::uint32_t>(std::min(
      std::sqrt(kTexelsPerTriangle * static_cast<double>(triangles)), double{kMaxMapSize}));
  Measurement measurement(context, std::clamp(std::bit_ceil(side), kMinMapSize, kMaxMapSize));
  Result result;
  std::uint64_t count = triangles;
  for (int i = 0; i < kBuildTrials; ++i, count /= 4) {
    progress("BVH of " + std::to_string(count) + " triangles");
    result.builds.push_back(measurement.try_builders(count));
  }
  result.tuning.min_device_build_triangles = choose_min_triangles(result.builds);
  result.groups = measurement.try_all_groups(triangles, progress);
  for (const GroupTrial& trial : result.groups) {
    result.tuning.*trial.member = trial.best;
  }
  return result;
}

}  // namespace kiln::tune
