// Normals of the high poly at the matched points.
#pragma once

#include "cl/context.h"
#include "kiln/bake.h"
#include "mesh/kernels_shared.h"
#include "mesh/low_surface.h"
#include "source/high_poly.h"
#include "texel/device_correspondence.h"
#include "texel/texels.h"

namespace kiln {

/// Kernel parameters from the options for normals and their space.
kiln_detail_params detail_params(const BakeOptions& options);

/// Variants of the kernels. All give the same bits.
enum class DetailPath {
  automatic,  ///< The path is chosen by the device's type
  plain,      ///< One sample a work-item
  wide,       ///< Eight samples a work-item, in explicit vectors
};

/// Reads normals at a band's correspondences and averages them to texels (kernels/detail/detail.cl).
class NormalDetail {
 public:
  NormalDetail(cl::Context& context, const LowSurface& surface, const SourceAttributes& source,
               const BakeOptions& options, DetailPath path = DetailPath::automatic);

  /// \param image     [rows * width * 3] of the band, interleaved; texels that are not covered stay unchanged
  /// \param coverage  [rows * width]: 1 baked, 2 missed
  void run(const TexelBand& band, const DeviceCorrespondence& match, const cl::Array<float>& image,
           const cl::Array<std::uint8_t>& coverage);

  /// Blends the normals of two correspondences, each as a direction in space.
  /// \param other   has triangles for the samples that are blended, and none for the rest
  /// \param shares  [samples] weight of `match`, 0 to 1
  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares,
                   const cl::Array<float>& image, const cl::Array<std::uint8_t>& coverage);

 private:
  cl::Kernel kernel(const char* family, const char* name) const;
  std::size_t items(const TexelBand& band) const;
  void describe(const TexelBand& band, const DeviceCorrespondence& match);
  void prepare(const TexelBand& band, const DeviceCorrespondence& match);
  void resolve(const TexelBand& band, const DeviceCorrespondence& match,
               const cl::Array<float>& image, const cl::Array<std::uint8_t>& coverage);

  cl::Context& context_;
  std::size_t width_;  // Number of samples that a work-item computes
  const SourceAttributes& source_;
  cl::Array<kiln_low_shading> shading_;
  cl::Array<float> values_;  // 3 planes, grown to the largest band
  kiln_detail_params detail_{};
  kiln_resolve_params resolve_{};
};

}  // namespace kiln
