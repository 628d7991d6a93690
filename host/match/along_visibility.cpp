// Matching by rays along each sample's visibility direction (Tarini, Cignoni, Scopigno, section 3.3), or along a
// direction between that and the normal (section 3.4).
#include "match/ray.h"

namespace kiln {
namespace {

/// Converts a progress callback to one that names this step.
ShareCallback make_share_callback(const Progress& progress) {
  if (!progress) return {};
  return [progress](double done) { return progress(done, "visibility"); };
}

/// Casts rays along visibility directions, or along blends of these and the samples' own directions.
class VisibilityMatcher : public Matcher {
 public:
  VisibilityMatcher(const MatchRequest& request, bool hybrid, VisibilityReport& report)
      : context_(context_of(request.source.device)),
        rays_(request.source.ray_search()),
        query_(ray_query(request, false)),
        samples_per_side_(request.samples),
        is_hybrid_(hybrid),
        cluster_(request.cluster) {
    std::shared_ptr<const VisibilityField> unshared_field;
    std::shared_ptr<const VisibilityField>& field = request.field ? *request.field : unshared_field;
    if (field == nullptr) {
      field = std::make_shared<const VisibilityField>(
          context_, request.surface, request.width, request.height, request.visibility,
          request.source.traversal, report, make_share_callback(request.progress));
    }
    field_ = field;
  }

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    if (band.sample_count == 0) return;
    if (reads_sample_positions()) check_samples(band, samples_per_side_);
    if (points_capacity_ < band.capacity) {
      points_ = cl::Array<float>();
      points_ = cl::Array<float>(context_, std::size_t{7} * band.capacity);
      points_capacity_ = band.capacity;
    }
    field_->write_directed_samples(band, samples_per_side_, is_hybrid_, points_, points_capacity_,
                                   cluster_);
    if (!match.seen.empty())
      field_->means(band, samples_per_side_, match.seen, match.capacity, cluster_);
    rays_.intersect(points_, band.sample_count, points_capacity_, query_, match);
  }

  bool needs_whole_texels() const override { return true; }
  bool reads_sample_positions() const override { return field_->is_of_texels(); }

 private:
  cl::Context& context_;
  const RaySearch& rays_;
  RayQuery query_;
  std::uint32_t samples_per_side_;
  bool is_hybrid_;
  std::uint32_t cluster_;
  std::shared_ptr<const VisibilityField> field_;
  std::uint32_t points_capacity_ = 0;
  cl::Array<float> points_;
};

template <bool kHybrid>
std::unique_ptr<Matcher> make(const MatchRequest& request, MatchNotes& notes) {
  notes.visibility.emplace();
  return std::make_unique<VisibilityMatcher>(request, kHybrid, *notes.visibility);
}

MatchRow row_of(MatchMethod method, std::string_view searches, std::string_view options) {
  MatchRow row;
  row.info.method = method;
  row.info.searches = searches;
  row.info.options = options;
  row.is_refittable = row.supports_large_high_poly = true;
  return row;
}

}  // namespace

MatchRow visibility_match() {
  MatchRow row =
      row_of(MatchMethod::visibility, "along the mean of the directions that see a sample",
             "match.max_distance match.visibility report.recall");
  row.plan_order = 3;
  row.make = make<false>;
  return row;
}

MatchRow hybrid_match() {
  MatchRow row =
      row_of(MatchMethod::hybrid, "along a direction between visibility direction and normal",
             "match.max_distance match.visibility.at match.visibility.test "
             "match.visibility.directions match.visibility.view_size "
             "match.visibility.smoothing match.visibility.likelihood report.recall");
  row.plan_order = row.low_poly_order = 2;
  row.make = make<true>;
  return row;
}

}  // namespace kiln
