// Fits a GLB into Job::max_bytes: chooses the low poly, and the sizes and encodings of the pictures.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "asset/gltf_pictures.h"
#include "image/mip_padding.h"
#include "job/map_words.h"
#include "job/stages.h"
#include "measure/normal_probe.h"
#include "mesh/triangle_shape.h"
#include "options/json.h"
#include "options/parse.h"
#include "plan/byte_plan.h"
#include "source/high_poly.h"

namespace kiln {
namespace {

/// Upper bound in bytes for the growth of a GLB's JSON when the final lengths, offsets and counts replace the estimated
/// ones, which may have fewer digits.
constexpr std::uint64_t kMaxJsonGrowthBytes = 512;
/// Share of Job::max_bytes that a plan reserves for images of RunHooks::sample, whose size is unknown at that time.
constexpr double kSampledImagesShare = 1.0 / 3;

PictureFitOptions fit_options(const Job& job) {
  PictureFitOptions fit;
  fit.encode = job.pictures;
  fit.any_format = !job.given.contains("--format");
  fit.max_picture_bytes = job.max_bytes;
  return fit;
}

/// Number of bytes by which the extras, which state Job::max_bytes, grow if that number has the most digits.
std::uint64_t max_extras_growth(const Job& job) {
  constexpr std::uint64_t kMaxDigits = 10;
  return kMaxDigits - std::min<std::uint64_t>(kMaxDigits, std::to_string(job.max_bytes).size());
}

std::uint32_t screen_pixels(const Job& job) {
  const std::string& screen = job.low.make.screen;
  return screen.empty() ? 0 : parse_pixels(option("screen"), screen);
}

double triangle_area(const Mesh& low, std::size_t triangle) {
  const std::vector<Vec3>& positions = low.positions;
  const Triangle& corners = low.triangles[triangle];
  return triangle_shape(positions[corners[0]], positions[corners[1]], positions[corners[2]]).area;
}

/// Share of LOW's surface area in the current texture set.
double surface_share(const BakeScene& scene, FittedPictures& fitted) {
  if (scene.set == nullptr) return 1;
  const Mesh& low = scene.low.mesh;
  std::optional<double>& total_area = fitted.surface;
  if (!total_area) {
    total_area = 0;
    for (std::size_t t = 0; t < low.triangles.size(); ++t) *total_area += triangle_area(low, t);
  }
  double set_area = 0;
  for (const std::uint32_t t : scene.set->set.members) set_area += triangle_area(low, t);
  return *total_area > 0 ? set_area / *total_area : 1;
}

const char* format_name(PictureFormat format) {
  return format == PictureFormat::png ? "png" : format == PictureFormat::webp ? "webp" : "jpeg";
}

Json pictures_json(const std::vector<TrialPicture>& pictures) {
  Json list = Json::array();
  for (const TrialPicture& picture : pictures) {
    Json entry = {{"picture", name_of(picture.picture)},
                  {"width", picture.width},
                  {"height", picture.height},
                  {"format", format_name(picture.format)},
                  {"quality", picture.quality == 0 ? Json() : Json(picture.quality)},
                  {"bytes", picture.bytes},
                  {"error_steps", picture.error.steps}};
    if (picture.picture == PictureSlot::normal) entry["error_degrees"] = picture.error.degrees;
    list.push_back(std::move(entry));
  }
  return list;
}

/// Describes pictures in one line, such as "normal 512 x 512 jpeg 88, surface 256 x 256 png".
std::string describe_pictures(const std::vector<TrialPicture>& pictures) {
  std::string text;
  for (const TrialPicture& picture : pictures) {
    text += formatted("%s%s %u x %u %s", text.empty() ? "" : ", ",
                      std::string(name_of(picture.picture)).c_str(), picture.width, picture.height,
                      format_name(picture.format));
    if (picture.quality != 0) text += " " + std::to_string(picture.quality);
  }
  return text;
}

void apply_picture_fit(const PictureFit& fit, AssetParts& asset) {
  FittedPictures& fitted = *asset.fitted;
  std::vector<AssetPictures> sets = fitted.unencoded_pictures;
  for (std::size_t i = 0; i < fitted.encodings_by_picture.size(); ++i) {
    const PictureEncodings& picture_encodings = fitted.encodings_by_picture[i];
    AssetPictures& set_pictures = sets[fitted.sets[i]];
    file_of(set_pictures, picture_encodings.picture) =
        picture_encodings.choices[fit.choices[i]].data;
  }
  asset.pictures.clear();
  for (AssetPictures& set : sets) {
    asset.pictures.push_back(std::make_shared<const AssetPictures>(std::move(set)));
  }
  fitted.pictures = trial_pictures(fitted.encodings_by_picture, fit);
  fitted.error = fit.error;
}

}  // namespace

PlannedLow make_byte_plan(const BakeScene& scene, const Source& source, const BakeOptions& bake) {
  const Job& job = scene.run.job;
  std::vector<Warning>& warnings = scene.run.log.warnings;
  BytePlanOptions options;
  options.plan = low_poly_options(scene, bake);
  options.plan.may_leave_map_out = false;
  options.max_bytes = job.max_bytes;
  if (scene.run.hooks.sample) {
    options.max_bytes = static_cast<std::uint64_t>(static_cast<double>(options.max_bytes) *
                                                   (1 - kSampledImagesShare));
  }
  options.pictures = fit_options(job);
  options.maps_of = [&](std::vector<BakedMap>& maps, std::span<const std::uint8_t> coverage) {
    const AssetMaps pictures = asset_maps(maps);
    for (BakedMap& map : maps) {
      if (pads_for_mips(job)) pad_for_mips(map, coverage, chooses_padding(job));
    }
    return pictures;
  };
  const std::uint64_t extras =
      asset_extras(scene, {}, Json::object(), {}).size() + max_extras_growth(job);
  options.mesh_bytes = [&](const Mesh& low) {
    return bytes_without_pictures(scene, low) + extras + kMaxJsonGrowthBytes;
  };
  PlannedLow planned;
  try {
    planned.byte_plan_result = plan_within_bytes(source, scene.high.mesh(), options);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::usage) throw;
    fail_usage(option("max_bytes") + ": " + error.message() +
               " Allow more, bake fewer maps, or give " + option("mesh_compression") + " or " +
               option("format") + ".");
  }
  planned.plan = std::exchange(planned.byte_plan_result->plan, {});
  const LowPolyPlan& plan = planned.plan;
  if (plan.cancelled) throw Cancelled{};
  if (plan.wanted > 0 && plan.chosen.measured > plan.wanted) {
    warnings.push_back(
        {"error-not-reached",
         "With " + option("max_bytes") +
             formatted(", the mean error of rendered normals is %.3g degrees, but ",
                       plan.chosen.measured) +
             option("max_error") +
             formatted(" allows %.3g. Allow more bytes, or a larger error.", plan.wanted),
         1});
  } else if (!plan.reached) {
    warnings.push_back(plan_bound_warning(plan));
  }
  warn_of_outline(plan, {}, warnings);
  return planned;
}

void fit_asset_maps(const BakeScene& scene, const Source& source, const AssetMaps& maps,
                    const BakeOptions& bake, const PlannedLow* planned, AssetParts& asset) {
  if (!asset.fitted) asset.fitted.emplace();
  FittedPictures& fitted = *asset.fitted;
  PictureFitOptions options = fit_options(scene.run.job);
  options.all_qualities = true;
  std::optional<NormalProbe> normal_probe;
  if (scene.sets.empty() && maps.normal != nullptr) {
    if (!fitted.high_views) {
      fitted.high_views = std::make_shared<const HighPolyView>(
          make_high_poly_view(impl_of(source), screen_pixels(scene.run.job), plan_directions()));
    }
    normal_probe.emplace(impl_of(source), scene.low.mesh, *fitted.high_views);
    options.normal_error = [&](const Image& picture) {
      const NormalError error = normal_probe->with_map(picture, bake);
      return PictureError{error.mean_8bit, error.mean_degrees};
    };
  }
  std::vector<std::pair<PictureSlot, double>> picture_coarseness;
  if (planned != nullptr && planned->byte_plan_result)
    picture_coarseness = planned->byte_plan_result->picture_errors;
  const double weight = surface_share(scene, fitted);
  for (PictureEncodings& picture_encodings : encode_pictures(maps, options)) {
    picture_encodings.weight = weight;
    for (const auto& [picture, steps] : picture_coarseness) {
      if (picture != picture_encodings.picture) continue;
      // The resolution error of the bake and the encoding error are independent, so their squares add.
      for (PictureChoice& choice : picture_encodings.choices) {
        choice.error.steps = std::hypot(choice.error.steps, steps);
      }
    }
    fitted.encodings_by_picture.push_back(std::move(picture_encodings));
    fitted.sets.push_back(fitted.unencoded_pictures.size());
  }
  fitted.unencoded_pictures.push_back(described_pictures(maps));
  asset.pictures.push_back(std::make_shared<const AssetPictures>(fitted.unencoded_pictures.back()));
}

void fit_pictures(const Job& job, const std::function<std::uint64_t()>& file_bytes,
                  AssetParts& asset) {
  const std::uint64_t max_bytes = job.max_bytes;
  FittedPictures& fitted = *asset.fitted;
  const PictureFit smallest =
      *least_error(fitted.encodings_by_picture, least_bytes(fitted.encodings_by_picture));
  apply_picture_fit(smallest, asset);
  fitted.bytes = file_bytes();
  if (fitted.bytes > max_bytes) {
    fail_usage(option("max_bytes") +
               formatted(": %llu bytes are too few for this low poly with these maps: the smallest "
                         "possible file has %llu bytes. Allow more, give fewer faces or maps, or ",
                         static_cast<unsigned long long>(max_bytes),
                         static_cast<unsigned long long>(fitted.bytes + max_extras_growth(job))) +
               option("mesh_compression") + ".");
  }
  const std::uint64_t other_bytes = fitted.bytes - std::min(fitted.bytes, smallest.bytes);
  // The JSON of a GLB states the lengths of its pictures, so the file may exceed the limit by a few digits. The loop
  // retries with fewer bytes for pictures.
  for (std::uint64_t remaining_bytes = max_bytes - std::min(max_bytes, other_bytes);;) {
    const std::optional<PictureFit> fit = least_error(fitted.encodings_by_picture, remaining_bytes);
    apply_picture_fit(fit ? *fit : smallest, asset);
    fitted.bytes = file_bytes();
    if (!fit || fitted.bytes <= max_bytes) return;
    remaining_bytes -= std::min(remaining_bytes, fitted.bytes - max_bytes);
  }
}

namespace {

/// The plan within Job::max_bytes; null if the low poly was not planned.
const BytePlan* byte_plan_of(const RunOutcome& outcome) {
  const PlannedLow* const planned = outcome.planned;
  return planned != nullptr && planned->byte_plan_result ? &*planned->byte_plan_result : nullptr;
}

}  // namespace

Json bytes_json(const RunOutcome& outcome) {
  const FittedPictures& fitted = *outcome.asset.fitted;
  Json json = {{"max", outcome.scene.run.job.max_bytes},
               {"file", fitted.bytes},
               {"error_steps", fitted.error},
               {"pictures", pictures_json(fitted.pictures)}};
  const BytePlan* const plan = byte_plan_of(outcome);
  if (plan == nullptr) return json;
  Json trials = Json::array();
  for (const ByteTrial& trial : plan->trials) {
    trials.push_back({{"faces", trial.faces},
                      {"baked", trial.baked},
                      {"smooth_normals", trial.has_smooth_normals},
                      {"mesh_bytes", trial.mesh_bytes},
                      {"bytes", trial.bytes},
                      {"fits", trial.fits},
                      {"expected_steps", trial.expected > 0 ? Json(trial.expected) : Json()},
                      {"error_steps", trial.fits ? Json(trial.error) : Json()},
                      {"normal_degrees", trial.fits ? Json(trial.degrees) : Json()},
                      {"pictures", pictures_json(trial.pictures)}});
  }
  json["trials"] = std::move(trials);
  json["chosen"] = plan->chosen;
  return json;
}

std::vector<std::string> bytes_table(const RunOutcome& outcome) {
  std::vector<std::string> table_lines;
  const FittedPictures& fitted = *outcome.asset.fitted;
  if (const BytePlan* const plan = byte_plan_of(outcome)) {
    for (const ByteTrial& trial : plan->trials) {
      const bool chosen = &trial == &plan->trials[plan->chosen];
      table_lines.push_back(formatted(
          "tried %s faces: %s", with_commas(trial.faces).c_str(),
          trial.fits
              ? formatted("%.3g degrees, error %.3g of 255; %s%s", trial.degrees, trial.error,
                          describe_pictures(trial.pictures).c_str(), chosen ? "  <- chosen" : "")
                    .c_str()
              : "nothing fits"));
    }
  }
  table_lines.push_back(formatted("%s of %s bytes: %s; error %.3g of 255",
                                  with_commas(fitted.bytes).c_str(),
                                  with_commas(outcome.scene.run.job.max_bytes).c_str(),
                                  describe_pictures(fitted.pictures).c_str(), fitted.error));
  return table_lines;
}

}  // namespace kiln
