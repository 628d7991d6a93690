// The map `mask`: the share of a texel's samples that found a point; 0 in empty texels and padding.
// It serves to compare maps without their padding, and as the alpha of foliage cards.
#include "detail/registry.h"
#include "image/gutter.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

class MaskMap : public MapMaker {
 public:
  explicit MaskMap(const MapRequest& request) : reads_(request.reads()) {}

  void run(const TexelBand& band, const DeviceCorrespondence& match,
           const BandPixels& out) override {
    if (band.sample_count == 0) return;
    const std::vector<std::uint32_t>& index = reads_->read(band.texel_index, band.texel_count);
    const std::vector<std::uint32_t>& first =
        reads_->read(band.texel_first, band.texel_count + std::size_t{1});
    const std::vector<std::uint32_t>& triangle = reads_->read(match.triangle, band.sample_count);
    for (std::size_t t = 0; t < index.size(); ++t) {
      std::uint32_t found_count = 0;
      for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) {
        found_count += triangle[s] != KILN_NO_TRIANGLE ? 1 : 0;
      }
      const auto sample_count = static_cast<float>(first[t + 1] - first[t]);
      out.values[index[t]] = static_cast<float>(found_count) / sample_count;
      out.coverage[index[t]] = found_count > 0 ? kCoverageBaked : kCoverageMissed;
    }
  }

  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence&, const cl::Array<float>&,
                   const BandPixels& out) override {
    run(band, match, out);
  }

 private:
  std::shared_ptr<BandReads> reads_;
};

}  // namespace

MapRow mask_map() {
  MapRow row;
  row.info = {MapKind::mask,
              1,
              MapType::coverage,
              "1 for baked texels, 0 for others; with several samples a texel, the share of them "
              "that found a point: keeps padding out of comparisons and composites, and serves as "
              "the alpha of foliage",
              0,
              1};
  row.supports_streaming = true;
  row.make = [](const MapRequest& request) -> std::unique_ptr<MapMaker> {
    return std::make_unique<MaskMap>(request);
  };
  return row;
}

}  // namespace kiln
