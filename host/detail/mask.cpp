// Which texels were baked: 1, and 0 where a texel is empty, padding or missed. For comparing maps without
// their padding.
#include "detail/registry.h"
#include "image/gutter.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

class MaskMap : public MapMaker {
 public:
  explicit MaskMap(const MapRequest& request) : reads_(request.reads()) {}

  void run(const TexelBand& band, const Correspondence& match, const BandPixels& out) override {
    if (band.sample_count == 0) return;
    const std::vector<std::uint32_t>& index = reads_->read(band.texel_index, band.texel_count);
    const std::vector<std::uint32_t>& first =
        reads_->read(band.texel_first, band.texel_count + std::size_t{1});
    const std::vector<std::uint32_t>& triangle = reads_->read(match.triangle, band.sample_count);
    for (std::size_t t = 0; t < index.size(); ++t) {
      bool baked = false;
      for (std::uint32_t s = first[t]; s < first[t + 1]; ++s) {
        baked = baked || triangle[s] != KILN_NO_TRIANGLE;
      }
      out.values[index[t]] = baked ? 1.0F : 0.0F;
      out.coverage[index[t]] = baked ? kCoverageBaked : kCoverageMissed;
    }
  }

  void run_blended(const TexelBand& band, const Correspondence& match, const Correspondence&,
                   const cl::Array<float>&, const BandPixels& out) override {
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
              "which texels were baked, 1 or else 0: leaves padding out of comparisons and "
              "composites",
              0,
              1};
  row.make = [](const MapRequest& request) -> std::unique_ptr<MapMaker> {
    return std::make_unique<MaskMap>(request);
  };
  return row;
}

}  // namespace kiln
