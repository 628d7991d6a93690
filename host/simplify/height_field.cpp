#include "kiln/height_field.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <string>

#include "base/formatted.h"
#include "base/memory.h"
#include "base/option.h"
#include "kiln/error.h"
#include "kiln/source.h"
#include "simplify/height_layout.h"

namespace kiln {
namespace {

struct FieldSize {
  double width, depth;
};

FieldSize field_size_of(const Image& image, const HeightFieldOptions& options) {
  for (const double value : {options.width, options.depth}) {
    if (value >= 0 && std::isfinite(value)) continue;
    throw Error(ErrorCode::usage, "The height field's extent is " + decimal(value) +
                                      ": it must be finite and above 0, or 0 for the image's "
                                      "proportions.");
  }
  if (!std::isfinite(options.height)) {
    throw Error(ErrorCode::usage, "The height field's height must be finite.");
  }
  if (image.width < 2 || image.height < 2 || image.channels < 1 ||
      image.pixels.size() != std::size_t{image.width} * image.height * image.channels) {
    throw Error(ErrorCode::input, "The height field is " + std::to_string(image.width) + " x " +
                                      std::to_string(image.height) +
                                      " pixels: it must be 2 x 2 or more.");
  }
  const double columns = image.width - 1.0;
  const double rows = image.height - 1.0;
  FieldSize field_size{options.width, options.depth};
  if (field_size.width == 0 && field_size.depth == 0) {
    field_size = {columns / std::max(columns, rows), rows / std::max(columns, rows)};
  }
  if (field_size.width == 0) field_size.width = field_size.depth * columns / rows;
  if (field_size.depth == 0) field_size.depth = field_size.width * rows / columns;
  return field_size;
}

/// Moves a UV coordinate that rounding has shifted off the border of the unit square back onto it.
float snap_to_border(double u) {
  constexpr double kUvRounding = 1e-6;
  if (std::abs(u) < kUvRounding) return 0;
  return std::abs(u - 1) < kUvRounding ? 1 : static_cast<float>(u);
}

/// Rule that detects values that stand for "no data" in a height field.
///
/// Surveys mark missing heights by an extreme number. The lowest or highest value counts as "no data" on two
/// conditions: it is a number that known programs write, and its distance to the next value exceeds the range of all
/// other values. Another number at such a distance, in several pixels, only causes a warning. Real heights that contain
/// such a number within their range (an ocean floor with -9999) are not changed.
struct NoDataRule {
  /// "No data" values of GDAL, ArcGIS, SRTM and Surfer, and the lowest and highest single-precision numbers.
  static constexpr double kKnownNoDataValues[] = {
      -9999,         -99999, -999999,      -32768,     -32767, -10000, 9999, 99999, 32767,
      -3.4028235e38, -1e38,  3.4028235e38, 1.70141e38, 1e30,   -1e30,  1e20, -1e20};
  /// Relative tolerance of the comparison with these values
  static constexpr double kRelativeTolerance = 1e-6;
  /// Minimum distance between the value and the next one, as a multiple of the range of all other values
  static constexpr double kMinGap = 1;
  /// Like kMinGap, but for a value that no known program writes: such a value only causes a warning
  static constexpr double kMinDoubtfulGap = 10;
  static constexpr std::uint64_t kMinDoubtfulPixels =
      2;  ///< Such a warning requires that at least this many pixels have the value

  static bool is(double value, double other) {
    return std::abs(value - other) <= kRelativeTolerance * std::abs(other);
  }
  static bool is_known(double value) {
    return std::any_of(std::begin(kKnownNoDataValues), std::end(kKnownNoDataValues),
                       [value](double known) { return is(value, known); });
  }
};

/// The lowest and the highest value, how often they occur, and the values next to them.
struct ExtremeValues {
  struct ExtremeValue {
    /// The extreme value, and the value next to it; equal if the image has a single value
    double value = 0, next = 0;
    std::uint64_t count = 0;
  };
  ExtremeValue low, high;
  bool any = false;

  static ExtremeValues of(const Image& image) {
    ExtremeValues ends;
    for (int pass = 0; pass < 2; ++pass) {
      for (std::size_t i = 0; i < image.pixels.size(); i += image.channels) {
        const double value = image.pixels[i];
        if (!std::isfinite(value)) continue;
        if (pass == 0) {
          if (!ends.any || value < ends.low.value) ends.low.value = value;
          if (!ends.any || value > ends.high.value) ends.high.value = value;
          ends.any = true;
          ends.low.next = ends.high.value;
          ends.high.next = ends.low.value;
          continue;
        }
        if (value == ends.low.value) {
          ++ends.low.count;
        } else {
          ends.low.next = std::min(ends.low.next, value);
        }
        if (value == ends.high.value) {
          ++ends.high.count;
        } else {
          ends.high.next = std::max(ends.high.next, value);
        }
      }
    }
    return ends;
  }
};

}  // namespace

NoData mark_no_data(Heights& heights, std::optional<double> value, bool guess) {
  Image& image = heights.image;
  constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();
  NoData found;
  const auto remove_values = [&](const auto& is_none) {
    std::uint64_t count = 0;
    for (std::size_t i = 0; i < image.pixels.size(); i += image.channels) {
      float& pixel = image.pixels[i];
      if (!std::isfinite(pixel) || !is_none(double{pixel})) continue;
      pixel = kNoHeight;
      ++count;
    }
    return count;
  };
  const std::optional<double> given_no_data = value   ? value
                                              : guess ? heights.no_data
                                                      : std::nullopt;
  if (given_no_data && std::isfinite(*given_no_data)) {
    // Files may state the lowest or highest float in decimal digits that round to a value beyond the range of floats.
    constexpr double kLargestFloat = std::numeric_limits<float>::max();
    const double no_data_value = std::clamp(*given_no_data, -kLargestFloat, kLargestFloat);
    const auto is_given_no_data = [&](double pixel) {
      return heights.largest == 1 ? pixel == static_cast<float>(no_data_value) ||
                                        NoDataRule::is(pixel, no_data_value)
                                  : std::round(pixel * heights.largest) == no_data_value;
    };
    if (remove_values(is_given_no_data) != 0) found.values.push_back(*given_no_data);
  } else if (guess && !given_no_data && heights.largest == 1) {
    for (ExtremeValues ends = ExtremeValues::of(image); ends.any; ends = ExtremeValues::of(image)) {
      bool search_again = false;
      for (const ExtremeValues::ExtremeValue& end : {ends.low, ends.high}) {
        const bool is_lowest = end.value == ends.low.value;
        const double gap = std::abs(end.next - end.value);
        const double other_range =
            is_lowest ? ends.high.value - end.next : end.next - ends.low.value;
        if (gap == 0 || gap <= NoDataRule::kMinGap * other_range) continue;
        if (NoDataRule::is_known(end.value)) {
          remove_values([&](double pixel) { return pixel == end.value; });
          found.values.push_back(end.value);
          search_again = true;
          break;
        }
        if (gap > NoDataRule::kMinDoubtfulGap * other_range && other_range > 0 &&
            end.count >= NoDataRule::kMinDoubtfulPixels) {
          found.doubtful = end.value;
        }
      }
      if (!search_again) break;
      found.doubtful.reset();
    }
  }
  for (std::size_t i = 0; i < image.pixels.size(); i += image.channels) {
    if (!std::isfinite(image.pixels[i])) ++found.pixels;
  }
  return found;
}

Mesh height_field_mesh(const Image& image, const HeightFieldOptions& options) {
  const FieldSize field_size = field_size_of(image, options);
  if (std::uint64_t{image.width} * image.height >= std::uint64_t{1} << 30) {
    throw Error(ErrorCode::input, "The height field is " + std::to_string(image.width) + " x " +
                                      std::to_string(image.height) +
                                      " pixels: at most 2^30 are supported. Scale it down.");
  }
  const std::size_t count = std::size_t{image.width} * image.height;
  // Each pixel becomes a vertex with a UV, and two triangles.
  constexpr std::uint64_t kBytesPerPixel = sizeof(Vec3) + sizeof(Vec2) + 4 * sizeof(Triangle);
  require_memory("The mesh of the height field of " + std::to_string(image.width) + " x " +
                     std::to_string(image.height) + " pixels",
                 kBytesPerPixel * count, [](const std::string& problem) {
                   throw Error(ErrorCode::input,
                               problem + ". Scale the height field down, or raise the " +
                                   option("memory_limit") + ".");
                 });
  Mesh mesh;
  mesh.name = "height field";
  mesh.positions.reserve(count);
  mesh.uvs.reserve(count);
  for (std::uint32_t row = 0; row < image.height; ++row) {
    const double v = 1 - row / (image.height - 1.0);
    for (std::uint32_t column = 0; column < image.width; ++column) {
      const double u = column / (image.width - 1.0);
      // The vertex of a pixel without a height is part of no triangle.
      const float value = *image.at(column, row);
      mesh.positions.push_back(
          {static_cast<float>((u - 0.5) * field_size.width),
           static_cast<float>((v - 0.5) * field_size.depth),
           std::isfinite(value) ? static_cast<float>(value * options.height) : 0.0F});
      mesh.uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
    }
  }
  const auto has_height = [&image](std::uint32_t pixel) {
    return std::isfinite(image.pixels[std::size_t{pixel} * image.channels]);
  };
  mesh.triangles.reserve(std::size_t{2} * (image.width - 1) * (image.height - 1));
  for (std::uint32_t row = 0; row + 1 < image.height; ++row) {
    for (std::uint32_t column = 0; column + 1 < image.width; ++column) {
      const std::uint32_t upper_vertex = row * image.width + column;
      const std::uint32_t lower_vertex = upper_vertex + image.width;
      for (const Triangle& t : {Triangle{lower_vertex, lower_vertex + 1, upper_vertex + 1},
                                Triangle{lower_vertex, upper_vertex + 1, upper_vertex}}) {
        if (std::all_of(t.begin(), t.end(), has_height)) mesh.triangles.push_back(t);
      }
    }
  }
  if (mesh.triangles.empty()) {
    throw Error(
        ErrorCode::input,
        "The height field has no three adjacent pixels with heights: all pixels are holes or "
        "isolated.");
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

Mesh height_field_plane(const Image& image, const HeightFieldOptions& options) {
  const FieldSize field_size = field_size_of(image, options);
  Mesh mesh;
  mesh.name = "plane";
  for (const Vec2& uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
    mesh.positions.push_back({static_cast<float>((uv.x - 0.5) * field_size.width),
                              static_cast<float>((uv.y - 0.5) * field_size.depth), 0});
    mesh.uvs.push_back(uv);
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

void lay_out_over_height_field(Mesh& mesh, const Image& image, const HeightFieldOptions& options) {
  const FieldSize field_size = field_size_of(image, options);
  lay_out_over_rectangle(mesh, {{0, 0}, {field_size.width, field_size.depth}});
}

namespace {

/// The rectangle over which the field's own UVs span the unit square, if they are linear in x and y. It exceeds the
/// bounding box if pixels at the border have no height. nullopt if the rectangle is the bounding box itself.
std::optional<FieldRectangle> rectangle_from_uvs(const Mesh& field,
                                                 const std::array<double, 2>& low,
                                                 const std::array<double, 2>& high) {
  constexpr double kLinearTolerance = 1e-4;
  if (field.uv_triangles.size() != field.triangles.size() || field.uvs.empty()) return std::nullopt;
  std::array<double, 2> first{HUGE_VAL, HUGE_VAL}, last{-HUGE_VAL, -HUGE_VAL};
  for (const Triangle& t : field.uv_triangles) {
    for (const std::uint32_t corner : t) {
      const Vec2& uv = field.uvs[corner];
      const std::array<double, 2> at{uv.x, uv.y};
      for (std::size_t k = 0; k < 2; ++k) {
        first[k] = std::min(first[k], at[k]);
        last[k] = std::max(last[k], at[k]);
      }
    }
  }
  if (first == std::array<double, 2>{0, 0} && last == std::array<double, 2>{1, 1})
    return std::nullopt;
  FieldRectangle full_rectangle{};
  for (std::size_t k = 0; k < 2; ++k) {
    if (!(last[k] > first[k]) || first[k] < -kLinearTolerance || last[k] > 1 + kLinearTolerance)
      return std::nullopt;
    full_rectangle.size[k] = (high[k] - low[k]) / (last[k] - first[k]);
    full_rectangle.center[k] = low[k] + (0.5 - first[k]) * full_rectangle.size[k];
  }
  for (std::size_t t = 0; t < field.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& p = field.positions[field.triangles[t][k]];
      const Vec2& uv = field.uvs[field.uv_triangles[t][k]];
      const double u =
          (p.x + field.origin[0] - full_rectangle.center[0]) / full_rectangle.size[0] + 0.5;
      const double v =
          (p.y + field.origin[1] - full_rectangle.center[1]) / full_rectangle.size[1] + 0.5;
      if (!(std::abs(u - uv.x) < kLinearTolerance && std::abs(v - uv.y) < kLinearTolerance))
        return std::nullopt;
    }
  }
  return full_rectangle;
}

}  // namespace

FieldRectangle FieldRectangle::of(const Mesh& field) {
  const Bounds bounds = Bounds::of(field);
  std::array<double, 2> low{}, high{};
  for (std::size_t k = 0; k < 2; ++k) {
    low[k] = bounds.low[k] + field.origin[k];
    high[k] = bounds.high[k] + field.origin[k];
  }
  if (!(high[0] > low[0] && high[1] > low[1])) {
    throw Error(
        ErrorCode::input,
        "Mesh '" + field.name + "' has no area in the x-y plane, so it is not a height field.");
  }
  if (const auto full_rectangle = rectangle_from_uvs(field, low, high)) return *full_rectangle;
  return {{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2}, {high[0] - low[0], high[1] - low[1]}};
}

void lay_out_over_rectangle(Mesh& mesh, const FieldRectangle& rectangle) {
  const auto& [center, size] = rectangle;
  mesh.uvs.clear();
  for (const Vec3& p : mesh.positions) {
    const double u = (p.x + mesh.origin[0] - center[0]) / size[0] + 0.5;
    const double v = (p.y + mesh.origin[1] - center[1]) / size[1] + 0.5;
    mesh.uvs.push_back({snap_to_border(u), snap_to_border(v)});
  }
  mesh.uv_triangles = mesh.triangles;
}

}  // namespace kiln
