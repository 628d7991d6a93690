#include "kiln/measure.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "accel/depth_views.h"
#include "base/formatted.h"
#include "base/normal_angle.h"
#include "base/parallel.h"
#include "mesh/kernels_shared.h"
#include "mesh/vector.h"

namespace kiln {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr std::size_t kPixelsPerTask = 4096;
constexpr float kUncoveredAngle = -1, kOneSidedAngle = -2;

void check_pictures(const Image& a, const Image& b) {
  const auto text = [](const Image& image) {
    return std::to_string(image.width) + " x " + std::to_string(image.height) + " with " +
           std::to_string(image.channels) + " channels";
  };
  for (const Image* image : {&a, &b}) {
    if (image->channels < 3 ||
        image->pixels.size() != std::size_t{image->width} * image->height * image->channels) {
      throw Error(ErrorCode::input,
                  "A picture of normals has size " + text(*image) + ", but holds " +
                      std::to_string(image->pixels.size()) +
                      " values: give 3 channels or more, and width x height x channels values.");
    }
  }
  if (a.width != b.width || a.height != b.height) {
    throw Error(ErrorCode::input, "The pictures of normals cannot be compared: one is " + text(a) +
                                      ", the other " + text(b) + ". Draw both at the same size.");
  }
}

bool is_covered(const float* p) { return p[0] != 0 || p[1] != 0 || p[2] != 0; }

double max_difference_8bit(const float* a, const float* b) {
  const auto quantise = [](float value) {
    // NaN is treated as 0.
    const double clamped = value > 0 ? std::min(static_cast<double>(value), 1.0) : 0.0;
    return std::floor(255 * clamped + 0.5);
  };
  double sum = 0;
  for (int c = 0; c < 3; ++c) {
    const double d = quantise(a[c]) - quantise(b[c]);
    sum += d * d;
  }
  return std::sqrt(sum);
}

/// Calls body(pixel, texel of the reference, texel of the other image) for every pixel, in parallel.
template <typename Body>
void for_each_pixel(const Image& reference, const Image& other, const Body& body) {
  const std::size_t pixels = std::size_t{reference.width} * reference.height;
  parallel_for(pixels, kPixelsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      body(i, &reference.pixels[i * reference.channels], &other.pixels[i * other.channels]);
    }
  });
}

/// Rotates about +Y, then about an axis oblique to the world's axes.
Vec3d rotate_about_two_axes(const Vec3d& v, double first, double second) {
  const Vec3d a(v.x * std::cos(first) + v.z * std::sin(first), v.y,
                v.z * std::cos(first) - v.x * std::sin(first));
  const Vec3d axis(2.0 / 7, 3.0 / 7, 6.0 / 7);
  // Rodrigues' rotation formula.
  return a * std::cos(second) + cross(axis, a) * std::sin(second) +
         axis * (dot(axis, a) * (1 - std::cos(second)));
}

double angle_degrees(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b)) * kDegreesPerRadian;
}

}  // namespace

void NormalComparison::add(const Image& reference, const Image& other) {
  check_pictures(reference, other);
  const std::size_t pixels = std::size_t{reference.width} * reference.height;
  std::vector<double> pixel_angles(pixels);
  std::vector<double> pixel_differences(pixels);
  for_each_pixel(reference, other, [&](std::size_t i, const float* a, const float* b) {
    const bool covered = is_covered(a);
    if (covered != is_covered(b)) {
      pixel_angles[i] = kOneSidedAngle;
    } else if (!covered) {
      pixel_angles[i] = kUncoveredAngle;
    } else {
      pixel_angles[i] = normal_angle_degrees(a, b);
      pixel_differences[i] = max_difference_8bit(a, b);
    }
  });
  auto& [count, sum] = pictures_.emplace_back(0, 0);
  // Sums are computed in the order of pixels, so that they do not depend on the number of threads.
  for (std::size_t i = 0; i < pixels; ++i) {
    if (pixel_angles[i] == kOneSidedAngle) ++one_sided_;
    if (pixel_angles[i] < 0) continue;
    ++count;
    sum += pixel_angles[i];
    angles_.push_back(pixel_angles[i]);
    sum_degrees_ += pixel_angles[i];
    sum_squares_ += pixel_angles[i] * pixel_angles[i];
    sum_8bit_ += pixel_differences[i];
    for (std::size_t k = 0; k < above_.size(); ++k) {
      above_[k] += pixel_differences[i] > NormalError::kThresholds8Bit[k] ? 1 : 0;
    }
  }
}

NormalError NormalComparison::error() const {
  NormalError error;
  error.pixels = angles_.size();
  error.one_sided = one_sided_;
  const std::uint64_t pixel_count = angles_.size() + one_sided_;
  if (pixel_count > 0)
    error.one_sided_share = static_cast<double>(one_sided_) / static_cast<double>(pixel_count);
  if (angles_.empty()) return error;
  const auto count = static_cast<double>(angles_.size());
  error.mean_degrees = sum_degrees_ / count;
  error.rms_degrees = std::sqrt(sum_squares_ / count);
  // Standard error of a cluster sample: the pictures are the clusters (Cochran, Sampling Techniques, 1977, section
  // 6.3).
  const auto picture_count = static_cast<double>(pictures_.size());
  double squares = 0;
  for (const auto& [pixels, sum] : pictures_) {
    const double mean_deviation = sum - error.mean_degrees * pixels;
    squares += mean_deviation * mean_deviation;
  }
  if (picture_count > 1)
    error.standard_error_degrees = std::sqrt(squares * picture_count / (picture_count - 1)) / count;
  error.mean_8bit = sum_8bit_ / count;
  for (std::size_t k = 0; k < above_.size(); ++k) {
    error.above_8bit[k] = static_cast<double>(above_[k]) / count;
  }
  std::vector<double> pixel_angles = angles_;
  error.max_degrees = *std::max_element(pixel_angles.begin(), pixel_angles.end());
  error.p99_degrees = percentile(pixel_angles, 99);
  error.p95_degrees = percentile(pixel_angles, 95);
  error.median_degrees = percentile(pixel_angles, 50);
  return error;
}

NormalError compare_normals(const Image& reference, const Image& other) {
  NormalComparison comparison;
  comparison.add(reference, other);
  return comparison.error();
}

Image normal_angles(const Image& reference, const Image& other) {
  check_pictures(reference, other);
  Image result{reference.width, reference.height, 1, {}};
  result.pixels.resize(std::size_t{reference.width} * reference.height);
  for_each_pixel(reference, other, [&](std::size_t i, const float* a, const float* b) {
    const bool covered = is_covered(a);
    result.pixels[i] = covered != is_covered(b) ? kOneSidedAngle
                       : !covered               ? kUncoveredAngle
                                                : static_cast<float>(normal_angle_degrees(a, b));
  });
  return result;
}

DistanceError match_distance(const Match& match) {
  DistanceError error;
  std::vector<double> distances;
  double sum = 0;
  for (std::size_t i = 0; i < match.status.size(); ++i) {
    if (match.status[i] == KILN_STATUS_NONE) continue;
    if (match.status[i] == KILN_STATUS_MISS) {
      ++error.missed;
      continue;
    }
    distances.push_back(std::abs(static_cast<double>(match.distance[i])));
    sum += distances.back();
  }
  error.samples = distances.size();
  if (distances.empty()) return error;
  error.mean = sum / static_cast<double>(distances.size());
  error.max = *std::max_element(distances.begin(), distances.end());
  error.p95 = percentile(distances, 95);
  return error;
}

ViewAngles view_angles(const Vec3& toward) {
  const Vec3d v = to_double(toward);
  return {std::atan2(v.x, v.z) * kDegreesPerRadian,
          std::atan2(v.y, std::hypot(v.x, v.z)) * kDegreesPerRadian};
}

std::vector<Vec3> spread_views(std::uint32_t count) {
  std::vector<Vec3> result;
  for (const Vec3d& direction : spread_directions(count)) result.push_back(to_float(direction));
  return result;
}

double least_angle_degrees(std::span<const Vec3> a, std::span<const Vec3> b) {
  double min_angle = 180;
  for (const Vec3& direction : a) {
    for (const Vec3& other : b)
      min_angle = std::min(min_angle, angle_degrees(to_double(direction), to_double(other)));
  }
  return min_angle;
}

std::vector<Vec3> held_out_views(std::uint32_t count, std::span<const Vec3> avoided,
                                 double least_degrees) {
  constexpr int kRotations = 4096;
  const std::vector<Vec3d> spread = spread_directions(count);
  std::vector<Vec3> result(count);
  for (int k = 1; k <= kRotations; ++k) {
    // Two angles of a picture: multiples of two irrational shares of 360 degrees, so that no combination repeats.
    const double first = 2 * std::numbers::pi * std::fmod(k * std::numbers::phi, 1.0);
    const double second = 2 * std::numbers::pi * std::fmod(k * std::numbers::sqrt2, 1.0);
    for (std::size_t i = 0; i < spread.size(); ++i) {
      result[i] = to_float(rotate_about_two_axes(spread[i], first, second));
    }
    if (least_angle_degrees(result, avoided) >= least_degrees) return result;
  }
  throw Error(ErrorCode::usage,
              "There are no " + std::to_string(count) + " directions for measuring that lie " +
                  decimal(least_degrees) + " degrees or more from each of the " +
                  std::to_string(avoided.size()) + " views of the match: match from fewer views.");
}

NormalReference::NormalReference(const Scene& reference, const Mesh& frame,
                                 std::vector<ViewAngles> views, std::uint32_t size, bool z_up)
    : frame_(&frame), views_(std::move(views)), size_(size), z_up_(z_up) {
  for (const ViewAngles& view : views_) pictures_.push_back(draw(reference, view, true));
}

Image NormalReference::draw(const Scene& scene, const ViewAngles& view, bool ignore_map) const {
  RenderOptions options;
  options.size = size_;
  options.azimuth_degrees = view.azimuth_degrees;
  options.elevation_degrees = view.elevation_degrees;
  options.z_up = z_up_;
  options.samples = 1;
  options.show_normals = true;
  options.ignore_map = ignore_map;
  options.frame = frame_;
  return scene.draw(options);
}

NormalError NormalReference::compare(const Scene& other, bool ignore_map) const {
  NormalComparison comparison;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    comparison.add(pictures_[i], draw(other, views_[i], ignore_map));
  }
  return comparison.error();
}

}  // namespace kiln
