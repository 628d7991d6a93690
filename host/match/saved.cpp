#include "match/saved.h"

#include "match/match_array.h"

namespace kiln {
namespace {

/// Returns a saved correspondence.
class SavedMatcher : public Matcher {
 public:
  SavedMatcher(cl::Context& context, const Match& saved, double unit)
      : context_(context), saved_(saved), unit_length_(unit) {}

  void run(const TexelBand& band, DeviceCorrespondence& match) override {
    check_samples(band, saved_.samples);
    load_band(context_, band, saved_, unit_length_, match);
  }
  bool reads_sample_positions() const override { return true; }

 private:
  cl::Context& context_;
  const Match& saved_;
  double unit_length_;
};

}  // namespace

std::unique_ptr<Matcher> saved_matcher(cl::Context& context, const Match& saved, double unit) {
  return std::make_unique<SavedMatcher>(context, saved, unit);
}

}  // namespace kiln
