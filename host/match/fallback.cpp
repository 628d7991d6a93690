#include "match/fallback.h"

#include <algorithm>

#include "mesh/kernels_shared.h"
#include "texel/sample_pick.h"

namespace kiln {
namespace {

/// Runs one method, then the fallbacks in turn for the samples that are still undecided.
class FallbackMatcher : public Matcher {
 public:
  FallbackMatcher(cl::Context& context, std::unique_ptr<Matcher> first,
                  std::vector<std::unique_ptr<Matcher>> fallbacks)
      : context_(context), first_(std::move(first)), fallbacks_(std::move(fallbacks)) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    deciders_.clear();
    if (band.sample_count == 0) return;
    first_->run(band, match);
    deciders_.assign(band.sample_count, Decider::method);
    const std::vector<std::uint32_t> undecided_samples = undecided(match, band.sample_count);
    if (undecided_samples.empty()) return;
    run_fallback(band, undecided_samples, decided_);
    SamplePick(context_, undecided_samples).put_back(decided_, match);
    const auto count = static_cast<std::uint32_t>(undecided_samples.size());
    for (const std::uint32_t sample : undecided_samples) deciders_[sample] = Decider::fallback;
    for (const std::uint32_t i : undecided(decided_, count))
      deciders_[undecided_samples[i]] = Decider::nothing;
  }

  std::span<const Decider> deciders() const override { return deciders_; }

  bool reads_sample_places() const override {
    return first_->reads_sample_places() ||
           std::any_of(fallbacks_.begin(), fallbacks_.end(),
                       [](const auto& matcher) { return matcher->reads_sample_places(); });
  }

  void run_fallback(const TexelBand& band, std::span<const std::uint32_t> samples,
                    DeviceCorrespondence& found) override {
    const auto count = static_cast<std::uint32_t>(samples.size());
    run_on_samples(*fallbacks_.front(), band, samples, found);
    for (std::size_t k = 1; k < fallbacks_.size(); ++k) {
      const std::vector<std::uint32_t> undecided_samples = undecided(found, count);
      if (undecided_samples.empty()) return;
      std::vector<std::uint32_t> of_band(undecided_samples.size());
      for (std::size_t i = 0; i < undecided_samples.size(); ++i)
        of_band[i] = samples[undecided_samples[i]];
      run_on_samples(*fallbacks_[k], band, of_band, next_);
      SamplePick(context_, undecided_samples).put_back(next_, found);
    }
  }

  void finish(MatchNotes& notes) override {
    first_->finish(notes);
    for (const std::unique_ptr<Matcher>& matcher : fallbacks_) matcher->finish(notes);
  }

 private:
  std::vector<std::uint32_t> undecided(const DeviceCorrespondence& match,
                                       std::uint32_t count) const {
    return samples_with(context_, match, count, is_missed);
  }

  /// Runs one of the fallbacks on some samples of a band, in their order.
  void run_on_samples(Matcher& matcher, const TexelBand& band,
                      std::span<const std::uint32_t> samples, DeviceCorrespondence& found) {
    const SamplePick pick(context_, samples);
    if (matcher.needs_band()) {
      fit(whole_, band.capacity);
      matcher.run(band, whole_);
      found = pick.of(whole_);
      return;
    }
    fit(found, pick.count());
    matcher.run(pick.points_of(band), found);
  }

  /// Resizes planes of results to the length of those of points.
  void fit(DeviceCorrespondence& match, std::uint32_t capacity) const {
    if (match.capacity == capacity) return;
    match = DeviceCorrespondence();
    match = DeviceCorrespondence(context_, capacity);
  }

  cl::Context& context_;
  std::unique_ptr<Matcher> first_;
  std::vector<std::unique_ptr<Matcher>> fallbacks_;
  DeviceCorrespondence decided_, next_, whole_;
  std::vector<Decider> deciders_;
};

}  // namespace

void Matcher::run_fallback(const TexelBand& /*band*/, std::span<const std::uint32_t> /*samples*/,
                           DeviceCorrespondence& /*found*/) {
  throw Error(ErrorCode::internal, "There is no fallback to ask.");
}

std::unique_ptr<Matcher> with_fallbacks(cl::Context& context, std::unique_ptr<Matcher> first,
                                        std::vector<std::unique_ptr<Matcher>> fallbacks) {
  return std::make_unique<FallbackMatcher>(context, std::move(first), std::move(fallbacks));
}

}  // namespace kiln
