// Compares the low poly, its match and the high poly along viewing rays (Tarini, Cignoni, Scopigno 2003, sections 4.1
// and 4.2).
#include <algorithm>
#include <array>
#include <cmath>

#include "accel/ray.h"
#include "base/parallel.h"
#include "kiln/measure.h"
#include "measure/assess_parts.h"
#include "mesh/kernels_shared.h"

namespace kiln {
namespace {

constexpr std::size_t kSamplesPerTask = 1 << 15;
// Offset of ray origins in frame units, so that rays do not hit the triangle they start from.
constexpr float kOriginOffset = 1e-5F;
constexpr float kRayLength = 64;
// Minimum distance of a match from its sample, as a share of the diagonal; closer matches have no direction.
constexpr double kMinOffset = 1e-6;
// Up to this number of avoided directions, test directions keep a distance of half a degree from each of them; between
// more directions there would be too little space.
constexpr std::size_t kMaxAvoidedDirections = 64;

std::vector<float> make_planes(std::size_t size, std::size_t planes, const auto& vector_of) {
  std::vector<float> result(size * planes, 0.0F);
  parallel_for(size, kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 v = vector_of(i);
      result[i] = v.x;
      result[i + size] = v.y;
      result[i + 2 * size] = v.z;
    }
  });
  return result;
}

std::vector<Vec3> test_directions(const AssessOptions& options) {
  // By default the directions of 12 views are avoided, since matches commonly use these.
  std::vector<Vec3> avoided_directions = options.avoid;
  if (avoided_directions.empty()) avoided_directions = spread_views(12);
  const bool has_space =
      avoided_directions.size() <= kMaxAvoidedDirections && options.directions <= 512;
  return held_out_views(options.directions, avoided_directions, has_space ? 0.5 : 0.02);
}

/// Unit normals of the high poly's faces; 0 for faces without area.
std::vector<float> dense_normals(const Source::Impl& source) {
  std::vector<float> normals(3 * source.triangles.size(), 0.0F);
  parallel_for(source.triangles.size(), kSamplesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Triangle& corners = source.triangles[t];
      const Vec3d a = to_double(source.positions[corners[0]]);
      const Vec3d normal = cross(to_double(source.positions[corners[1]]) - a,
                                 to_double(source.positions[corners[2]]) - a);
      const double size = length(normal);
      if (!(size > 0)) continue;
      const Vec3 unit = to_float(normal * (1 / size));
      std::copy_n(&unit.x, 3, &normals[3 * t]);
    }
  });
  return normals;
}

/// Distance of the viewer from a sample at which both meshes are in front of the viewer; frame units.
float viewer_distance(const Source::Impl& source, const AssessedSamples& samples) {
  double square = 0;
  for (const Vec3& p : source.positions) square = std::max(square, dot(to_double(p), to_double(p)));
  for (const Vec3& p : samples.position) square = std::max(square, dot(to_double(p), to_double(p)));
  return static_cast<float>(2.01 * std::sqrt(square));
}

/// Casts viewing rays through the matched samples, and owns the arrays on the device. Samples without a match get no
/// rays.
class ViewingRays {
 public:
  ViewingRays(const Source::Impl& source, const Mesh& low, const AssessedSamples& samples,
              std::vector<std::size_t> found)
      : context_(context_of(source.device)),
        is_matched_(std::move(found)),
        low_rays_(context_, source.frame.to_frame(low), low.triangles, source.traversal),
        dense_rays_(source.rays()),
        // Seven arrays, one per component, as in TexelBand::points; the last one is unused.
        points_(upload(7, [&](std::size_t i) { return samples.position[i]; })),
        normals_(upload(3, [&](std::size_t i) { return samples.normal[i]; })),
        offsets_(upload(3,
                        [&](std::size_t i) {
                          return to_float(samples.match[i] - to_double(samples.position[i]));
                        })),
        dense_normals_(context_, std::span<const float>(dense_normals(source))),
        is_hidden_(context_, is_matched_.size()),
        ray_hits_(context_, static_cast<std::uint32_t>(is_matched_.size())),
        sample_sums_(context_, KILN_ASSESS_SUMS * is_matched_.size()) {
    context_.fill(sample_sums_, 0.0F);
    visibility_query_.t_min = kOriginOffset;
    visibility_query_.t_max = kRayLength;
    visibility_query_.two_sided = true;
    // Rays start at the viewer, outside of both meshes, and run inward.
    ray_query_.offset = viewer_distance(source, samples);
    ray_query_.t_max = 2 * ray_query_.offset;
    ray_query_.inward = true;
    ray_query_.two_sided = true;
    params_.count = params_.capacity = static_cast<std::uint32_t>(is_matched_.size());
  }

  void add(const Vec3& direction) {
    params_.direction[0] = direction.x;
    params_.direction[1] = direction.y;
    params_.direction[2] = direction.z;
    const std::size_t count = is_matched_.size();
    context_.launch(context_.kernel("assess", "kiln_assess_set_ray_directions"), count, kLocal,
                    params_, normals_, points_);
    low_rays_.occluded(points_, params_.count, params_.capacity, visibility_query_, is_hidden_);
    context_.launch(context_.kernel("assess", "kiln_assess_gather"), count, kLocal, params_,
                    normals_, offsets_, is_hidden_, points_, sample_sums_);
    dense_rays_.intersect(points_, params_.count, params_.capacity, ray_query_, ray_hits_);
    context_.launch(context_.kernel("assess", "kiln_assess_compare"), count, kLocal, params_,
                    normals_, offsets_, points_, dense_normals_, ray_hits_.triangle,
                    ray_hits_.distance, sample_sums_);
  }

  void wait_for_kernels() const { context_.finish(); }

  /// Downloads the sums: KILN_ASSESS_SUMS arrays, one per quantity.
  std::vector<float> sums() const { return sample_sums_.download(context_); }
  const std::vector<std::size_t>& found() const { return is_matched_; }

 private:
  cl::Array<float> upload(std::size_t planes, const auto& vector_of) {
    return {context_,
            std::span<const float>(make_planes(is_matched_.size(), planes, [&](std::size_t k) {
              return vector_of(is_matched_[k]);
            }))};
  }

  cl::Context& context_;
  std::vector<std::size_t> is_matched_;
  RayCaster low_rays_;
  const RayCaster& dense_rays_;
  cl::Array<float> points_, normals_, offsets_, dense_normals_;
  cl::Array<std::uint8_t> is_hidden_;
  DeviceCorrespondence ray_hits_;
  cl::Array<float> sample_sums_;
  RayQuery visibility_query_, ray_query_;
  kiln_assess_params params_{};
};

void sum_measures(const ViewingRays& viewing_rays, const AssessedSamples& samples, double unit,
                  bool fields, MatchAssessment& result) {
  const std::vector<float> sums = viewing_rays.sums();
  const std::size_t count = viewing_rays.found().size();
  RaySums object_space_sums, image_space_sums, normalised_sums;
  WeightedValues weighted_places;
  double visible_area = 0, unseen_area = 0, total_area = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = viewing_rays.found()[k];
    const auto sum = [&](std::size_t plane) { return double{sums[k + plane * count]}; };
    const double area = samples.area[i];
    const double visible_count = sum(KILN_ASSESS_SEEN), hit_count = sum(KILN_ASSESS_MET);
    const double offset_across_ray = sum(KILN_ASSESS_ACROSS);
    total_area += area;
    if (!(visible_count > 0)) {
      unseen_area += area;
      continue;
    }
    visible_area += area * visible_count;
    weighted_places.add(offset_across_ray / visible_count, area);
    image_space_sums.add(area * visible_count, area * offset_across_ray,
                         area * sum(KILN_ASSESS_ACROSS_SQUARE));
    object_space_sums.add(area * hit_count, area * sum(KILN_ASSESS_APART),
                          area * sum(KILN_ASSESS_APART_SQUARE));
    const double match_distance = length(samples.match[i] - to_double(samples.position[i]));
    const bool has_direction = match_distance * unit > kMinOffset * result.diagonal;
    if (has_direction) {
      normalised_sums.add(
          area * visible_count, area * offset_across_ray / match_distance,
          area * sum(KILN_ASSESS_ACROSS_SQUARE) / (match_distance * match_distance));
    }
    if (!fields) continue;
    const std::size_t element = samples.element[i];
    const auto store_in_field = [&](Image& field, double value) {
      field.pixels[element] = static_cast<float>(value);
    };
    store_in_field(result.fields.image_space, offset_across_ray / visible_count * unit);
    if (has_direction)
      store_in_field(result.fields.normalised_image_space,
                     offset_across_ray / visible_count / match_distance);
    if (hit_count > 0)
      store_in_field(result.fields.object_space, sum(KILN_ASSESS_APART) / hit_count * unit);
  }
  result.object_space = object_space_sums.measure(visible_area, unit);
  result.image_space = image_space_sums.measure(visible_area, unit);
  result.normalised_image_space = normalised_sums.measure(visible_area, 1);
  result.image_space_over_area = distribution(std::move(weighted_places), unit, unit * unit);
  if (total_area > 0) result.never_visible = unseen_area / total_area;
}

}  // namespace

RayMeasure RaySums::measure(double total_weight, double unit) const {
  if (!(weight_ > 0)) return {};
  return {value_ / weight_ * unit, std::sqrt(square_ / weight_) * unit, weight_ / total_weight};
}

bool rate_rays(const Source::Impl& source, const Mesh& low, const AssessedSamples& samples,
               const AssessOptions& options, MatchAssessment& result) {
  const std::vector<Vec3> directions = test_directions(options);
  result.directions = static_cast<std::uint32_t>(directions.size());
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.found[i] != 0) found.push_back(i);
  }
  if (found.empty()) return true;
  ViewingRays viewing_rays(source, low, samples, std::move(found));
  for (std::size_t k = 0; k < directions.size(); ++k) {
    if (options.progress && !options.progress(0.1 + 0.85 * static_cast<double>(k) /
                                                        static_cast<double>(directions.size()),
                                              "pictures")) {
      return false;
    }
    viewing_rays.add(directions[k]);
    if (k % 16 == 15) viewing_rays.wait_for_kernels();
  }
  sum_measures(viewing_rays, samples, 1 / source.frame.scale, options.fields, result);
  return true;
}

}  // namespace kiln
