#include "match/cage_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "base/parallel.h"
#include "match/low_rays.h"
#include "match/part_matcher.h"
#include "mesh/vector.h"
#include "shared/ray.h"
#include "texel/host_correspondence.h"

namespace kiln {
namespace {

constexpr std::size_t kTargetPointCount = 1 << 18;
// Thresholds of the search, as shares of the high poly's diagonal.
// largest height above the low poly at which an interval inside the high poly may end
constexpr double kMaxSolidHeight = 0.25;
constexpr double kMaxFaceDepth = 0.1;  // largest depth of a face below the low poly
// a point that lies at most this far below another part of the low poly is hidden, and ignored
constexpr double kMinClearance = 0.001;
// only faces up to this height above the low poly can be the outer side of a wall, whose inner side
// bounds the inner shell
constexpr double kMaxWallHeight = 0.0025;
constexpr double kMaxOwnFaceHeight =
    0.0025;  // a face of the high poly up to this height always belongs to the point below it
// A face belongs to another point of the low poly if it is nearer to that point than this share of the ray's
// length.
constexpr float kMaxForeignRatio = 0.5F;
// maximum number of solids above one another that a point is raised over: passes of
// extend_to_solids()
constexpr int kMaxStackedSolids = 4;
// Distance beyond a face at which the next ray starts
constexpr float kRayStartOffset = 4 * KILN_BVH_EPSILON;
constexpr float kNoHit = std::numeric_limits<float>::infinity();

class CageSearch {
 public:
  CageSearch(const MatchRequest& request, const SampleDirections& directions, const Parts* parts)
      : request_(request), context_(context_of(request.source.device)), parts_(parts) {
    const double diagonal = request.source.frame.diagonal * request.source.frame.scale;
    max_height_ = static_cast<float>(kMaxSolidHeight * diagonal);
    max_depth_ = static_cast<float>(std::max(request.distance, kMaxFaceDepth * diagonal));
    min_clearance_ = static_cast<float>(kMinClearance * diagonal);
    max_wall_height_ = static_cast<float>(kMaxWallHeight * diagonal);
    max_own_face_height_ = static_cast<float>(kMaxOwnFaceHeight * diagonal);
    needs_.points = spread_points(context_, request.surface, kTargetPointCount);
    directions.set_directions(context_, needs_.points.band);
    point_count_ = needs_.points.list.size();
    points_.resize(7 * point_count_);
    needs_.points.band.points.read(context_, points_);
  }

  CageNeeds run() {
    const LowRays low(context_, request_.surface);
    const cl::Array<float> outward_limits(context_, point_count_);
    low.write_search_limits(context_, needs_.points.band, max_height_, outward_limits, 0);
    outward_limits_ = outward_limits.download(context_);
    needs_.counts.resize(point_count_);
    for (std::size_t i = 0; i < point_count_; ++i)
      needs_.counts[i] = outward_limits_[i] >= min_clearance_ ? 1 : 0;
    find_bake_faces();
    for (int i = 0; i < kMaxStackedSolids && extend_to_solids(); ++i) {
    }
    search_inward();
    reassign_foreign_faces(low);
    find_bounds();
    return std::move(needs_);
  }

 private:
  struct Hits {
    /// Distance from the point along its direction; infinity: no hit
    std::vector<float> at;
    /// 1 if the ray hits a back face, where it leaves a solid
    std::vector<std::uint8_t> is_back_face;
  };

  /// Casts rays that start at offset `from` along the points' directions, and returns their first hits; casts none for
  /// infinite offsets.
  /// \param backs reverses the direction, so that without two_sided only back faces are hit
  Hits cast(const std::vector<float>& from, const RayQuery& query, bool backs = false) const {
    std::vector<float> planes = points_;
    for (std::size_t i = 0; i < point_count_; ++i) {
      const bool casts_ray = from[i] < kNoHit;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        float& d = planes[(3 + axis) * point_count_ + i];
        if (casts_ray) planes[axis * point_count_ + i] += from[i] * d;
        if (!casts_ray) d = 0;
        if (backs) d = -d;
      }
    }
    const cl::Array<float> points(context_, std::span<const float>(planes));
    const auto count = static_cast<std::uint32_t>(point_count_);
    DeviceCorrespondence matches(context_, count);
    request_.source.rays().intersect(points, count, count, query, matches);
    const HostCorrespondence found(context_, matches, count);
    Hits hits{std::vector<float>(point_count_, kNoHit), std::vector<std::uint8_t>(point_count_)};
    parallel_for(point_count_, 1 << 12, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t t = found.triangle[i];
        if (t == KILN_NO_TRIANGLE || !(from[i] < kNoHit) || !is_of_own_part(i, t)) continue;
        hits.at[i] = from[i] + (backs ? -found.distance[i] : found.distance[i]);
        hits.is_back_face[i] = dot(normal(t), direction(i)) > 0 ? 1 : 0;
      }
    });
    return hits;
  }

  /// True if a face belongs to the point's own part.
  bool is_of_own_part(std::size_t i, std::uint32_t triangle) const {
    return parts_ == nullptr ||
           parts_->high[triangle] == parts_->low[needs_.points.list[i].triangle];
  }

  Vec3d normal(std::uint32_t triangle) const {
    const std::vector<Vec3>& p = request_.source.positions;
    const Triangle& t = request_.source.triangles[triangle];
    return cross(to_double(p[t[1]]) - to_double(p[t[0]]), to_double(p[t[2]]) - to_double(p[t[0]]));
  }

  Vec3d direction(std::size_t i) const {
    return {points_[3 * point_count_ + i], points_[4 * point_count_ + i],
            points_[5 * point_count_ + i]};
  }

  HostCorrespondence match(const MatchRequest& request) const {
    MatchNotes unused_notes;
    const MatchRow row = ray_match();
    const std::unique_ptr<Matcher> matcher = parts_ != nullptr
                                                 ? part_matcher(row, request, *parts_, unused_notes)
                                                 : row.make(request, unused_notes);
    const auto count = static_cast<std::uint32_t>(point_count_);
    DeviceCorrespondence matches(context_, count);
    matcher->run(needs_.points.band, matches);
    return HostCorrespondence(context_, matches, count);
  }

  /// Finds the faces that the bake would match without a cage.
  void find_bake_faces() {
    const HostCorrespondence matched = match(request_);
    face_heights_.resize(point_count_);
    needs_.found.resize(point_count_);
    for (std::size_t i = 0; i < point_count_; ++i) {
      needs_.found[i] = needs_.counts[i] != 0 && matched.triangle[i] != KILN_NO_TRIANGLE ? 1 : 0;
      face_heights_[i] = needs_.found[i] != 0 ? matched.distance[i] : 0;
    }
  }

  /// Offsets along the points' directions at which rays start just above each point's own face.
  std::vector<float> offsets_above_faces() const {
    std::vector<float> from(point_count_, kNoHit);
    for (std::size_t i = 0; i < point_count_; ++i) {
      if (needs_.counts[i] != 0) from[i] = std::max(face_heights_[i], 0.0F) + kRayStartOffset;
    }
    return from;
  }

  /// Raises the points' heights to the tops of solids that begin within the search distance and end beyond
  /// it: solids above the low poly's face, and solids that are sunk into it. \returns true if a height
  /// changed
  bool extend_to_solids() {
    RayQuery query;
    query.t_max = max_height_;
    query.two_sided = true;
    const Hits first = cast(offsets_above_faces(), query);
    std::vector<float> from(point_count_, kNoHit), inner_ray_starts(point_count_, kNoHit);
    for (std::size_t i = 0; i < point_count_; ++i) {
      const float max_height = std::min(outward_limits_[i], static_cast<float>(request_.distance));
      if (first.is_back_face[i] == 0 && first.at[i] <= max_height)
        from[i] = first.at[i] + kRayStartOffset;
      if (first.is_back_face[i] != 0 && needs_.found[i] != 0)
        inner_ray_starts[i] = face_heights_[i] + kRayStartOffset;
    }
    query.two_sided = false;
    query.t_max = static_cast<float>(request_.distance);
    const Hits inner_side_hits = cast(inner_ray_starts, query, true);
    query.t_max = max_height_;
    query.two_sided = request_.two_sided;
    const Hits last = cast(from, query);
    bool has_changed = false;
    for (std::size_t i = 0; i < point_count_; ++i) {
      const Hits& top = inner_side_hits.at[i] < kNoHit ? first : last;
      if (!(top.at[i] < std::min(outward_limits_[i], max_height_))) continue;
      if (from[i] == kNoHit && !(inner_side_hits.at[i] < kNoHit)) continue;
      face_heights_[i] = top.at[i];
      needs_.found[i] = 1;
      has_changed = true;
    }
    return has_changed;
  }

  /// Discards faces that are much nearer to another part of the low poly than to the point: the point's
  /// ray missed a raised detail, or passed the edge of another part, and hit a surface behind it. Such
  /// points get the nearest face instead.
  void reassign_foreign_faces(const LowRays& low) {
    const std::vector<std::uint8_t> is_foreign = find_foreign_faces(low);
    if (std::find(is_foreign.begin(), is_foreign.end(), 1) == is_foreign.end()) return;
    MatchRequest request = request_;
    request.ray.rule = RayRule::nearest;
    const HostCorrespondence nearest = match(request);
    for (std::size_t i = 0; i < point_count_; ++i) {
      if (is_foreign[i] == 0) continue;
      needs_.found[i] = nearest.triangle[i] != KILN_NO_TRIANGLE ? 1 : 0;
      face_heights_[i] = needs_.found[i] != 0 ? nearest.distance[i] : 0;
    }
    const std::vector<std::uint8_t> is_still_foreign = find_foreign_faces(low);
    for (std::size_t i = 0; i < point_count_; ++i) {
      if (is_still_foreign[i] == 0) continue;
      needs_.found[i] = 0;
      face_heights_[i] = 0;
    }
  }

  std::vector<std::uint8_t> find_foreign_faces(const LowRays& low) const {
    std::vector<float> hits = points_;
    for (std::size_t i = 0; i < point_count_; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        hits[axis * point_count_ + i] += face_heights_[i] * points_[(3 + axis) * point_count_ + i];
      }
    }
    const std::vector<float> distances_to_low_poly = low.distances(context_, hits, max_height_);
    std::vector<std::uint8_t> is_foreign(point_count_);
    for (std::size_t i = 0; i < point_count_; ++i) {
      const float height = std::abs(face_heights_[i]);
      is_foreign[i] = needs_.found[i] != 0 && height > max_own_face_height_ &&
                              distances_to_low_poly[i] < kMaxForeignRatio * height
                          ? 1
                          : 0;
    }
    return is_foreign;
  }

  /// For points that have no face yet, searches inward for one.
  void search_inward() {
    std::vector<float> from(point_count_, kNoHit);
    for (std::size_t i = 0; i < point_count_; ++i) {
      if (needs_.counts[i] != 0 && needs_.found[i] == 0) from[i] = 0;
    }
    RayQuery query;
    query.inward = true;
    query.t_max = max_depth_;
    query.two_sided = request_.two_sided;
    const Hits hits = cast(from, query);
    for (std::size_t i = 0; i < point_count_; ++i) {
      if (!(hits.at[i] < kNoHit)) continue;
      face_heights_[i] = hits.at[i];
      needs_.found[i] = 1;
    }
  }

  /// Finds the next faces outward and inward of each point's face, which bound the shells.
  void find_bounds() {
    RayQuery query;
    query.t_max = max_height_;
    query.two_sided = true;
    const Hits outward_hits = cast(offsets_above_faces(), query);
    std::vector<float> from(point_count_, kNoHit);
    for (std::size_t i = 0; i < point_count_; ++i) {
      if (needs_.found[i] == 0 || face_heights_[i] > max_wall_height_) continue;
      from[i] = std::min(face_heights_[i], 0.0F) - max_wall_height_;
    }
    query.two_sided = false;
    const Hits inward_hits = cast(from, query, true);
    needs_.min_outward_height.resize(point_count_);
    needs_.min_inward_depth.resize(point_count_);
    needs_.max_outward_height.resize(point_count_);
    needs_.max_inward_depth.resize(point_count_);
    for (std::size_t i = 0; i < point_count_; ++i)
      needs_.direction.push_back(to_float(direction(i)));
    for (std::size_t i = 0; i < point_count_; ++i) {
      needs_.min_outward_height[i] = std::max(face_heights_[i], 0.0F);
      needs_.min_inward_depth[i] = std::max(-face_heights_[i], 0.0F);
      needs_.max_outward_height[i] =
          std::min({outward_hits.at[i], outward_limits_[i], max_height_});
      needs_.max_inward_depth[i] = inward_hits.at[i] < kNoHit ? -inward_hits.at[i] : kNoHit;
    }
  }

  const MatchRequest& request_;
  cl::Context& context_;
  const Parts* parts_;
  float max_height_ = 0, max_depth_ = 0, min_clearance_ = 0, max_wall_height_ = 0,
        max_own_face_height_ = 0;
  CageNeeds needs_;
  std::size_t point_count_ = 0;
  std::vector<float> points_;  ///< The seven planes of TexelBand::points, with final directions
  /// For each point, the distance at which its outward ray enters the low poly again
  std::vector<float> outward_limits_;
  /// Height of each point's face of the high poly; outward is positive
  std::vector<float> face_heights_;
};

}  // namespace

CageNeeds find_cage_needs(const MatchRequest& request, const SampleDirections& directions,
                          const Parts* parts) {
  return CageSearch(request, directions, parts).run();
}

}  // namespace kiln
