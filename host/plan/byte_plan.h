// The low poly whose file shows the least error within a number of bytes.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "kiln/plan.h"
#include "plan/picture_fit.h"

namespace kiln {

/// The bytes to stay within, and what the file holds beside the pictures.
struct BytePlanOptions {
  /// What to bake, and how the error is measured. `max_error` is only compared with what is reached; 0: it is not. No `bounds`.
  LowPolyPlanOptions plan = {};
  std::uint64_t max_bytes = 0;  ///< Of the whole file
  PictureFitOptions pictures = {};
  /// The pictures that a bake's maps become. May change them
  std::function<AssetMaps(std::vector<BakedMap>&)> maps_of = {};
  /// Bytes of the file without its pictures
  std::function<std::uint64_t(const Mesh&)> mesh_bytes = {};
};

/// A picture of a trial.
struct TrialPicture {
  PictureSlot picture = PictureSlot::normal;
  std::uint32_t width = 0, height = 0;
  PictureFormat format = PictureFormat::png;
  std::uint32_t quality = 0;  ///< 0: lossless
  std::uint64_t bytes = 0;
  PictureError error;
};

/// A low poly that was made, and the best that fits beside it.
struct ByteTrial {
  std::uint64_t faces = 0;
  std::uint64_t mesh_bytes = 0;  ///< Of the file without pictures
  std::uint64_t bytes = 0;       ///< Of the file; above the bound: nothing fits
  double expected = 0;           ///< Steps of 1/255, before it was made; 0: unknown
  double error = 0;              ///< Steps of 1/255, all pictures
  double degrees = 0;            ///< Of normals
  std::uint32_t baked = 0;       ///< Side of the bake, texels
  bool fits = false;
  std::vector<TrialPicture> pictures;
};

struct BytePlan {
  LowPolyPlan plan;  ///< `result` has all maps at the largest size that a picture needs
  std::vector<ByteTrial> trials;  ///< In order
  std::size_t chosen = 0;         ///< Index into `trials`
  /// Error, in steps, of pictures other than normals at the size of `plan`'s bake, against the largest that was baked.
  std::vector<std::pair<PictureSlot, double>> coarseness;
};

/// The choices of a fit, for reports.
std::vector<TrialPicture> trial_pictures(std::span<const PictureLadder> ladders,
                                         const PictureFit& fit);

/// Plans faces, sizes and encodings together. Of any mesh the pictures' sizes and encodings follow by least_error(), exactly.
/// What is searched is the number of faces: see README.md.
/// \throws as plan_low_poly(); Error(usage) where nothing fits, with the smallest bytes that do
BytePlan plan_within_bytes(const Source& source, const Mesh& high, const BytePlanOptions& options);

}  // namespace kiln
