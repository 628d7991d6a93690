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

/// Parameters of the kernels, from the options for normals.
kiln_detail_params detail_params(const BakeOptions& options);

/// Variants of the kernels. All give bit-identical results.
enum class DetailPath {
  automatic,  ///< `wide` on CPUs, `plain` on GPUs
  plain,      ///< One sample per work-item
  wide,       ///< Eight samples per work-item, in explicit vectors
};

/// Reads the high poly's normals at the points of a band's correspondence, and averages them per
/// texel (kernels/detail/detail.cl).
class NormalDetail {
 public:
  NormalDetail(cl::Context& context, const LowSurface& surface, const SourceAttributes& source,
               const BakeOptions& options, DetailPath path = DetailPath::automatic);

  /// \param image     [rows * width * 3] texels of the band, interleaved; those that are not
  ///   covered stay unchanged
  /// \param coverage  [rows * width] 1 for baked texels, 2 for missed ones
  void run(const TexelBand& band, const DeviceCorrespondence& match, const cl::Array<float>& image,
           const cl::Array<std::uint8_t>& coverage);

  /// Blends the normals of two correspondences, as directions in space.
  /// \param other   second correspondence; it has a triangle for the samples that are blended, and
  ///   none for the rest
  /// \param shares  [samples] weight of `match`, 0 to 1
  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares,
                   const cl::Array<float>& image, const cl::Array<std::uint8_t>& coverage);

 private:
  cl::Kernel kernel(const char* family, const char* name) const;
  std::size_t count_work_items(const TexelBand& band) const;
  void set_counts(const TexelBand& band, const DeviceCorrespondence& match);
  void prepare(const TexelBand& band, const DeviceCorrespondence& match);
  void resolve(const TexelBand& band, const DeviceCorrespondence& match,
               const cl::Array<float>& image, const cl::Array<std::uint8_t>& coverage);

  cl::Context& context_;
  std::size_t width_;  // Number of samples per work-item
  const SourceAttributes& source_;
  cl::Array<kiln_low_shading> shading_;
  // Three arrays, one per component, each as large as the largest band so far
  cl::Array<float> values_;
  kiln_detail_params detail_{};
  kiln_resolve_params resolve_{};
};

}  // namespace kiln
