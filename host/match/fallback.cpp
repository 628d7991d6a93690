#include "match/fallback.h"

#include "match/sample_subset.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

/// Copies some elements of one plane of an array. \param count  of the plane
template <typename T>
void pick(cl::Context& context, const cl::Array<T>& from, std::size_t from_offset,
          std::span<const std::uint32_t> places, cl::Array<T>& to, std::size_t to_offset,
          std::uint32_t count) {
  std::vector<T> all(count), some(places.size());
  from.read(context, all, from_offset);
  for (std::size_t i = 0; i < places.size(); ++i) some[i] = all[places[i]];
  to.write(context, std::span<const T>(some), to_offset);
}

/// One method, then others in turn for the samples that are still undecided.
class FallbackMatcher : public Matcher {
 public:
  FallbackMatcher(cl::Context& context, std::unique_ptr<Matcher> first,
                  std::vector<std::unique_ptr<Matcher>> rest)
      : context_(context), first_(std::move(first)), rest_(std::move(rest)) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    deciders_.clear();
    if (band.sample_count == 0) return;
    first_->run(band, match);
    deciders_.assign(band.sample_count, Decider::method);
    const std::vector<std::uint32_t> left = undecided(match, band.sample_count);
    if (left.empty()) return;
    run_fallback(band, left, decided_);
    scatter(left, decided_, match);
    const auto count = static_cast<std::uint32_t>(left.size());
    for (const std::uint32_t sample : left) deciders_[sample] = Decider::fallback;
    for (const std::uint32_t i : undecided(decided_, count)) deciders_[left[i]] = Decider::nothing;
  }

  std::span<const Decider> deciders() const override { return deciders_; }

  void run_fallback(const TexelBand& band, std::span<const std::uint32_t> samples,
                    DeviceCorrespondence& found) override {
    const auto count = static_cast<std::uint32_t>(samples.size());
    ask(*rest_.front(), band, samples, found);
    for (std::size_t k = 1; k < rest_.size(); ++k) {
      const std::vector<std::uint32_t> left = undecided(found, count);
      if (left.empty()) return;
      std::vector<std::uint32_t> of_band(left.size());
      for (std::size_t i = 0; i < left.size(); ++i) of_band[i] = samples[left[i]];
      ask(*rest_[k], band, of_band, next_);
      scatter(left, next_, found);
    }
  }

  void finish(MatchNotes& notes) override {
    first_->finish(notes);
    for (const std::unique_ptr<Matcher>& matcher : rest_) matcher->finish(notes);
  }

 private:
  std::vector<std::uint32_t> undecided(const DeviceCorrespondence& match,
                                       std::uint32_t count) const {
    std::vector<std::uint8_t> status(count);
    match.status.read(context_, status);
    std::vector<std::uint32_t> samples;
    for (std::uint32_t i = 0; i < count; ++i) {
      if (status[i] == KILN_STATUS_MISS) samples.push_back(i);
    }
    return samples;
  }

  /// Asks one of the fallbacks for some samples of a band, in their order.
  void ask(Matcher& matcher, const TexelBand& band, std::span<const std::uint32_t> samples,
           DeviceCorrespondence& found) {
    const auto count = static_cast<std::uint32_t>(samples.size());
    fit(found, count);
    if (matcher.needs_band()) {
      fit(whole_, band.capacity);
      matcher.run(band, whole_);
      pick(context_, whole_.triangle, 0, samples, found.triangle, 0, band.sample_count);
      pick(context_, whole_.barycentric, 0, samples, found.barycentric, 0, band.sample_count);
      pick(context_, whole_.barycentric, whole_.capacity, samples, found.barycentric,
           found.capacity, band.sample_count);
      pick(context_, whole_.distance, 0, samples, found.distance, 0, band.sample_count);
      pick(context_, whole_.status, 0, samples, found.status, 0, band.sample_count);
      return;
    }
    matcher.run(SampleSubset(context_, band, samples).band, found);
  }

  /// Planes of results are as long as those of points.
  void fit(DeviceCorrespondence& match, std::uint32_t capacity) const {
    if (match.capacity == capacity) return;
    match = DeviceCorrespondence();
    match = DeviceCorrespondence(context_, capacity);
  }

  void scatter(const std::vector<std::uint32_t>& to, const DeviceCorrespondence& from,
               DeviceCorrespondence& match) const {
    const auto count = static_cast<std::uint32_t>(to.size());
    const cl::Array<std::uint32_t> indices(context_, std::span<const std::uint32_t>(to));
    context_.launch(context_.kernel("match", "kiln_match_scatter"), count, kLocal, count,
                    from.capacity, match.capacity, indices, from.triangle, from.barycentric,
                    from.distance, from.status, match.triangle, match.barycentric, match.distance,
                    match.status);
  }

  cl::Context& context_;
  std::unique_ptr<Matcher> first_;
  std::vector<std::unique_ptr<Matcher>> rest_;
  DeviceCorrespondence decided_, next_, whole_;
  std::vector<Decider> deciders_;
};

}  // namespace

void Matcher::run_fallback(const TexelBand& /*band*/, std::span<const std::uint32_t> /*samples*/,
                           DeviceCorrespondence& /*found*/) {
  throw Error(ErrorCode::internal, "There is no fallback to ask.");
}

std::unique_ptr<Matcher> with_fallbacks(cl::Context& context, std::unique_ptr<Matcher> first,
                                        std::vector<std::unique_ptr<Matcher>> rest) {
  return std::make_unique<FallbackMatcher>(context, std::move(first), std::move(rest));
}

}  // namespace kiln
