#include "lab/assessment_json.h"

namespace kiln::cli {
namespace {

Json json_of(const Distribution& d, double diagonal) {
  return {{"mean", d.mean},
          {"rms", d.rms},
          {"median", d.median},
          {"p95", d.p95},
          {"p99", d.p99},
          {"max", d.max},
          {"mean_of_diagonal", d.mean / diagonal},
          {"area", d.area}};
}

/// In world units.
Json describe_length(const RayMeasure& m, double diagonal) {
  return {{"mean", m.mean},
          {"rms", m.rms},
          {"mean_of_diagonal", m.mean / diagonal},
          {"rms_of_diagonal", m.rms / diagonal},
          {"share_of_rays", m.share}};
}

Json json_of(const Uniformity& u) { return {{"mean_percent", u.mean_percent}, {"pairs", u.pairs}}; }

}  // namespace

Json describe_assessment(const MatchAssessment& a) {
  Json json;
  json["directions"] = a.directions;
  json["object_space"] = describe_length(a.object_space, a.diagonal);
  json["image_space"] = describe_length(a.image_space, a.diagonal);
  json["normalised_image_space"] = {{"mean", a.normalised_image_space.mean},
                                    {"rms", a.normalised_image_space.rms},
                                    {"share_of_rays", a.normalised_image_space.share}};
  json["uniformity"] = json_of(a.uniformity);
  json["uniformity"]["across_seams"] = json_of(a.uniformity_across_seams);
  json["match_distance"] = json_of(a.match_distance, a.diagonal);
  json["image_space_by_place"] = json_of(a.image_space_by_place, a.diagonal);
  json["never_visible"] = a.never_visible;
  json["stretch"] = {
      {"mean_log2", a.mean_stretch}, {"deviation", json_of(a.stretch, 1)}, {"cells", a.cells}};
  json["fold_rate"] = a.folded;
  json["largest_jump"] = {{"distance", a.largest_jump},
                          {"of_diagonal", a.largest_jump / a.diagonal},
                          {"largest_step_of_texels", a.largest_step}};
  return json;
}

}  // namespace kiln::cli
