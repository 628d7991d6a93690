#include "match/fallback.h"

#include <algorithm>

#include "mesh/kernels_shared.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

/// Runs one method, and then one fallback after another for the samples that still have no point.
class FallbackMatcher : public Matcher {
 public:
  FallbackMatcher(cl::Context& context, std::unique_ptr<Matcher> first,
                  std::vector<std::unique_ptr<Matcher>> fallbacks)
      : context_(context), primary_matcher_(std::move(first)), fallbacks_(std::move(fallbacks)) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    deciding_methods_.clear();
    if (band.sample_count == 0) return;
    primary_matcher_->run(band, match);
    deciding_methods_.assign(band.sample_count, DecidingMethod::method);
    const std::vector<std::uint32_t> undecided_samples = find_undecided(match, band.sample_count);
    if (undecided_samples.empty()) return;
    run_fallback(band, undecided_samples, fallback_matches_);
    SamplePick(context_, undecided_samples).scatter_correspondence(fallback_matches_, match);
    const auto count = static_cast<std::uint32_t>(undecided_samples.size());
    for (const std::uint32_t sample : undecided_samples)
      deciding_methods_[sample] = DecidingMethod::fallback;
    for (const std::uint32_t i : find_undecided(fallback_matches_, count))
      deciding_methods_[undecided_samples[i]] = DecidingMethod::nothing;
  }

  std::span<const DecidingMethod> deciding_methods() const override { return deciding_methods_; }

  bool reads_sample_positions() const override {
    return primary_matcher_->reads_sample_positions() ||
           std::any_of(fallbacks_.begin(), fallbacks_.end(),
                       [](const auto& matcher) { return matcher->reads_sample_positions(); });
  }

  void run_fallback(const TexelBand& band, std::span<const std::uint32_t> samples,
                    DeviceCorrespondence& found) override {
    const auto count = static_cast<std::uint32_t>(samples.size());
    run_on_samples(*fallbacks_.front(), band, samples, found);
    for (std::size_t k = 1; k < fallbacks_.size(); ++k) {
      const std::vector<std::uint32_t> undecided_samples = find_undecided(found, count);
      if (undecided_samples.empty()) return;
      std::vector<std::uint32_t> band_indices(undecided_samples.size());
      for (std::size_t i = 0; i < undecided_samples.size(); ++i)
        band_indices[i] = samples[undecided_samples[i]];
      run_on_samples(*fallbacks_[k], band, band_indices, next_fallback_matches_);
      SamplePick(context_, undecided_samples).scatter_correspondence(next_fallback_matches_, found);
    }
  }

  void finish(MatchNotes& notes) override {
    primary_matcher_->finish(notes);
    for (const std::unique_ptr<Matcher>& matcher : fallbacks_) matcher->finish(notes);
  }

 private:
  std::vector<std::uint32_t> find_undecided(const DeviceCorrespondence& match,
                                            std::uint32_t count) const {
    return samples_with(context_, match, count, is_missed);
  }

  /// Runs one of the fallbacks on the given samples of a band, in the order of the list.
  void run_on_samples(Matcher& matcher, const TexelBand& band,
                      std::span<const std::uint32_t> samples, DeviceCorrespondence& found) {
    const SamplePick pick(context_, samples);
    if (matcher.needs_whole_texels()) {
      resize(whole_band_matches_, band.capacity);
      matcher.run(band, whole_band_matches_);
      found = pick.of(whole_band_matches_);
      return;
    }
    resize(found, pick.count());
    matcher.run(pick.gather_points(band), found);
  }

  /// Resizes the arrays of results, so that each component has as many elements as each component of the points.
  void resize(DeviceCorrespondence& match, std::uint32_t capacity) const {
    if (match.capacity == capacity) return;
    match = DeviceCorrespondence();
    match = DeviceCorrespondence(context_, capacity);
  }

  cl::Context& context_;
  std::unique_ptr<Matcher> primary_matcher_;
  std::vector<std::unique_ptr<Matcher>> fallbacks_;
  DeviceCorrespondence fallback_matches_, next_fallback_matches_, whole_band_matches_;
  std::vector<DecidingMethod> deciding_methods_;
};

}  // namespace

void Matcher::run_fallback(const TexelBand& /*band*/, std::span<const std::uint32_t> /*samples*/,
                           DeviceCorrespondence& /*found*/) {
  throw Error(ErrorCode::internal,
              "Internal error: a fallback match was run, but there is no fallback.");
}

std::unique_ptr<Matcher> with_fallbacks(cl::Context& context, std::unique_ptr<Matcher> first,
                                        std::vector<std::unique_ptr<Matcher>> fallbacks) {
  return std::make_unique<FallbackMatcher>(context, std::move(first), std::move(fallbacks));
}

}  // namespace kiln
