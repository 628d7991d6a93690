// The bent normal: the mean unoccluded direction.
#include "detail/hemisphere_map.h"
#include "detail/normal.h"

namespace kiln {
namespace {

class BentNormal : public MapMaker {
 public:
  explicit BentNormal(const MapRequest& request)
      : context_(context_of(request.source.device)),
        source_(request.source),
        band_reads_(request.reads()),
        miss_policy_(request.options.encoding.miss),
        detail_(detail_params(request.options)),
        rays_(request.shared.of<Hemispheres>(request)) {
    rays_->request_bent_sum();
  }

  void report(BakedMap& map, std::vector<Warning>&) const override {
    map.occlusion = rays_->report();
  }

  void run(const TexelBand& band, const DeviceCorrespondence& match,
           const BandPixels& out) override {
    if (band.sample_count == 0) return;
    const DeviceCorrespondence no_match;
    make(band, match, no_match, no_bent_sum_, no_bent_sum_, out);
  }

  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares,
                   const BandPixels& out) override {
    if (band.sample_count == 0) return;
    make(band, match, other, rays_->bent_sum(band, other, true), shares, out);
  }

 private:
  /// \param other  second correspondence, if two are blended; otherwise its capacity is 0
  void make(const TexelBand& band, const DeviceCorrespondence& match,
            const DeviceCorrespondence& other, const cl::Array<float>& other_bent_sum,
            const cl::Array<float>& shares, const BandPixels& out) {
    const std::uint32_t plane = Hemispheres::plane_of(band);
    detail_.count = band.sample_count;
    detail_.low_capacity = band.capacity;
    detail_.hit_capacity = match.capacity;
    detail_.out_capacity = plane;
    const cl::Array<float>& bent_sum = rays_->bent_sum(band, match, false);
    const cl::Array<float> values(context_, std::size_t{3} * plane);
    context_.launch(context_.kernel("hemisphere", "kiln_hemisphere_write_bent"), band.sample_count,
                    kLocal, detail_, other.capacity, band.triangle, band.barycentric,
                    rays_->shading(), match.triangle, match.barycentric, bent_sum, other.triangle,
                    other.barycentric, other_bent_sum, shares, source_.attributes.normal_indices,
                    source_.attributes.normals, values);
    average_samples(*band_reads_, band, match, miss_policy_, values.download(context_), plane, out);
  }

  cl::Context& context_;
  const Source::Impl& source_;
  std::shared_ptr<BandReads> band_reads_;
  MissPolicy miss_policy_;
  kiln_detail_params detail_;
  std::shared_ptr<Hemispheres> rays_;
  const cl::Array<float> no_bent_sum_;
};

}  // namespace

MapRow bent_normal_map() {
  MapRow row;
  row.info = {MapKind{"bent_normal"},
              3,
              MapType::unit_vector,
              "bent normal: the mean unoccluded direction, in the requested space",
              0,
              1};
  row.info.options =
      "occlusion.by occlusion.views occlusion.rays occlusion.distance occlusion.falloff "
      "occlusion.back_faces occlusion.by_high occlusion.by_low occlusion.by_others "
      "occlusion.own_part";
  row.info.other_names = "bent";
  row.follows_positions = row.reads_around = row.supports_streaming = true;
  row.make = [](const MapRequest& request) -> std::unique_ptr<MapMaker> {
    return std::make_unique<BentNormal>(request);
  };
  return row;
}

}  // namespace kiln
