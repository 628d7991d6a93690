#include "match/matcher.h"

#include <algorithm>
#include <cmath>

#include "match/match_array.h"
#include "match/uv.h"
#include "match/view_plan.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;
constexpr std::uint32_t kDefaultViews = 12;
constexpr std::uint32_t kMostViews = 512;
constexpr std::uint32_t kMostAutomatic = 64;
constexpr std::uint32_t kLargestView = 8192;
// A view that would add less than this share of what all candidates see is not worth drawing.
constexpr double kLeastGain = 0.004;
// Samples that a plan is made for.
constexpr std::uint32_t kProbeMap = 192;

double to_frame(const Length& length, const Frame& frame) {
  return (length.relative ? length.value * frame.diagonal : length.value) * frame.scale;
}

/// The longest way from the light mesh to its cage mesh.
double longest_reach(const LowSurface& surface) {
  double longest = 0;
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    if (surface.usable[i] == 0) continue;
    for (const LowSurface::Corner& corner : surface.triangles[i]) {
      longest = std::max(longest, length(Vec3d(corner.direction)));
    }
  }
  return longest;
}

/// Frame units; see BakeOptions::max_distance for what is taken where none is given.
double max_distance(const BakeOptions& options, const LowSurface& surface, const Frame& frame) {
  // Longer than any scene is as good as that.
  constexpr double kFarthest = 1048576;
  if (options.max_distance) return std::min(to_frame(*options.max_distance, frame), kFarthest);
  double distance = 0;
  if (options.cage) distance = 2 * to_frame(*options.cage, frame);
  if (options.cage_mesh != nullptr) distance = 2 * longest_reach(surface);
  return distance > 0 ? distance : to_frame(Length::share(0.02), frame);
}

RayQuery ray_query(const BakeOptions& options, const Frame& frame, double max_distance) {
  const auto distance = static_cast<float>(max_distance);
  RayQuery query;
  query.two_sided = options.two_sided;
  query.t_max = distance;
  if (options.cage_mesh != nullptr || options.cage) {
    query.inward = true;
    query.use_reach = options.cage_mesh != nullptr;
    if (options.cage) query.offset = static_cast<float>(to_frame(*options.cage, frame));
  } else {
    query.t_min = -distance;
    query.outward_first = true;
  }
  return query;
}

/// Takes a saved correspondence.
class LoadedMatcher : public Matcher {
 public:
  LoadedMatcher(cl::Context& context, const Match& saved, double unit)
      : context_(context), saved_(saved), unit_(unit) {}

  void run(const TexelBand& band, Correspondence& match) override {
    load_band(context_, band, saved_, unit_, match);
  }

 private:
  cl::Context& context_;
  const Match& saved_;
  double unit_;
};

class RayMatcher : public Matcher {
 public:
  RayMatcher(const RayCaster& rays, const RayQuery& query) : rays_(rays), query_(query) {}

  void run(const TexelBand& band, Correspondence& match) override {
    if (band.sample_count == 0) return;
    rays_.intersect(band.points, band.sample_count, band.capacity, query_, match);
  }

 private:
  const RayCaster& rays_;
  RayQuery query_;
};

/// Rays along directions of visibility, or between these and the samples' own.
class VisibilityMatcher : public Matcher {
 public:
  VisibilityMatcher(const Source::Impl& source, const LowSurface& surface, const RayQuery& query,
                    const BakeOptions& options, VisibilityReport& report, std::uint32_t cluster,
                    std::shared_ptr<const VisibilityField>& field)
      : context_(source.device.context()),
        rays_(source.rays()),
        query_(query),
        samples_(options.samples),
        hybrid_(options.method == MatchMethod::hybrid),
        cluster_(cluster) {
    if (field == nullptr) {
      field = std::make_shared<const VisibilityField>(
          context_, surface, options.width, options.height, options.visibility, source.traversal,
          report, [&options](double done) {
            return !options.progress || options.progress(kPreparingShare * done, "visibility");
          });
    }
    field_ = field;
  }

  void run(const TexelBand& band, Correspondence& match) override {
    if (band.sample_count == 0) return;
    if (capacity_ < band.capacity) {
      points_ = cl::Array<float>();
      points_ = cl::Array<float>(context_, std::size_t{7} * band.capacity);
      capacity_ = band.capacity;
    }
    field_->direct(band, samples_, hybrid_, points_, capacity_, cluster_);
    rays_.intersect(points_, band.sample_count, capacity_, query_, match);
  }

 private:
  cl::Context& context_;
  const RayCaster& rays_;
  RayQuery query_;
  std::uint32_t samples_;
  bool hybrid_;
  std::uint32_t cluster_;
  std::shared_ptr<const VisibilityField> field_;
  std::uint32_t capacity_ = 0;
  cl::Array<float> points_;
};

class ClosestMatcher : public Matcher {
 public:
  ClosestMatcher(const ClosestFinder& finder, const ClosestQuery& query)
      : finder_(finder), query_(query) {}

  void run(const TexelBand& band, Correspondence& match) override {
    if (band.sample_count == 0) return;
    finder_.find(band.points, band.sample_count, band.capacity, query_, match);
  }

 private:
  const ClosestFinder& finder_;
  ClosestQuery query_;
};

/// One method, then another for the samples that it leaves undecided.
class FallbackMatcher : public Matcher {
 public:
  FallbackMatcher(cl::Context& context, std::unique_ptr<Matcher> first,
                  std::unique_ptr<Matcher> second)
      : context_(context), first_(std::move(first)), second_(std::move(second)) {}

  void run(const TexelBand& band, Correspondence& match) override {
    deciders_.clear();
    if (band.sample_count == 0) return;
    first_->run(band, match);
    std::vector<std::uint8_t> status(band.sample_count);
    match.status.read(context_, status);
    deciders_.assign(band.sample_count, Decider::method);
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t i = 0; i < band.sample_count; ++i) {
      if (status[i] == KILN_STATUS_MISS) chosen.push_back(i);
    }
    if (chosen.empty()) return;
    run_fallback(band, chosen, rest_);
    const auto count = static_cast<std::uint32_t>(chosen.size());
    const cl::Array<std::uint32_t> indices(context_, std::span<const std::uint32_t>(chosen));
    context_.launch(context_.kernel("match", "kiln_match_scatter"), count, kLocal, count,
                    rest_.capacity, match.capacity, indices, rest_.triangle, rest_.barycentric,
                    rest_.distance, rest_.status, match.triangle, match.barycentric, match.distance,
                    match.status);
    context_.finish();  // `indices` goes
    status.resize(count);
    rest_.status.read(context_, status);
    for (std::uint32_t i = 0; i < count; ++i) {
      deciders_[chosen[i]] = status[i] == KILN_STATUS_MISS ? Decider::nothing : Decider::fallback;
    }
  }

  std::span<const Decider> deciders() const override { return deciders_; }

  void run_fallback(const TexelBand& band, std::span<const std::uint32_t> samples,
                    Correspondence& found) override {
    const auto count = static_cast<std::uint32_t>(samples.size());
    if (found.capacity < count) {
      found = Correspondence();
      found = Correspondence(context_, count);
    }
    if (rest_band_.points.size() < std::size_t{7} * found.capacity) {
      rest_band_.points = cl::Array<float>();
      rest_band_.points = cl::Array<float>(context_, std::size_t{7} * found.capacity);
    }
    rest_band_.sample_count = count;
    rest_band_.capacity = found.capacity;
    const cl::Array<std::uint32_t> indices(context_, samples);
    context_.launch(context_.kernel("match", "kiln_match_gather"), count, kLocal, count,
                    band.capacity, rest_band_.capacity, indices, band.points, rest_band_.points);
    second_->run(rest_band_, found);
    context_.finish();  // `indices` goes
  }

  void finish(BakeReport& report) override { first_->finish(report); }

 private:
  cl::Context& context_;
  std::unique_ptr<Matcher> first_, second_;
  TexelBand rest_band_;  // its points and their count, no more
  Correspondence rest_;
  std::vector<Decider> deciders_;
};

class ViewMatcher : public Matcher {
 public:
  ViewMatcher(const Source::Impl& source, const LowSurface& surface, const BakeOptions& options,
              ViewReport& report)
      : source_(source), context_(source.device.context()) {
    query_ = view_query(options, surface, source.frame);
    Rasterizer& raster = source.raster();
    query_.area = view_area(surface, query_.max_distance, raster.radius());
    choose_directions(surface, options, report);
    size_ = choose_size(surface, options, query_.area.radius, report);
    widen(query_.area, raster.radius(), size_);
    report.pixel = 2 * query_.area.radius / size_ / source.frame.scale;
    for (const Vec3d& direction : directions_) report.directions.push_back(to_float(direction));
    batch_ = DepthViews::batch_size(context_, size_);
    if (directions_.size() <= batch_) views_.emplace(draw(0, directions_.size()));
    context_.finish();
  }

  void run(const TexelBand& band, Correspondence& match) override {
    if (band.sample_count == 0) return;
    if (score_.size() < band.capacity) {
      score_ = cl::Array<float>();
      score_ = cl::Array<float>(context_, band.capacity);
    }
    DepthViews::reset(context_, band.sample_count, score_, match);
    if (views_) {
      views_->match(band.points, band.sample_count, band.capacity, query_, score_, match);
    } else {
      for (std::size_t first = 0; first < directions_.size(); first += batch_) {
        const DepthViews views = draw(first, std::min(directions_.size(), first + batch_));
        views.match(band.points, band.sample_count, band.capacity, query_, score_, match);
        context_.finish();
      }
    }
  }

 private:
  DepthViews draw(std::size_t first, std::size_t last) const {
    return {context_,
            source_.raster(),
            std::vector<Vec3d>(directions_.begin() + static_cast<std::ptrdiff_t>(first),
                               directions_.begin() + static_cast<std::ptrdiff_t>(last)),
            size_,
            query_.two_sided,
            query_.area};
  }

  void choose_directions(const LowSurface& surface, const BakeOptions& options,
                         ViewReport& report) {
    const ViewOptions& views = options.views;
    for (const Vec3& direction : views.directions) {
      directions_.push_back(unit_direction(direction));
    }
    if (views.automatic) {
      const TexelBand probes = probe_samples(surface);
      ViewPlan plan =
          plan_views(source_, probes.points, probes.sample_count, probes.capacity, query_,
                     directions_, kLeastGain, views.count.value_or(kMostAutomatic));
      directions_ = std::move(plan.directions);
      report.coverage = std::move(plan.coverage);
      return;
    }
    if (!views.count) {
      const std::optional<Vec3d> direction =
          height_field_direction(source_.positions, source_.triangles, surface);
      if (direction) {
        report.height_field = true;
        directions_.push_back(*direction);
        return;
      }
    }
    const std::vector<Vec3d> spread = spread_directions(views.count.value_or(kDefaultViews));
    directions_.insert(directions_.end(), spread.begin(), spread.end());
  }

  /// Samples of a small map of the same light mesh.
  TexelBand probe_samples(const LowSurface& surface) const {
    TexelOptions options;
    options.width = options.height = kProbeMap;
    TexelSampler sampler(context_, surface, options);
    if (sampler.band_count() != 1) throw Error(ErrorCode::internal, "A plan's probes are split.");
    return sampler.sample(0);
  }

  /// Pixels a side that are worth it: two across a sample of the map. A point is then found within half a
  /// sample of where it should be, however many triangles a pixel covers.
  static double useful_size(const LowSurface& surface, const BakeOptions& options, double radius) {
    double area = 0;
    double uv_area = 0;
    for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
      if (surface.usable[i] == 0) continue;
      const auto& [a, b, c] = surface.triangles[i];
      const Vec3d origin(a.position);
      area += length(cross(Vec3d(b.position) - origin, Vec3d(c.position) - origin)) / 2;
      const double ux = double{b.uv.x} - a.uv.x, uy = double{b.uv.y} - a.uv.y;
      const double vx = double{c.uv.x} - a.uv.x, vy = double{c.uv.y} - a.uv.y;
      const double doubled = std::abs(ux * vy - uy * vx);
      if (std::isfinite(doubled)) uv_area += doubled / 2;
    }
    const double texels = uv_area * options.width * options.height;
    return 2 * 2 * radius * options.samples * std::sqrt(texels / area);
  }

  std::uint32_t choose_size(const LowSurface& surface, const BakeOptions& options, double radius,
                            ViewReport& report) const {
    const ViewOptions& views = options.views;
    if (views.size != 0) {
      report.size = views.size;
      report.undersampled =
          undersampled_share(source_.positions, source_.triangles, radius, views.size);
    } else {
      // No larger than lets all views lie on the device together.
      std::uint32_t limit = kLargestView;
      const double useful = useful_size(surface, options, radius);
      while (limit > 1024 && limit - 256 >= useful) limit -= 256;
      while (limit > 1024 && DepthViews::batch_size(context_, limit) < directions_.size()) {
        limit -= 256;
      }
      const ViewSize chosen = choose_view_size(source_.positions, source_.triangles, radius, limit);
      report.size = chosen.size;
      report.undersampled = chosen.undersampled;
    }
    return report.size;
  }

  const Source::Impl& source_;
  cl::Context& context_;
  ViewQuery query_;
  std::vector<Vec3d> directions_;
  std::uint32_t size_ = 0;
  std::uint32_t batch_ = 1;
  std::optional<DepthViews> views_;  // all of them, where they fit together
  cl::Array<float> score_;
};

[[noreturn]] void usage(const std::string& message) { throw Error(ErrorCode::usage, message); }

void check_length(const char* name, const Length& length, bool may_be_zero) {
  if (!std::isfinite(length.value) || length.value < 0 || (!may_be_zero && length.value == 0)) {
    usage(std::string(name) + " is " + std::to_string(length.value) +
          ": it must be a finite length " + (may_be_zero ? "of 0 or more." : "above 0."));
  }
}

void check_views(const ViewOptions& views) {
  if (views.count.value_or(1) > kMostViews || views.directions.size() > kMostViews) {
    throw Error(ErrorCode::usage,
                "More than " + std::to_string(kMostViews) + " views were asked for: use fewer.");
  }
  if (views.count && *views.count == 0 && views.directions.empty()) {
    throw Error(ErrorCode::usage, "No view was asked for: use at least one.");
  }
  if (views.size > kLargestView) {
    throw Error(ErrorCode::usage, "The depth views' size is " + std::to_string(views.size) +
                                      ": it must be 1 to " + std::to_string(kLargestView) +
                                      " pixels.");
  }
}

void check_fallback(const BakeOptions& options) {
  constexpr std::uint32_t kLongest = 256;
  if (options.fallback_blend > kLongest) {
    usage("The fallback's blending is " + std::to_string(options.fallback_blend) +
          " texels: it must be 0 to " + std::to_string(kLongest) + ".");
  }
  if (options.fallback == Fallback::low) {
    if (options.fallback_blend == 0) return;
    usage("Blending with the fallback was asked for, but no fallback: choose one.");
  }
  if (options.match != nullptr) {
    usage("A fallback was asked for, but a saved match is taken as it is: leave one of them out.");
  }
  const MatchMethod fallback = options.fallback == Fallback::ray     ? MatchMethod::ray
                               : options.fallback == Fallback::views ? MatchMethod::views
                                                                     : MatchMethod::closest;
  const bool same = options.method == fallback;
  if (same) {
    usage(
        "The fallback is the method itself, which leaves the same samples undecided: choose "
        "another.");
  }
}

}  // namespace

void check_options(const BakeOptions& options) {
  constexpr std::uint32_t kLargest = 16384;
  if (options.width < 1 || options.width > kLargest || options.height < 1 ||
      options.height > kLargest) {
    usage("The map's size is " + std::to_string(options.width) + "x" +
          std::to_string(options.height) + ": each side must be 1 to 16384 texels.");
  }
  if (options.samples < 1 || options.samples > 16) {
    usage("samples is " + std::to_string(options.samples) + ": it must be 1 to 16 a side.");
  }
  if (options.maps.empty()) usage("No map was asked for: give at least one, such as normal.");
  if (options.max_distance) check_length("max_distance", *options.max_distance, false);
  if (options.cage) check_length("cage", *options.cage, true);
  if (options.cage && options.cage_mesh != nullptr) {
    usage("Both a cage distance and a cage mesh were given: choose one.");
  }
  if (options.gutter < -1 || options.gutter > 4096) {
    usage("gutter is " + std::to_string(options.gutter) +
          ": it must be 0 to 4096 texels, or -1 for an infinite one.");
  }
  if (options.two_component && options.space == NormalMapSpace::object) {
    usage(
        "The two-component form needs normals on one side of the surface: use tangent or face "
        "space.");
  }
  check_views(options.views);
  if (options.method == MatchMethod::visibility || options.method == MatchMethod::hybrid) {
    check_visibility(options.visibility);
  }
  if (options.visibility.clusters > 1) {
    if (options.method != MatchMethod::visibility || options.match != nullptr) {
      usage("Clusters of directions are for matching by visibility: choose that, or one cluster.");
    }
    if (options.keep_match) {
      usage("Several clusters of directions have no one match to be kept: leave one of them out.");
    }
  }
  check_uv(options.uv);
  check_fallback(options);
}

void Matcher::run_fallback(const TexelBand& /*band*/, std::span<const std::uint32_t> /*samples*/,
                           Correspondence& /*found*/) {
  throw Error(ErrorCode::internal, "There is no fallback to ask.");
}

Vec3d unit_direction(const Vec3& toward) {
  const Vec3d d(toward);
  const double size = length(d);
  if (!(size > 0) || !std::isfinite(size)) {
    throw Error(
        ErrorCode::usage,
        "A view's direction must be finite and not (0, 0, 0): it points from the mesh to the "
        "viewer.");
  }
  return d * (1 / size);
}

ViewQuery view_query(const BakeOptions& options, const LowSurface& surface, const Frame& frame) {
  ViewQuery query;
  query.criterion = options.views.criterion;
  query.max_distance = static_cast<float>(max_distance(options, surface, frame));
  query.refine = options.views.refine;
  query.two_sided = options.two_sided;
  return query;
}

std::unique_ptr<Matcher> make_matcher(const Source::Impl& source, const LowSurface& surface,
                                      const BakeOptions& options, BakeReport& report,
                                      std::uint32_t cluster,
                                      std::shared_ptr<const VisibilityField>& field) {
  const double unit = 1 / source.frame.scale;
  const double distance = max_distance(options, surface, source.frame);
  report.max_distance = options.match == nullptr ? distance * unit : 0;
  if (options.match == nullptr && options.cage &&
      distance <= to_frame(*options.cage, source.frame)) {
    report.warnings.push_back({"short-rays",
                               "Rays start at the cage and end before they reach the light mesh: "
                               "--max-distance should be "
                               "about twice --cage.",
                               1});
  }
  const double built = source.stats().build_seconds;
  const auto by_rays = [&] {
    return std::make_unique<RayMatcher>(source.rays(), ray_query(options, source.frame, distance));
  };
  const auto by_nearest_points = [&] {
    return std::make_unique<ClosestMatcher>(
        source.closest(), ClosestQuery{static_cast<float>(distance), options.two_sided});
  };
  const auto by_views = [&] {
    report.views.emplace();
    return std::make_unique<ViewMatcher>(source, surface, options, *report.views);
  };
  std::unique_ptr<Matcher> matcher;
  if (options.match != nullptr) {
    matcher = std::make_unique<LoadedMatcher>(source.device.context(), *options.match, unit);
  } else if (options.method == MatchMethod::views) {
    matcher = by_views();
  } else if (options.method == MatchMethod::closest) {
    matcher = by_nearest_points();
  } else if (options.method == MatchMethod::visibility || options.method == MatchMethod::hybrid) {
    report.visibility.emplace();
    BakeOptions plain = options;  // a cage is for the fallback
    plain.cage.reset();
    plain.cage_mesh = nullptr;
    matcher = std::make_unique<VisibilityMatcher>(source, surface,
                                                  ray_query(plain, source.frame, distance), options,
                                                  *report.visibility, cluster, field);
  } else if (options.method == MatchMethod::uv) {
    if (options.fallback == Fallback::low) report.max_distance = 0;
    matcher = make_uv_matcher(source, options);
  } else {
    matcher = by_rays();
  }
  if (options.fallback != Fallback::low) {
    std::unique_ptr<Matcher> second;
    if (options.fallback == Fallback::ray) second = by_rays();
    if (options.fallback == Fallback::closest) second = by_nearest_points();
    if (options.fallback == Fallback::views) second = by_views();
    matcher = std::make_unique<FallbackMatcher>(source.device.context(), std::move(matcher),
                                                std::move(second));
  }
  report.seconds_build = source.stats().build_seconds - built;
  return matcher;
}

}  // namespace kiln
