#include "match/fallback.h"

#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::size_t kLocal = 64;

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

  void finish(MatchNotes& notes) override { first_->finish(notes); }

 private:
  cl::Context& context_;
  std::unique_ptr<Matcher> first_, second_;
  TexelBand rest_band_;  // its points and their count, no more
  Correspondence rest_;
  std::vector<Decider> deciders_;
};

}  // namespace

void Matcher::run_fallback(const TexelBand& /*band*/, std::span<const std::uint32_t> /*samples*/,
                           Correspondence& /*found*/) {
  throw Error(ErrorCode::internal, "There is no fallback to ask.");
}

std::unique_ptr<Matcher> with_fallback(cl::Context& context, std::unique_ptr<Matcher> first,
                                       std::unique_ptr<Matcher> second) {
  return std::make_unique<FallbackMatcher>(context, std::move(first), std::move(second));
}

}  // namespace kiln
