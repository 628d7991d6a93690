// Matching by depth views of the high poly from all around (Wang, Froehlich, Goebel, section 2).
#include "match/views.h"

#include <algorithm>
#include <cmath>

#include "mesh/charts.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::uint32_t kDefaultViewCount = 12;
constexpr std::uint32_t kMaxAutomaticViews = 64;
// Minimum gain of a view, as a share of all samples that the candidates see.
constexpr double kMinViewGain = 0.004;
// Side in texels of the small map whose samples are probed to plan views.
constexpr std::uint32_t kProbeMapSize = 192;

class ViewMatcher : public Matcher {
 public:
  ViewMatcher(const MatchRequest& request, ViewReport& report)
      : source_(request.source), context_(context_of(request.source.device)) {
    const Source::Impl& source = source_;
    const LowSurface& surface = request.surface;
    query_ = view_query(request);
    ViewedSurface& high = source.viewed_surface();
    query_.area = view_area(surface, query_.max_distance, high.radius());
    choose_directions(surface, request.views, report);
    size_ = choose_size(request, query_.area.radius, report);
    widen_view_area(query_.area, high.radius(), size_);
    report.pixel = 2 * query_.area.radius / size_ / source.frame.scale;
    for (const Vec3d& direction : directions_) report.directions.push_back(to_float(direction));
    views_per_batch_ = std::min(DepthViews::batch_size(context_, size_), high.views_at_once(size_));
    if (directions_.size() <= views_per_batch_) views_.emplace(draw(0, directions_.size()));
    context_.finish();
  }

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    if (best_scores_.size() < band.capacity) {
      best_scores_ = cl::Array<float>();
      best_scores_ = cl::Array<float>(context_, band.capacity);
    }
    DepthViews::reset(context_, band.sample_count, best_scores_, match);
    if (views_) {
      views_->match(band.points, band.sample_count, band.capacity, query_, best_scores_, match);
    } else {
      for (std::size_t first = 0; first < directions_.size(); first += views_per_batch_) {
        const DepthViews views =
            draw(first, std::min(directions_.size(), first + views_per_batch_));
        views.match(band.points, band.sample_count, band.capacity, query_, best_scores_, match);
        context_.finish();
      }
    }
  }

 private:
  DepthViews draw(std::size_t first, std::size_t last) const {
    return {context_,
            source_.viewed_surface(),
            std::vector<Vec3d>(directions_.begin() + static_cast<std::ptrdiff_t>(first),
                               directions_.begin() + static_cast<std::ptrdiff_t>(last)),
            size_,
            query_.two_sided,
            query_.area};
  }

  void choose_directions(const LowSurface& surface, const ViewOptions& views, ViewReport& report) {
    for (const Vec3& direction : views.directions) {
      directions_.push_back(unit_direction(direction));
    }
    if (views.automatic) {
      const TexelBand probes = probe_samples(surface);
      ViewPlan plan =
          plan_views(source_, probes.points, probes.sample_count, probes.capacity, query_,
                     directions_, kMinViewGain, views.count.value_or(kMaxAutomaticViews));
      directions_ = std::move(plan.directions);
      report.coverage = std::move(plan.coverage);
      return;
    }
    if (!views.count) {
      const std::optional<Vec3d> direction =
          height_field_direction(source_.triangle_blocks(), surface);
      if (direction) {
        report.height_field = true;
        directions_.push_back(*direction);
        return;
      }
    }
    const std::vector<Vec3d> spread = spread_directions(views.count.value_or(kDefaultViewCount));
    directions_.insert(directions_.end(), spread.begin(), spread.end());
  }

  /// Makes samples for a small map of the same low poly.
  TexelBand probe_samples(const LowSurface& surface) const {
    TexelOptions options;
    options.width = options.height = kProbeMapSize;
    options.small_charts = false;
    TexelSampler texel_sampler(context_, surface, options);
    if (texel_sampler.band_count() != 1)
      throw Error(ErrorCode::internal, "A plan's probes are split.");
    return texel_sampler.sample(0);
  }

  /// Largest useful side of a view: two pixels per sample of the map. A point is then found within half a
  /// sample of its exact position, regardless of the number of triangles per pixel.
  static double useful_size(const MatchRequest& request, double radius) {
    const LowSurface& surface = request.surface;
    double area = 0, area_in_uvs = 0;
    for (const std::size_t i : surface.usable_triangles()) {
      const auto& [a, b, c] = surface.triangles[i];
      const Vec3d origin = to_double(a.position);
      area += length(cross(to_double(b.position) - origin, to_double(c.position) - origin)) / 2;
      area_in_uvs += uv_area(a.uv, b.uv, c.uv);
    }
    const double texels = area_in_uvs * request.width * request.height;
    return 2 * 2 * radius * request.samples * std::sqrt(texels / area);
  }

  std::uint32_t choose_size(const MatchRequest& request, double radius, ViewReport& report) const {
    const ViewOptions& views = request.views;
    if (views.size != 0) {
      report.size = views.size;
      report.undersampled = undersampled_share(source_.triangle_blocks(), radius, views.size);
    } else {
      // The size is limited so that all views fit on the device together.
      std::uint32_t limit = kMaxViewSide;
      const double useful_side = useful_size(request, radius);
      while (limit > 1024 && limit - 256 >= useful_side) limit -= 256;
      while (limit > 1024 && DepthViews::batch_size(context_, limit) < directions_.size()) {
        limit -= 256;
      }
      const ViewSize view_size = choose_view_size(source_.triangle_blocks(), radius, limit);
      report.size = view_size.size;
      report.undersampled = view_size.undersampled;
    }
    return report.size;
  }

  const Source::Impl& source_;
  cl::Context& context_;
  ViewQuery query_;
  std::vector<Vec3d> directions_;
  std::uint32_t size_ = 0;
  std::uint32_t views_per_batch_ = 1;
  std::optional<DepthViews> views_;  // All views in one batch, if they fit on the device
  cl::Array<float> best_scores_;
};

}  // namespace

Vec3d unit_direction(const Vec3& toward) {
  const Vec3d d = to_double(toward);
  const double size = length(d);
  if (!(size > 0) || !std::isfinite(size)) {
    throw Error(
        ErrorCode::usage,
        "A view's direction must be finite and not (0, 0, 0): it points from the mesh to the "
        "viewer.");
  }
  return d * (1 / size);
}

ViewQuery view_query(const MatchRequest& request) {
  ViewQuery query;
  query.criterion = request.views.criterion;
  query.max_distance = static_cast<float>(request.distance);
  query.refine = request.views.refine;
  query.two_sided = request.two_sided;
  return query;
}

MatchRow views_match() {
  MatchRow row;
  row.info.method = MatchMethod::views;
  row.info.searches = "depth views from all around";
  row.info.options = "match.max_distance match.views";
  row.plan_order = 5;
  row.supports_large_high_poly = true;
  row.make = [](const MatchRequest& request, MatchNotes& notes) -> std::unique_ptr<Matcher> {
    notes.views.emplace();
    return std::make_unique<ViewMatcher>(request, *notes.views);
  };
  return row;
}

}  // namespace kiln
