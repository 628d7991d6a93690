#include "kiln/height_field.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/formatted.h"
#include "kiln/error.h"
#include "kiln/source.h"
#include "simplify/height_layout.h"

namespace kiln {
namespace {

struct Extent {
  double width, depth;
};

Extent extent_of(const Image& image, const HeightFieldOptions& options) {
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
  Extent extent{options.width, options.depth};
  if (extent.width == 0 && extent.depth == 0) {
    extent = {columns / std::max(columns, rows), rows / std::max(columns, rows)};
  }
  if (extent.width == 0) extent.width = extent.depth * columns / rows;
  if (extent.depth == 0) extent.depth = extent.width * rows / columns;
  return extent;
}

/// Snaps UVs that rounding moved off the unit square's border.
float to_border(double u) {
  constexpr double kRounding = 1e-6;
  if (std::abs(u) < kRounding) return 0;
  return std::abs(u - 1) < kRounding ? 1 : static_cast<float>(u);
}

}  // namespace

Mesh height_field_mesh(const Image& image, const HeightFieldOptions& options) {
  const Extent extent = extent_of(image, options);
  if (std::uint64_t{image.width} * image.height >= std::uint64_t{1} << 30) {
    throw Error(ErrorCode::input, "The height field is " + std::to_string(image.width) + " x " +
                                      std::to_string(image.height) +
                                      " pixels: at most 2^30 are supported. Scale it down.");
  }
  Mesh mesh;
  mesh.name = "height field";
  const std::size_t count = std::size_t{image.width} * image.height;
  mesh.positions.reserve(count);
  mesh.uvs.reserve(count);
  for (std::uint32_t row = 0; row < image.height; ++row) {
    const double v = 1 - row / (image.height - 1.0);
    for (std::uint32_t column = 0; column < image.width; ++column) {
      const double u = column / (image.width - 1.0);
      const float value = *image.at(column, row);
      if (!std::isfinite(value)) {
        throw Error(ErrorCode::input, "The height field's value at column " +
                                          std::to_string(column) + ", row " + std::to_string(row) +
                                          " is not finite: fill such holes.");
      }
      mesh.positions.push_back({static_cast<float>((u - 0.5) * extent.width),
                                static_cast<float>((v - 0.5) * extent.depth),
                                static_cast<float>(value * options.height)});
      mesh.uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
    }
  }
  mesh.triangles.reserve(std::size_t{2} * (image.width - 1) * (image.height - 1));
  for (std::uint32_t row = 0; row + 1 < image.height; ++row) {
    for (std::uint32_t column = 0; column + 1 < image.width; ++column) {
      const std::uint32_t upper = row * image.width + column;
      const std::uint32_t lower = upper + image.width;
      mesh.triangles.push_back({lower, lower + 1, upper + 1});
      mesh.triangles.push_back({lower, upper + 1, upper});
    }
  }
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

Mesh height_field_plane(const Image& image, const HeightFieldOptions& options) {
  const Extent extent = extent_of(image, options);
  Mesh mesh;
  mesh.name = "plane";
  for (const Vec2& uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
    mesh.positions.push_back({static_cast<float>((uv.x - 0.5) * extent.width),
                              static_cast<float>((uv.y - 0.5) * extent.depth), 0});
    mesh.uvs.push_back(uv);
  }
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.uv_triangles = mesh.triangles;
  return mesh;
}

void lay_out_over_height_field(Mesh& mesh, const Image& image, const HeightFieldOptions& options) {
  const Extent extent = extent_of(image, options);
  lay_out_over(mesh, {{0, 0}, {extent.width, extent.depth}});
}

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
        "Mesh '" + field.name + "' has no area in the plane of x and y, so it is no height field.");
  }
  return {{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2}, {high[0] - low[0], high[1] - low[1]}};
}

void lay_out_over(Mesh& mesh, const FieldRectangle& rectangle) {
  const auto& [center, size] = rectangle;
  mesh.uvs.clear();
  for (const Vec3& p : mesh.positions) {
    const double u = (p.x + mesh.origin[0] - center[0]) / size[0] + 0.5;
    const double v = (p.y + mesh.origin[1] - center[1]) / size[1] + 0.5;
    mesh.uvs.push_back({to_border(u), to_border(v)});
  }
  mesh.uv_triangles = mesh.triangles;
}

}  // namespace kiln
