// Whether hard edges at UV seams suit a low poly's map.
#include <algorithm>
#include <optional>

#include "job/stages.h"
#include "kiln/render.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// Mean error of rendered normals of a low poly with a small map of its own, degrees; none where nothing matched.
std::optional<double> rendered_error(const BakeScene& scene, const Source& source, const Mesh& low,
                                     const BakeOptions& full, const ScreenPictures& pictures) {
  constexpr std::uint32_t kMaxSize = 256;  // texels
  const BakeOptions plain;
  BakeOptions options = full;
  options.width = std::min(options.width, kMaxSize);
  options.height = std::min(options.height, kMaxSize);
  options.maps = plain.maps;
  options.encoding.space = plain.encoding.space;
  options.encoding.bitangent = plain.encoding.bitangent;
  options.encoding.flip_y = options.encoding.two_component = options.encoding.raw =
      options.encoding.mips = false;
  options.report = {.recall = 0};
  options.encoding.ranges = {};
  options.transfers = {};
  options.own_maps = {};
  options.variants = {};
  options.progress = {};
  const BakeResult result = bake_from(scene.high.input, source, low, options);
  if (result.cancelled || result.report.missed == result.report.samples) return std::nullopt;
  return pictures.degrees(low, result.maps[0].image, options);
}

}  // namespace

void judge_seams(const BakeScene& scene, const Source& source, const BakeOptions& options,
                 LowMesh& low) {
  // A warning is given only if splitting the seams reduces the error at least to this share.
  constexpr double kWorthWarning = 0.98;
  constexpr std::uint32_t kPictureSize = 64;  // pixels
  if (!low.unsplit && !low.seam_warning) return;
  std::vector<Warning>& warnings = scene.run.log.warnings;
  // No trial: a saved match is valid for one size of the map and for LOW unchanged, and one trial map would overlay
  // the layouts of several sets.
  if (has_saved_match(scene.run.job) || !scene.sets.empty()) {
    if (low.seam_warning) warnings.push_back(*low.seam_warning);
    return;
  }
  const ScreenPictures pictures(source, kPictureSize);
  const Mesh other = low.unsplit ? std::move(*low.unsplit) : split_at_seams(low.mesh);
  const Mesh &whole = low.unsplit ? other : low.mesh, &split = low.unsplit ? low.mesh : other;
  const std::optional<double> of_whole = rendered_error(scene, source, whole, options, pictures);
  const std::optional<double> of_split = rendered_error(scene, source, split, options, pictures);
  if (low.seam_warning) {
    if (of_whole && of_split && *of_split < kWorthWarning * *of_whole) {
      warnings.push_back(*low.seam_warning);
    }
    return;
  }
  if (!of_whole || !of_split || *of_split <= *of_whole) return;
  const std::string text = formatted(
      ": with hard edges at its seams, LOW and its map are %.3g degrees "
      "off HIGH's normals; as they are, %.3g. Its normals were left as they are.",
      *of_split, *of_whole);
  warnings.push_back({"seams-kept", option("split_at_seams") + text, low.soft_seams});
  low.mesh = other;
}

}  // namespace kiln
