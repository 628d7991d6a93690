#include "kiln/reasons.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "bake/match_stage.h"
#include "base/option.h"
#include "match/cage_reach.h"
#include "match/match_array.h"
#include "match/ray.h"
#include "mesh/vector.h"
#include "texel/host_correspondence.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

constexpr float kMaxRayLength = 4;  // ray length in frame units, longer than any mesh

class ReasonFinder {
 public:
  ReasonFinder(const Match& match, const Source::Impl& high, const Mesh& low,
               const BakeOptions& options)
      : match_(match),
        high_(high),
        options_(options),
        context_(context_of(high.device)),
        low_(high.low_surface(low, options.match.cage_mesh, options.match.uv_copies)),
        surface_(*low_),
        cage_(context_, high.frame, surface_),
        sample_directions_(make_sample_directions(options, high, surface_)),
        query_(ray_query(match_request(options, high, surface_), true)) {
    result_.width = options.width;
    result_.height = options.height;
    result_.texels.assign(std::size_t{options.width} * options.height, Reason::empty);
    for (const ReasonInfo& info : reason_infos())
      reason_counts_[index(info.reason)].reason = info.reason;
  }

  Reasons run() {
    TexelSampler sampler(context_, surface_,
                         {options_.width, options_.height, options_.samples, 1U << 20});
    for (std::uint32_t b = 0; b < sampler.band_count(); ++b) {
      TexelBand band = sampler.sample(b);
      if (band.sample_count == 0) continue;
      sample_directions_.set_directions(context_, band);
      cage_.write_sample_reach(context_, band);
      explain(band);
    }
    for (const ReasonCount& count : reason_counts_) {
      if (count.samples > 0 && count.reason != Reason::empty) result_.counts.push_back(count);
    }
    return std::move(result_);
  }

 private:
  static std::size_t index(Reason reason) { return static_cast<std::size_t>(reason); }

  void explain(const TexelBand& band) {
    const std::vector<std::size_t> elements = sample_elements(context_, band, match_);
    std::vector<float> points(std::size_t{7} * band.capacity);
    band.points.read(context_, points);
    std::vector<std::uint32_t> triangle(band.sample_count), missed_samples;
    band.triangle.read(context_, triangle);
    for (std::uint32_t i = 0; i < band.sample_count; ++i) {
      const SampleStatus status = match_.status_of(elements[i]);
      if (status == SampleStatus::missed) {
        missed_samples.push_back(i);
      } else {
        record_reason(status == SampleStatus::outermost ? Reason::passed_over : Reason::found,
                      elements[i], points, band.capacity, i, 0);
      }
    }
    if (missed_samples.empty()) return;
    const auto count = static_cast<std::uint32_t>(missed_samples.size());
    const cl::Array<float> rays =
        SamplePick(context_, missed_samples).of(band.points, band.capacity, 7);
    RayQuery two_sided = query_, unlimited = query_;
    two_sided.two_sided = true;
    unlimited.t_max = kMaxRayLength;
    if (!unlimited.inward) unlimited.t_min = -kMaxRayLength;
    const HostCorrespondence repeated_hits = cast(rays, count, query_),
                             back_hits = cast(rays, count, two_sided),
                             farther_hits = cast(rays, count, unlimited);
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t i = missed_samples[k];
      Reason reason = Reason::nothing;
      if (hits_own_back(triangle[i], points, band.capacity, i)) {
        reason = Reason::folded;
      } else if (repeated_hits.triangle[k] != KILN_NO_TRIANGLE) {
        reason = is_beyond_inner_shell() ? Reason::far : Reason::other_part;
      } else if (back_hits.triangle[k] != KILN_NO_TRIANGLE) {
        reason = Reason::back_face;
      } else if (farther_hits.triangle[k] != KILN_NO_TRIANGLE) {
        reason = Reason::far;
      }
      record_reason(reason, elements[i], points, band.capacity, i,
                    reason == Reason::far
                        ? std::abs(double{is_beyond_inner_shell() &&
                                                  repeated_hits.triangle[k] != KILN_NO_TRIANGLE
                                              ? repeated_hits.distance[k]
                                              : farther_hits.distance[k]})
                        : 0);
    }
  }

  HostCorrespondence cast(const cl::Array<float>& rays, std::uint32_t count,
                          const RayQuery& query) const {
    DeviceCorrespondence found(context_, count);
    high_.rays().intersect(rays, count, count, query, found);
    return HostCorrespondence(context_, found, count);
  }

  /// True if a hit was rejected because it lies beyond an inner shell, not because it is on another part.
  bool is_beyond_inner_shell() const {
    return surface_.has_cage_mesh && surface_.cage_kind == CageKind::shells &&
           options_.match.parts == nullptr;
  }

  bool hits_own_back(std::uint32_t triangle, const std::vector<float>& points, std::size_t plane,
                     std::size_t i) const {
    const auto& [a, b, c] = surface_.triangles[triangle];
    const Vec3d normal = cross(to_double(b.position) - to_double(a.position),
                               to_double(c.position) - to_double(a.position));
    const Vec3d direction{points[3 * plane + i], points[4 * plane + i], points[5 * plane + i]};
    return dot(normal, direction) <= 0;
  }

  void record_reason(Reason reason, std::size_t element, const std::vector<float>& points,
                     std::size_t plane, std::size_t i, double distance) {
    const auto column = static_cast<std::uint32_t>(element % match_.width / match_.samples);
    const auto row = static_cast<std::uint32_t>(element / match_.width / match_.samples);
    Reason& texel = result_.texels[std::size_t{row} * options_.width + column];
    texel = std::max(texel, reason);
    ReasonCount& count = reason_counts_[index(reason)];
    const bool nearer_hits = count.samples == 0 || distance / high_.frame.scale < count.distance;
    ++count.samples;
    if (!nearer_hits) return;
    count.column = column;
    count.row = row;
    count.distance = distance / high_.frame.scale;
    for (std::size_t k = 0; k < 3; ++k) {
      count.position[k] = double{points[k * plane + i]} / high_.frame.scale + high_.frame.center[k];
    }
  }

  const Match& match_;
  const Source::Impl& high_;
  const BakeOptions& options_;
  cl::Context& context_;
  std::shared_ptr<LowSurface> low_;
  LowSurface& surface_;
  CageReach cage_;
  SampleDirections sample_directions_;
  RayQuery query_;
  Reasons result_;
  std::array<ReasonCount, 8> reason_counts_;
};

}  // namespace

std::array<ReasonInfo, 8> reason_infos() {
  return {{
      {Reason::empty, "empty", "no texel of LOW", {0, 0, 0}},
      {Reason::found, "found", "a point was found", {60, 140, 60}},
      {Reason::passed_over,
       "passed_over",
       "a point was found, beyond a nearer face",
       {170, 220, 60}},
      {Reason::other_part,
       "other_part",
       "missed: the surface there belongs to a part that is not paired; check the pairs of parts",
       {60, 120, 230}},
      {Reason::back_face,
       "back_face",
       "missed: the faces there point away; flip the faces of HIGH, or use " +
           option("match.two_sided"),
       {230, 140, 30}},
      {Reason::far,
       "far",
       "missed: the surface there is too far away; raise " + option("match.max_distance"),
       {250, 230, 60}},
      {Reason::folded,
       "folded",
       "missed: the ray hits the back of LOW's own face; repair the fold, or LOW's normals",
       {150, 60, 200}},
      {Reason::nothing,
       "nothing",
       "missed: the ray hits nothing; HIGH has a hole or an edge there",
       {230, 40, 60}},
  }};
}

Reasons explain(const Match& match, const Source& source, const Mesh& low,
                const BakeOptions& options) {
  if (!obeys(match_row(options.match.method).info, "match.ray.rule") ||
      !options.match.fallback.empty() || options.match.saved != nullptr) {
    throw Error(
        ErrorCode::usage,
        "Reasons are available only for matching by rays: choose the match '" +
            match_names([](const MatchRow& row) { return obeys(row.info, "match.ray.rule"); }) +
            "', without a fallback and without a saved match.");
  }
  const Source::Impl& high = impl_of(source);
  check_match(match, options, high.triangles.size());
  check_meshes(match, match.source_hash != 0 ? hash_source(high.positions, high.triangles) : 0,
               hash_low(low));
  return ReasonFinder(match, high, low, options).run();
}

}  // namespace kiln
