#include "kiln/plan.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "camera.h"
#include "geometry/vector.h"
#include "kernels_shared.h"
#include "parallel.h"
#include "source.h"
#include "views.h"

namespace kiln {
namespace {

constexpr std::uint32_t kViews = 8;
constexpr std::uint32_t kPixels = 256;
constexpr std::uint32_t kFirstSize = 128;
// Triangles from which on building a hierarchy takes longer than all else.
constexpr std::size_t kMany = 2000000;
// An error this close to what the shape allows is as good as it.
constexpr double kLevel = 1.05;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A box around the dense mesh: frames the same pictures for both meshes.
Mesh box_of(const Source::Impl& source) {
  Vec3d low{1e300, 1e300, 1e300};
  Vec3d high{-1e300, -1e300, -1e300};
  for (const Triangle& triangle : source.triangles) {
    for (const std::uint32_t i : triangle) {
      const Vec3& p = source.positions[i];
      if (!is_finite(p)) continue;
      low = {std::min(low.x, double{p.x}), std::min(low.y, double{p.y}),
             std::min(low.z, double{p.z})};
      high = {std::max(high.x, double{p.x}), std::max(high.y, double{p.y}),
              std::max(high.z, double{p.z})};
    }
  }
  Mesh box;
  box.name = "box";
  box.origin = source.frame.center;
  for (int i = 0; i < 8; ++i) {
    const Vec3d corner = {(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                          (i & 4) != 0 ? high.z : low.z};
    box.positions.push_back(to_float(corner * (1 / source.frame.scale)));
  }
  // Corners are what counts.
  box.triangles = {{0, 1, 2}, {3, 4, 5}, {5, 6, 7}};
  return box;
}

RenderOptions picture_options(const ViewAngles& view, const Mesh& box) {
  RenderOptions options;
  options.size = kPixels;
  options.azimuth_degrees = view.azimuth_degrees;
  options.elevation_degrees = view.elevation_degrees;
  options.samples = 1;
  options.show_normals = true;
  options.frame = &box;
  return options;
}

/// Pictures of the dense mesh's normals from its depth views: no hierarchy is built for them.
std::vector<Image> reference_pictures(const Source::Impl& source, const Mesh& box,
                                      const std::vector<ViewAngles>& views) {
  cl::Context& context = source.device.context();
  Rasterizer& raster = source.raster();
  const CameraTarget target = CameraTarget::of(box);
  const auto keys_a_view = static_cast<std::uint32_t>(DepthKeys::count(kPixels, kPixels));
  const DepthKeys keys(context, std::uint64_t{keys_a_view} * views.size());
  std::vector<kiln_view> drawn;
  for (const ViewAngles& view : views) {
    const Camera camera = Camera::fit(target, picture_options(view, box));
    const Vec3d center =
        (Vec3d(camera.center[0], camera.center[1], camera.center[2]) -
         Vec3d(source.frame.center[0], source.frame.center[1], source.frame.center[2])) *
        source.frame.scale;
    kiln_view to{};
    const auto store = [](const Vec3d& from, kiln_float(&vector)[3]) {
      const Vec3 v = to_float(from);
      vector[0] = v.x;
      vector[1] = v.y;
      vector[2] = v.z;
    };
    store(camera.right, to.right);
    store(camera.up, to.up);
    store(camera.toward, to.toward);
    const double scale = kPixels / (2 * camera.half_side * source.frame.scale);
    to.scale = static_cast<float>(scale);
    to.left = static_cast<float>(kPixels / 2.0 - dot(center, camera.right) * scale);
    to.top = static_cast<float>(kPixels / 2.0 + dot(center, camera.up) * scale);
    to.width = to.height = kPixels;
    to.first = static_cast<std::uint32_t>(drawn.size()) * keys_a_view;
    drawn.push_back(to);
  }
  raster.draw(drawn, keys);
  const std::vector<std::uint32_t> normal_indices =
      source.attributes.normal_indices.download(context);
  const std::vector<float> normals = source.attributes.normals.download(context);
  std::vector<Image> pictures;
  for (const kiln_view& view : drawn) {
    const std::vector<std::uint64_t> picture = keys.picture(context, view);
    Image image{kPixels, kPixels, 3, std::vector<float>(picture.size() * 3)};
    const Vec3d right(view.right[0], view.right[1], view.right[2]);
    const Vec3d up(view.up[0], view.up[1], view.up[2]);
    for (std::size_t i = 0; i < picture.size(); ++i) {
      if (picture[i] == KILN_RASTER_EMPTY) continue;
      const auto triangle = static_cast<std::uint32_t>(picture[i]);
      const double x = (static_cast<double>(i % kPixels) + 0.5 - view.left) / view.scale;
      const double y = (view.top - static_cast<double>(i / kPixels) - 0.5) / view.scale;
      const auto corner = [&](std::size_t k) {
        const Vec3d p(source.positions[source.triangles[triangle][k]]);
        return Vec2{static_cast<float>(dot(p, right) - x), static_cast<float>(dot(p, up) - y)};
      };
      const Vec2 a = corner(0), b = corner(1), c = corner(2);
      const double wa = double{b.x} * c.y - double{b.y} * c.x;
      const double wb = double{c.x} * a.y - double{c.y} * a.x;
      const double wc = double{a.x} * b.y - double{a.y} * b.x;
      Vec3d sum;
      const double weights[3] = {wa, wb, wc};
      for (std::size_t k = 0; k < 3; ++k) {
        const float* n = &normals[3 * std::size_t{normal_indices[3 * std::size_t{triangle} + k]}];
        sum += Vec3d(n[0], n[1], n[2]) * (weights[k] / (wa + wb + wc));
      }
      const double size = length(sum);
      if (!(size > 0)) continue;
      const Vec3 n = to_float(sum * (0.5 / size));
      image.pixels[3 * i] = n.x + 0.5F;
      image.pixels[3 * i + 1] = n.y + 0.5F;
      image.pixels[3 * i + 2] = n.z + 0.5F;
    }
    pictures.push_back(std::move(image));
  }
  return pictures;
}

/// The map as Scene reads it, whatever it is encoded as.
Image decoded(const Image& map, const BakeOptions& options) {
  Image result = map;
  for (std::size_t i = 0; i < result.pixels.size(); i += 3) {
    float* p = &result.pixels[i];
    if (options.raw) {
      for (int c = 0; c < 3; ++c) p[c] = p[c] * 0.5F + 0.5F;
    }
    if (options.two_component) {
      const float x = 2 * p[0] - 1, y = 2 * p[1] - 1;
      p[2] = 0.5F + 0.5F * std::sqrt(std::max(0.0F, 1 - x * x - y * y));
    }
  }
  return result;
}

class Planner {
 public:
  Planner(const Source& source, const Mesh& low, const PlanOptions& options)
      : source_(source), low_(low), options_(options), box_(box_of(source.impl())) {
    for (const Vec3& toward : held_out_views(kViews, spread_views(12))) {
      views_.push_back(view_angles(toward));
    }
    const auto start = std::chrono::steady_clock::now();
    pictures_ = reference_pictures(source.impl(), box_, views_);
    planned_.seconds_measure += seconds_since(start);
  }

  PlannedBake run() {
    const std::vector<MatchMethod> all = methods();
    const double wanted = options_.max_error;
    std::optional<double> first_error;  // of the first method, at the size that others are tried at
    for (const MatchMethod method : all) {
      std::uint32_t size = std::min(kFirstSize, largest());
      double before = 0;
      for (;;) {
        if (!trial(method, size)) return cancelled();
        const double error = planned_.trials.back().error.mean_degrees;
        const bool reached = wanted > 0 && error <= wanted;
        keep_if_better(error, reached);
        if (reached) return finished(wanted);
        // Another method is worth going on with where it does better than the first on a small map.
        if (size >= std::min(2 * kFirstSize, largest()) && method != all.front() &&
            error > *first_error * 0.97) {
          break;
        }
        if (size == std::min(2 * kFirstSize, largest()) && method == all.front()) {
          first_error = error;
        }
        const double floor = before > 0 ? (4 * error - before) / 3 : 0;
        const bool level = before > 0 && error <= floor * kLevel && (wanted == 0 || floor > wanted);
        if (size == largest() || level) {
          if (wanted == 0) return finished(best_error_);
          break;
        }
        const double doubled = 2.0 * size;
        double next = doubled;
        if (before > 0 && wanted > floor) {
          next = std::max(doubled, size * std::sqrt((error - floor) / (wanted - floor)));
        }
        before = next == doubled ? error : 0;
        while (size < largest() && size < next) size = std::min(size * 2, largest());
      }
    }
    return finished(wanted);
  }

 private:
  std::uint32_t largest() const { return std::min(options_.bake.width, options_.bake.height); }

  std::vector<MatchMethod> methods() const {
    if (options_.bake.cage || options_.bake.cage_mesh != nullptr) return {MatchMethod::ray};
    if (source_.impl().triangles.size() > kMany) {
      return {MatchMethod::views, MatchMethod::ray, MatchMethod::hybrid, MatchMethod::visibility,
              MatchMethod::closest};
    }
    return {MatchMethod::ray, MatchMethod::hybrid, MatchMethod::visibility, MatchMethod::closest,
            MatchMethod::views};
  }

  BakeOptions bake_options(MatchMethod method, std::uint32_t size) const {
    BakeOptions bake = options_.bake;
    const double share = static_cast<double>(size) / largest();
    bake.width = static_cast<std::uint32_t>(std::lround(bake.width * share));
    bake.height = static_cast<std::uint32_t>(std::lround(bake.height * share));
    bake.method = method;
    bake.visibility.at = VisibilityAt::vertex;
    const bool same = (method == MatchMethod::ray && bake.fallback == Fallback::ray) ||
                      (method == MatchMethod::closest && bake.fallback == Fallback::closest) ||
                      (method == MatchMethod::views && bake.fallback == Fallback::views);
    if (same) bake.fallback = Fallback::low;
    // How many trials there will be is not known: progress says what is going on.
    if (options_.bake.progress) {
      const std::string stage =
          "trying " + std::to_string(bake.width) + " x " + std::to_string(bake.height);
      bake.progress = [this, stage](double, std::string_view) {
        return options_.bake.progress(0, stage);
      };
    }
    return bake;
  }

  /// Bakes and measures. \returns false where cancelled
  bool trial(MatchMethod method, std::uint32_t size) {
    PlanTrial trial;
    const BakeOptions bake_with = bake_options(method, size);
    const auto start = std::chrono::steady_clock::now();
    BakeResult result = bake(source_, low_, bake_with);
    if (result.cancelled) return false;
    trial.seconds = seconds_since(start);
    const auto measuring = std::chrono::steady_clock::now();
    trial.method = method;
    trial.width = bake_with.width;
    trial.height = bake_with.height;
    const BakeReport& report = result.report;
    trial.missed = report.samples != 0
                       ? static_cast<double>(report.missed) / static_cast<double>(report.samples)
                       : 1;
    const auto normal = std::find_if(result.maps.begin(), result.maps.end(),
                                     [](const BakedMap& m) { return m.kind == MapKind::normal; });
    const Image map = decoded(normal->image, bake_with);
    const Scene scene(source_.impl().device, low_, {&map, bake_with.space, bake_with.flip_y});
    if (planned_.trials.empty()) planned_.without_map = compare(scene, true);
    trial.error = compare(scene, false);
    planned_.trials.push_back(trial);
    last_ = std::move(result);
    planned_.seconds_measure += seconds_since(measuring);
    return true;
  }

  NormalError compare(const Scene& scene, bool ignore_map) const {
    NormalComparison comparison;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      RenderOptions options = picture_options(views_[i], box_);
      options.ignore_map = ignore_map;
      comparison.add(pictures_[i], scene.draw(options));
    }
    return comparison.error();
  }

  /// A larger map must be worth it.
  void keep_if_better(double error, bool reached) {
    if (!reached && best_error_ > 0 && error > best_error_ * 0.98) return;
    best_error_ = error;
    planned_.chosen = planned_.trials.back();
    planned_.result = std::move(last_);
  }

  PlannedBake finished(double wanted) {
    planned_.wanted = wanted;
    planned_.reached = planned_.chosen.error.mean_degrees <= wanted;
    return std::move(planned_);
  }

  PlannedBake cancelled() {
    PlannedBake none;
    none.result.cancelled = true;
    return none;
  }

  const Source& source_;
  const Mesh& low_;
  const PlanOptions& options_;
  const Mesh box_;
  std::vector<ViewAngles> views_;
  std::vector<Image> pictures_;
  PlannedBake planned_;
  BakeResult last_;
  double best_error_ = 0;
};

}  // namespace

PlannedBake bake_planned(const Source& source, const Mesh& low, const PlanOptions& options) {
  if (!std::isfinite(options.max_error) || options.max_error < 0) {
    throw Error(ErrorCode::usage, "The error to reach is " + std::to_string(options.max_error) +
                                      " degrees: it must be finite, and 0 or more.");
  }
  if (options.bake.match != nullptr) {
    throw Error(ErrorCode::usage, "A plan chooses how to match, but a saved match was given.");
  }
  const auto& maps = options.bake.maps;
  if (std::find(maps.begin(), maps.end(), MapKind::normal) == maps.end()) {
    throw Error(ErrorCode::usage,
                "A plan measures normal maps, but none is among the maps: add it.");
  }
  return Planner(source, low, options).run();
}

}  // namespace kiln
