#include "match/cage_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "base/parallel.h"
#include "match/host_correspondence.h"
#include "match/low_rays.h"
#include "match/part_matcher.h"
#include "mesh/vector.h"
#include "shared/ray.h"

namespace kiln {
namespace {

constexpr std::size_t kSearchPlaces = 1 << 18;
// Shares of the high poly's diagonal.
constexpr double kFarthestShell = 0.25;  // that a solid may reach out
constexpr double kDeepest = 0.1;         // that a face may lie in
constexpr double kCovered = 0.001;       // nearer below another part nobody sees a place
constexpr double kFloating = 0.0025;     // farther out a face says nothing of the wall below
constexpr double kNear = 0.0025;         // so near nobody asks whose a face is
constexpr float kForeign = 0.5F;         // nearer than this share of the ray's way: another place's
constexpr int kSolids = 4;               // one over another
constexpr float kStep = 4 * KILN_BVH_EPSILON;  // past a face
constexpr float kNoShell = std::numeric_limits<float>::infinity();

class Search {
 public:
  Search(const MatchRequest& request, const EdgeTurn& turn, const Parts* parts)
      : request_(request), context_(context_of(request.source.device)), parts_(parts) {
    const double diagonal = request.source.frame.diagonal * request.source.frame.scale;
    farthest_ = static_cast<float>(kFarthestShell * diagonal);
    deepest_ = static_cast<float>(std::max(request.distance, kDeepest * diagonal));
    covered_ = static_cast<float>(kCovered * diagonal);
    floating_ = static_cast<float>(kFloating * diagonal);
    near_ = static_cast<float>(kNear * diagonal);
    needs_.places = spread_places(context_, request.surface, kSearchPlaces);
    turn.apply(context_, needs_.places.band);
    count_ = needs_.places.list.size();
    points_.resize(7 * count_);
    needs_.places.band.points.read(context_, points_);
  }

  CageNeeds run() {
    const LowRays low(context_, request_.surface);
    const cl::Array<float> limits(context_, count_);
    low.limits(context_, needs_.places.band, farthest_, limits, 0);
    limit_ = limits.download(context_);
    needs_.counts.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) needs_.counts[i] = limit_[i] >= covered_ ? 1 : 0;
    look();
    for (int i = 0; i < kSolids && follow_solids(); ++i) {
    }
    look_inward();
    leave_out_foreign(low);
    bound();
    return std::move(needs_);
  }

 private:
  struct Hits {
    std::vector<float> at;             ///< Along the direction, from the place; infinity: none
    std::vector<std::uint8_t> leaves;  ///< The face looks along the direction
  };

  /// The first faces of rays that leave at `from` off the places; those at infinity do not.
  /// \param backs  along the reversed direction, so that without two_sided backs alone are met
  Hits cast(const std::vector<float>& from, const RayQuery& query, bool backs = false) const {
    std::vector<float> planes = points_;
    for (std::size_t i = 0; i < count_; ++i) {
      const bool casts = from[i] < kNoShell;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        float& d = planes[(3 + axis) * count_ + i];
        if (casts) planes[axis * count_ + i] += from[i] * d;
        if (!casts) d = 0;
        if (backs) d = -d;
      }
    }
    const cl::Array<float> points(context_, std::span<const float>(planes));
    const auto count = static_cast<std::uint32_t>(count_);
    DeviceCorrespondence met(context_, count);
    request_.source.rays().intersect(points, count, count, query, met);
    const HostCorrespondence found(context_, met, count);
    Hits hits{std::vector<float>(count_, kNoShell), std::vector<std::uint8_t>(count_)};
    parallel_for(count_, 1 << 12, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t t = found.triangle[i];
        if (t == KILN_NO_TRIANGLE || !(from[i] < kNoShell) || !own(i, t)) continue;
        hits.at[i] = from[i] + (backs ? -found.distance[i] : found.distance[i]);
        hits.leaves[i] = dot(normal(t), direction(i)) > 0 ? 1 : 0;
      }
    });
    return hits;
  }

  /// True if a face is of the part that the place belongs to.
  bool own(std::size_t i, std::uint32_t triangle) const {
    return parts_ == nullptr ||
           parts_->high[triangle] == parts_->low[needs_.places.list[i].triangle];
  }

  Vec3d normal(std::uint32_t triangle) const {
    const std::vector<Vec3>& p = request_.source.positions;
    const Triangle& t = request_.source.triangles[triangle];
    return cross(Vec3d(p[t[1]]) - Vec3d(p[t[0]]), Vec3d(p[t[2]]) - Vec3d(p[t[0]]));
  }

  Vec3d direction(std::size_t i) const {
    return {points_[3 * count_ + i], points_[4 * count_ + i], points_[5 * count_ + i]};
  }

  HostCorrespondence match(const MatchRequest& request) const {
    MatchNotes notes;
    const MatchRow row = ray_match();
    const std::unique_ptr<Matcher> matcher =
        parts_ != nullptr ? part_matcher(row, request, *parts_, notes) : row.make(request, notes);
    const auto count = static_cast<std::uint32_t>(count_);
    DeviceCorrespondence met(context_, count);
    matcher->run(needs_.places.band, met);
    return HostCorrespondence(context_, met, count);
  }

  /// The faces that the bake itself would find.
  void look() {
    const HostCorrespondence found = match(request_);
    height_.resize(count_);
    needs_.found.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      needs_.found[i] = needs_.counts[i] != 0 && found.triangle[i] != KILN_NO_TRIANGLE ? 1 : 0;
      height_[i] = needs_.found[i] != 0 ? found.distance[i] : 0;
    }
  }

  /// Starts of rays just above each place's own face.
  std::vector<float> above() const {
    std::vector<float> from(count_, kNoShell);
    for (std::size_t i = 0; i < count_; ++i) {
      if (needs_.counts[i] != 0) from[i] = std::max(height_[i], 0.0F) + kStep;
    }
    return from;
  }

  /// Solids that begin within the distance and end beyond: above the face, or under it, as what is sunk in
  /// does. \returns whether there were any
  bool follow_solids() {
    RayQuery query;
    query.t_max = farthest_;
    query.two_sided = true;
    const Hits first = cast(above(), query);
    std::vector<float> from(count_, kNoShell), below(count_, kNoShell);
    for (std::size_t i = 0; i < count_; ++i) {
      const float most = std::min(limit_[i], static_cast<float>(request_.distance));
      if (first.leaves[i] == 0 && first.at[i] <= most) from[i] = first.at[i] + kStep;
      if (first.leaves[i] != 0 && needs_.found[i] != 0) below[i] = height_[i] + kStep;
    }
    query.two_sided = false;
    query.t_max = static_cast<float>(request_.distance);
    const Hits entered = cast(below, query, true);
    query.t_max = farthest_;
    query.two_sided = request_.two_sided;
    const Hits last = cast(from, query);
    bool any = false;
    for (std::size_t i = 0; i < count_; ++i) {
      const Hits& top = entered.at[i] < kNoShell ? first : last;
      if (!(top.at[i] < std::min(limit_[i], farthest_))) continue;
      if (from[i] == kNoShell && !(entered.at[i] < kNoShell)) continue;
      height_[i] = top.at[i];
      needs_.found[i] = 1;
      any = true;
    }
    return any;
  }

  /// Faces that lie much nearer to another place of the low poly belong there: rays slip past a stamp on a
  /// wall beside them, or past the edge of another part. These places take the nearest face instead.
  void leave_out_foreign(const LowRays& low) {
    const std::vector<std::uint8_t> foreign = foreign_faces(low);
    if (std::find(foreign.begin(), foreign.end(), 1) == foreign.end()) return;
    MatchRequest request = request_;
    request.ray.rule = RayRule::nearest;
    const HostCorrespondence nearest = match(request);
    for (std::size_t i = 0; i < count_; ++i) {
      if (foreign[i] == 0) continue;
      needs_.found[i] = nearest.triangle[i] != KILN_NO_TRIANGLE ? 1 : 0;
      height_[i] = needs_.found[i] != 0 ? nearest.distance[i] : 0;
    }
    const std::vector<std::uint8_t> again = foreign_faces(low);
    for (std::size_t i = 0; i < count_; ++i) {
      if (again[i] == 0) continue;
      needs_.found[i] = 0;
      height_[i] = 0;
    }
  }

  std::vector<std::uint8_t> foreign_faces(const LowRays& low) const {
    std::vector<float> faces = points_;
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        faces[axis * count_ + i] += height_[i] * points_[(3 + axis) * count_ + i];
      }
    }
    const std::vector<float> off = low.distances(context_, faces, farthest_);
    std::vector<std::uint8_t> foreign(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const float height = std::abs(height_[i]);
      foreign[i] = needs_.found[i] != 0 && height > near_ && off[i] < kForeign * height ? 1 : 0;
    }
    return foreign;
  }

  /// For places without a face.
  void look_inward() {
    std::vector<float> from(count_, kNoShell);
    for (std::size_t i = 0; i < count_; ++i) {
      if (needs_.counts[i] != 0 && needs_.found[i] == 0) from[i] = 0;
    }
    RayQuery query;
    query.inward = true;
    query.t_max = deepest_;
    query.two_sided = request_.two_sided;
    const Hits hits = cast(from, query);
    for (std::size_t i = 0; i < count_; ++i) {
      if (!(hits.at[i] < kNoShell)) continue;
      height_[i] = hits.at[i];
      needs_.found[i] = 1;
    }
  }

  /// Finds the next faces above and below.
  void bound() {
    RayQuery query;
    query.t_max = farthest_;
    query.two_sided = true;
    const Hits up = cast(above(), query);
    std::vector<float> from(count_, kNoShell);
    for (std::size_t i = 0; i < count_; ++i) {
      if (needs_.found[i] == 0 || height_[i] > floating_) continue;
      from[i] = std::min(height_[i], 0.0F) - floating_;
    }
    query.two_sided = false;
    const Hits down = cast(from, query, true);
    needs_.outward.resize(count_);
    needs_.inward.resize(count_);
    needs_.outward_most.resize(count_);
    needs_.inward_most.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) needs_.direction.push_back(to_float(direction(i)));
    for (std::size_t i = 0; i < count_; ++i) {
      needs_.outward[i] = std::max(height_[i], 0.0F);
      needs_.inward[i] = std::max(-height_[i], 0.0F);
      needs_.outward_most[i] = std::min({up.at[i], limit_[i], farthest_});
      needs_.inward_most[i] = down.at[i] < kNoShell ? -down.at[i] : kNoShell;
    }
  }

  const MatchRequest& request_;
  cl::Context& context_;
  const Parts* parts_;
  float farthest_ = 0, deepest_ = 0, covered_ = 0, floating_ = 0, near_ = 0;
  CageNeeds needs_;
  std::size_t count_ = 0;
  std::vector<float> points_;  ///< Seven planes, after turning
  std::vector<float> limit_;   ///< Distance at which the ray meets the low poly again
  std::vector<float> height_;  ///< Heights over the places' faces, outward
};

}  // namespace

CageNeeds find_cage_needs(const MatchRequest& request, const EdgeTurn& turn, const Parts* parts) {
  return Search(request, turn, parts).run();
}

}  // namespace kiln
