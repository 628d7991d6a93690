// Finds the nearest point on the faces that are not turned away from the sample (Tarini, Cignoni,
// Scopigno, section 3.1).
#include "accel/closest.h"

#include "match/registry.h"

namespace kiln {
namespace {

class ClosestMatcher : public Matcher {
 public:
  ClosestMatcher(const ClosestSearch& finder, const ClosestQuery& query)
      : closest_search_(finder), query_(query) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    closest_search_.find(band.points, band.sample_count, band.capacity, query_, match);
  }

 private:
  const ClosestSearch& closest_search_;
  ClosestQuery query_;
};

}  // namespace

MatchRow closest_match() {
  MatchRow row;
  row.info.method = MatchMethod::closest;
  row.info.searches = "the nearest point of a face that is not turned away";
  row.info.options = "match.max_distance match.parts report.recall";
  row.is_refittable = row.is_good_fallback = row.supports_large_high_poly = true;
  row.info.other_names = "nearest";
  row.plan_order = 4;
  row.low_poly_order = 3;
  row.make = [](const MatchRequest& request, MatchNotes&) -> std::unique_ptr<Matcher> {
    return std::make_unique<ClosestMatcher>(
        request.source.closest_search(),
        ClosestQuery{static_cast<float>(request.distance), request.two_sided});
  };
  return row;
}

}  // namespace kiln
