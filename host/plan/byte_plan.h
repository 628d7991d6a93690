// Plans the low poly whose file has the smallest error within a byte budget.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kiln/plan.h"
#include "plan/picture_fit.h"

namespace kiln {

/// The byte budget, and callbacks for the contents of the file.
struct BytePlanOptions {
  /// Maps to bake and the measure of error. `max_error` only determines LowPolyPlan::reached (0: ignored). `bounds`
  /// must be empty.
  LowPolyPlanOptions plan = {};
  std::uint64_t max_bytes = 0;  ///< Maximum bytes of the whole file
  PictureFitOptions pictures = {};
  /// Callback that creates the file's pictures from a bake's maps and its coverage; it may modify
  /// the maps
  std::function<AssetMaps(std::vector<BakedMap>&, std::span<const std::uint8_t>)> maps_of = {};
  /// Callback that returns the bytes of the file without its pictures, for a low poly
  std::function<std::uint64_t(const Mesh&)> mesh_bytes = {};
};

/// One picture of a trial: its size, encoding and error.
struct TrialPicture {
  PictureSlot picture = PictureSlot::normal;
  std::uint32_t width = 0, height = 0;
  PictureFormat format = PictureFormat::png;
  std::uint32_t quality = 0;  ///< Quality of the encoding; 0: lossless
  std::uint64_t bytes = 0;
  PictureError error;
};

/// A low poly that was built, with the best pictures that fit in the remaining bytes.
struct ByteTrial {
  std::uint64_t faces = 0;
  std::uint64_t mesh_bytes = 0;  ///< Bytes of the file without pictures
  std::uint64_t bytes = 0;  ///< Bytes of the file; above the budget if no choice of pictures fits
  double expected = 0;      ///< Predicted error in steps of 1/255; 0: not predicted
  double error =
      0;  ///< Error of all pictures in steps of 1/255; interpolated at qualities between measured ones
  double degrees = 0;       ///< Error of normals, in degrees
  std::uint32_t baked = 0;  ///< Side of the baked maps in texels
  bool fits = false;
  /// True if normals are smooth except at seams; false if there are hard edges along the high
  /// poly's hard edges
  bool has_smooth_normals = false;
  std::vector<TrialPicture> pictures;
};

struct BytePlan {
  LowPolyPlan plan;  ///< `result` has all maps at the largest size that a picture needs
  std::vector<ByteTrial> trials;  ///< All low polys, in the order in which they were built
  std::size_t chosen = 0;         ///< Index of the chosen low poly in `trials`
  /// Errors of the pictures other than normals: the difference between the picture at the size of `plan`'s bake and the
  /// same picture at the largest baked size, in steps of 1/255.
  std::vector<std::pair<PictureSlot, double>> picture_errors;
};

/// Lists a fit's choice for each picture, for reports.
std::vector<TrialPicture> trial_pictures(std::span<const PictureEncodings> encodings_by_picture,
                                         const PictureFit& fit);

/// Plans faces, sizes and encodings together. For a given mesh, least_error() computes the best sizes and encodings
/// directly, so only the face count is searched: see README.md.
/// \throws as plan_low_poly(); Error(usage) if no low poly fits, with the bytes of the smallest file
BytePlan plan_within_bytes(const Source& source, const Mesh& high, const BytePlanOptions& options);

}  // namespace kiln
