// Decides whether hard edges at UV seams improve the normals of a baked low poly.
#include <algorithm>
#include <optional>

#include "job/stages.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// Mean error in degrees of rendered normals for a low poly with a small trial map; nullopt if no texel matched.
std::optional<double> rendered_error(const BakeScene& scene, const Source& source, const Mesh& low,
                                     const BakeOptions& bake_options,
                                     const ScreenPictures& pictures) {
  constexpr std::uint32_t kTrialMapSize = 256;  // texels per side
  const BakeOptions default_options;
  BakeOptions options = bake_options;
  options.width = std::min(options.width, kTrialMapSize);
  options.height = std::min(options.height, kTrialMapSize);
  options.maps = default_options.maps;
  options.encoding.space = default_options.encoding.space;
  options.encoding.bitangent = default_options.encoding.bitangent;
  options.encoding.flip_y = options.encoding.two_component = options.encoding.raw =
      options.encoding.mips = false;
  options.report = {.recall = 0};
  options.encoding.ranges = {};
  options.transfers = {};
  options.own_maps = {};
  options.variants = {};
  options.progress = {};
  const BakeResult result = bake_high(scene.high.input, source, low, options);
  if (result.cancelled || result.report.missed == result.report.samples) return std::nullopt;
  return pictures.degrees(low, result.maps[0].image, options);
}

}  // namespace

void choose_seam_normals(const BakeScene& scene, const Source& source, const BakeOptions& options,
                         LowMesh& low) {
  // A warning requires that split seams reduce the error at least to this share.
  constexpr double kMaxErrorRatio = 0.98;
  constexpr std::uint32_t kTrialPictureSize = 64;  // pixels per side
  if (!low.mesh_before_split && !low.soft_seam_warning) return;
  std::vector<Warning>& warnings = scene.run.log.warnings;
  // No trial is possible with a saved match, which is valid only for one map size and an unchanged LOW, or with several
  // sets, whose layouts would overlap in the trial's single map.
  if (has_saved_match(scene.run.job) || !scene.sets.empty()) {
    if (low.soft_seam_warning) warnings.push_back(*low.soft_seam_warning);
    return;
  }
  const ScreenPictures pictures(source, kTrialPictureSize);
  const Mesh other =
      low.mesh_before_split ? std::move(*low.mesh_before_split) : split_at_seams(low.mesh);
  const Mesh &unsplit_mesh = low.mesh_before_split ? other : low.mesh,
             &split_mesh = low.mesh_before_split ? low.mesh : other;
  const std::optional<double> unsplit_error =
      rendered_error(scene, source, unsplit_mesh, options, pictures);
  const std::optional<double> split_error =
      rendered_error(scene, source, split_mesh, options, pictures);
  if (low.soft_seam_warning) {
    if (unsplit_error && split_error && *split_error < kMaxErrorRatio * *unsplit_error) {
      warnings.push_back(*low.soft_seam_warning);
    }
    return;
  }
  if (!unsplit_error || !split_error || *split_error <= *unsplit_error) return;
  const std::string text = formatted(
      ": with hard edges at its seams, LOW with its map deviates by %.3g degrees from HIGH's "
      "normals; without, by %.3g. Its normals were left as they are.",
      *split_error, *unsplit_error);
  warnings.push_back({"seams-kept", option("split_at_seams") + text, low.soft_seams});
  low.mesh = other;
}

}  // namespace kiln
