#include "detail/normal.h"

#include <optional>
#include <string>
#include <string_view>

#include "detail/device_shading.h"
#include "detail/registry.h"

namespace kiln {
namespace {

// Number of samples per work-item in the kernels with explicit vectors.
constexpr std::size_t kSamplesPerVector = 8;

}  // namespace

kiln_detail_params detail_params(const BakeOptions& options) {
  kiln_detail_params detail{};
  switch (options.encoding.space) {
    case NormalMapSpace::tangent:
      detail.space = options.encoding.bitangent == Bitangent::vertex ? KILN_SPACE_TANGENT_VERTEX
                                                                     : KILN_SPACE_TANGENT;
      break;
    case NormalMapSpace::object:
      detail.space = KILN_SPACE_OBJECT;
      break;
    case NormalMapSpace::face:
      detail.space = KILN_SPACE_FACE;
      break;
  }
  detail.y_scale = options.encoding.flip_y ? -1.0F : 1.0F;
  detail.two_sided = options.match.two_sided ? 1 : 0;
  return detail;
}

NormalDetail::NormalDetail(cl::Context& context, const LowSurface& surface,
                           const SourceAttributes& source, const BakeOptions& options,
                           DetailPath path)
    : context_(context),
      width_((path == DetailPath::automatic ? !context.info().is_gpu : path == DetailPath::wide)
                 ? kSamplesPerVector
                 : 1),
      source_(source),
      shading_(device_shading(context, surface)),
      detail_(detail_params(options)) {
  switch (options.encoding.miss) {
    case MissPolicy::keep:
      resolve_.miss = KILN_MISS_KEEP;
      break;
    case MissPolicy::fill:
      resolve_.miss = KILN_MISS_FILL;
      break;
    case MissPolicy::mark:
      resolve_.miss = KILN_MISS_MARK;
      break;
  }
}

cl::Kernel NormalDetail::kernel(const char* family, const char* name) const {
  return context_.kernel(family, name, width_ == 1 ? "" : "-DKILN_WIDTH=" + std::to_string(width_));
}

std::size_t NormalDetail::count_work_items(const TexelBand& band) const {
  return (band.sample_count + width_ - 1) / width_;
}

void NormalDetail::set_counts(const TexelBand& band, const DeviceCorrespondence& match) {
  detail_.count = band.sample_count;
  detail_.low_capacity = band.capacity;
  detail_.hit_capacity = match.capacity;
  detail_.out_capacity = band.capacity;
}

void NormalDetail::prepare(const TexelBand& band, const DeviceCorrespondence& match) {
  set_counts(band, match);
  if (values_.size() < std::size_t{3} * band.capacity) {
    values_ = cl::Array<float>();
    values_ = cl::Array<float>(context_, std::size_t{3} * band.capacity);
  }
}

void NormalDetail::resolve(const TexelBand& band, const DeviceCorrespondence& match,
                           const cl::Array<float>& image, const cl::Array<std::uint8_t>& coverage) {
  resolve_.texel_count = band.texel_count;
  resolve_.capacity = band.capacity;
  context_.launch(context_.kernel("detail", "kiln_detail_resolve"), band.texel_count, kLocal,
                  resolve_, band.texel_index, band.texel_first, match.triangle, values_, image,
                  coverage);
}

void NormalDetail::run(const TexelBand& band, const DeviceCorrespondence& match,
                       const cl::Array<float>& image, const cl::Array<std::uint8_t>& coverage) {
  if (band.sample_count == 0) return;
  if (band.sample_count == band.texel_count) {
    set_counts(band, match);
    resolve_.texel_count = band.texel_count;
    context_.launch(kernel("detail_texel", "kiln_detail_bake_texels"), count_work_items(band),
                    kLocal, detail_, resolve_, band.texel_index, band.triangle, band.barycentric,
                    shading_, match.triangle, match.barycentric, source_.normal_indices,
                    source_.normals, image, coverage);
    return;
  }
  prepare(band, match);
  context_.launch(kernel("detail", "kiln_detail_compute_normals"), count_work_items(band), kLocal,
                  detail_, band.triangle, band.barycentric, shading_, match.triangle,
                  match.barycentric, source_.normal_indices, source_.normals, values_);
  resolve(band, match, image, coverage);
}

void NormalDetail::run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                               const DeviceCorrespondence& other, const cl::Array<float>& shares,
                               const cl::Array<float>& image,
                               const cl::Array<std::uint8_t>& coverage) {
  if (band.sample_count == 0) return;
  prepare(band, match);
  context_.launch(kernel("detail", "kiln_detail_blend"), count_work_items(band), kLocal, detail_,
                  other.capacity, band.triangle, band.barycentric, shading_, match.triangle,
                  match.barycentric, other.triangle, other.barycentric, shares,
                  source_.normal_indices, source_.normals, values_);
  resolve(band, match, image, coverage);
}

namespace {

class NormalReader : public MapMaker {
 public:
  NormalReader(const MapRequest& request, const BakeOptions& options)
      : context_(context_of(request.source.device)),
        detail_(context_, request.surface, request.source.attributes, options) {}

  void run(const TexelBand& band, const DeviceCorrespondence& match,
           const BandPixels& out) override {
    clear_outputs(out);
    detail_.run(band, match, image_, coverage_);
    download_outputs(out);
  }

  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares,
                   const BandPixels& out) override {
    clear_outputs(out);
    detail_.run_blended(band, match, other, shares, image_, coverage_);
    download_outputs(out);
  }

 private:
  void clear_outputs(const BandPixels& out) {
    if (coverage_.size() < out.coverage.size()) {
      image_ = cl::Array<float>();
      image_ = cl::Array<float>(context_, out.values.size());
      coverage_ = cl::Array<std::uint8_t>(context_, out.coverage.size());
    }
    context_.fill(image_, 0.0F);
    context_.fill(coverage_, std::uint8_t{0});
  }

  void download_outputs(const BandPixels& out) {
    image_.read(context_, out.values);
    coverage_.read(context_, out.coverage);
  }

  cl::Context& context_;
  NormalDetail detail_;
  cl::Array<float> image_;
  cl::Array<std::uint8_t> coverage_;
};

MapRow make_normal_row(MapKind kind, std::string_view contents,
                       std::optional<NormalMapSpace> space) {
  MapRow row;
  row.info = {kind, 3, MapType::unit_vector, contents, 0, 1};
  row.info.space = space;
  row.supports_streaming = true;
  row.make = [info = row.info](const MapRequest& request) -> std::unique_ptr<MapMaker> {
    BakeOptions options = request.options;
    options.encoding.space = space_of(info, options);
    return std::make_unique<NormalReader>(request, options);
  };
  return row;
}

}  // namespace

MapRow normal_map() {
  MapRow row =
      make_normal_row(MapKind::normal, "normal of the high poly, in the requested space", {});
  row.is_shading_normal = true;
  row.info.other_names = "tangent_normal";
  return row;
}

MapRow normal_object_map() {
  MapRow row = make_normal_row(MapKind{"normal_object"}, "normal of the high poly, in object space",
                               NormalMapSpace::object);
  row.info.other_names = "object_normal world_normal wsnormal world_space_normal";
  return row;
}

MapRow normal_face_map() {
  return make_normal_row(MapKind{"normal_face"},
                         "normal of the high poly, in a frame of the low poly's face",
                         NormalMapSpace::face);
}

}  // namespace kiln
