// Normals of a volume's field at the texels of a low poly.
#include "kiln/gradient.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "base/formatted.h"
#include "base/normal_angle.h"
#include "base/parallel.h"
#include "mesh/vector.h"
#include "volume/cell_grid.h"
#include "volume/field.h"
#include "volume/outer.h"

namespace kiln {
namespace {

constexpr double kGradientStep = 0.25;  // Step of central differences, in cells
constexpr std::uint32_t kNoTriangle = 0xFFFFFFFF;
/// Tolerance in texels for points on a triangle's sides: rounding may move the corners of charts
/// off the texel centres on which they lie.
constexpr double kTexelTolerance = 1e-3;

/// Squared length below which a vector has no direction.
constexpr double kMinSquaredLength = 1e-6;

/// Transforms between index space and world space.
struct IndexAndWorldSpace {
  Vec3d origin{};
  Vec3d rows[3]{};  ///< Rows of the matrix from world to index space

  explicit IndexAndWorldSpace(const Volume& volume)
      : origin{volume.origin[0], volume.origin[1], volume.origin[2]} {
    const auto axis = [&](std::size_t k) {
      return Vec3d(volume.axes[k][0], volume.axes[k][1], volume.axes[k][2]);
    };
    const double determinant = dot(axis(0), cross(axis(1), axis(2)));
    for (std::size_t k = 0; k < 3; ++k) {
      rows[k] = cross(axis((k + 1) % 3), axis((k + 2) % 3)) * (1 / determinant);
    }
  }
  Vec3d to_index(const Vec3d& v) const {
    return {dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)};
  }
  /// Gradients transform by the inverse transpose.
  Vec3d gradient_to_world(const Vec3d& g) const {
    return rows[0] * g.x + rows[1] * g.y + rows[2] * g.z;
  }
};

/// Finds the cells that the outer surface crosses. Returns null without ContourOptions::outer_only,
/// since then every crossing of the isosurface is part of the surface.
template <typename T>
std::unique_ptr<CellGrid> find_outer_surface_cells(const DeviceVoxels& voxels, const Volume& volume,
                                                   const ContourOptions& options) {
  if (!options.outer_only) return nullptr;
  auto cells = std::make_unique<CellGrid>(volume.size);
  const VolumeField<T> field(voxels, volume, options);
  const auto& size = volume.size;
  parallel_for(size[2], 4, [&](std::size_t begin, std::size_t end) {
    for (auto z = static_cast<std::uint32_t>(begin); z < end; ++z) {
      for (std::uint32_t y = 0; y < size[1]; ++y) {
        std::uint64_t* row = cells->plane(z + 1) + std::size_t{y + 1} * cells->row_words();
        for (std::uint32_t x = 0; x < size[0]; ++x) {
          const double value = field.value(Vec3d(x, y, z));
          if (field.is_solid(value)) row[(x + 1) >> 6] |= std::uint64_t{1} << ((x + 1) & 63);
        }
      }
    }
  });
  fill_unreached(*cells, options.outer_gap, volume.name);
  return cells;
}

/// Searches a line, from its middle in both directions, for the nearest point at which it leaves
/// the solid. Only crossings from inside to outside in the line's direction count.
template <typename T>
class SurfaceFinder {
 public:
  enum class LineResult { no_crossing, border, surface };

  SurfaceFinder(const VolumeField<T>& field, const CellGrid* cells, bool closed)
      : field_(field), cells_(cells), has_closed_border_(closed) {}

  /// \param from, along  the line consists of the points from + t * along in index space, with |t|
  ///   up to 1
  /// \param surface_point  [out] the crossing, if there is one
  LineResult find(const Vec3d& from, const Vec3d& along, Vec3d& surface_point) const {
    const auto steps = std::max(1, static_cast<int>(std::ceil(length(along) / kGradientStep)));
    const double step = 1.0 / steps;
    bool is_solid_forward = is_solid_at(from), is_solid_backward = is_solid_forward;
    for (int k = 0; k < steps; ++k) {
      const double t = k * step, u = (k + 1) * step;
      const bool is_next_solid_forward = is_solid_at(from + along * u),
                 is_next_solid_backward = is_solid_at(from + along * -u);
      const bool leaves_forward = is_solid_forward && !is_next_solid_forward,
                 leaves_backward = is_next_solid_backward && !is_solid_backward;
      is_solid_forward = is_next_solid_forward;
      is_solid_backward = is_next_solid_backward;
      double best = 2;
      LineResult line_result = LineResult::no_crossing;
      if (leaves_forward) refine_crossing(from, along, t, u, best, line_result, surface_point);
      if (leaves_backward) refine_crossing(from, along, -u, -t, best, line_result, surface_point);
      if (line_result != LineResult::no_crossing) return line_result;
    }
    return LineResult::no_crossing;
  }

 private:
  bool is_solid_at(const Vec3d& p) const {
    return field_.contains(p) && field_.is_solid(field_.value(p));
  }

  /// Refines a crossing by root finding, and stores it if it is nearer than the best one so far.
  /// \param inside, outside  parameters t of a point inside and a point outside of the solid
  void refine_crossing(const Vec3d& from, const Vec3d& along, double inside, double outside,
                       double& best, LineResult& line_result, Vec3d& surface_point) const {
    const auto at = [&](double t) { return from + along * t; };
    LineResult kind = LineResult::surface;
    if (!field_.contains(at(outside))) {
      // Bisects for the last point of the line that is within the volume.
      double in = inside, out = outside;
      for (int round = 0; round < 60 && in != out; ++round) {
        const double middle = (in + out) / 2;
        (field_.contains(at(middle)) ? in : out) = middle;
      }
      outside = in;
      if (is_solid_at(at(outside))) {
        if (!has_closed_border_) return;
        kind = LineResult::border;
      }
    }
    double t = outside;
    if (kind == LineResult::surface) {
      double a = inside, b = outside;
      double fa = field_.value(at(a)), fb = field_.value(at(b));
      for (int round = 0; round < 60 && std::abs(b - a) > 1e-12; ++round) {
        t = fa != fb ? (a * fb - b * fa) / (fb - fa) : (a + b) / 2;
        t = std::clamp(t, std::min(a, b), std::max(a, b));
        const double f = field_.value(at(t));
        if (f == 0 || std::abs(t - b) < 1e-13) break;
        // Illinois variant of regula falsi: if one end of the interval stays twice in succession,
        // the value there is halved.
        if ((f > 0) == (fb > 0)) {
          fa /= 2;
        } else {
          a = b;
          fa = fb;
        }
        b = t;
        fb = f;
      }
    }
    if (std::abs(t) >= best) return;
    if (kind == LineResult::surface && cells_ != nullptr) {
      const auto cell = field_.cell_of(at(t));
      const std::uint32_t corners = cells_->corners({cell[0] + 1, cell[1] + 1, cell[2] + 1});
      if (corners == 0 || corners == 0xFF) return;
    }
    best = std::abs(t);
    line_result = kind;
    surface_point = at(t);
  }

  const VolumeField<T>& field_;
  const CellGrid* cells_;
  bool has_closed_border_;
};

/// Finds the triangle that covers each texel's centre; kNoTriangle where there is none.
std::vector<std::uint32_t> rasterize(const Mesh& low, std::uint32_t size) {
  std::vector<std::uint32_t> triangles(std::size_t{size} * size, kNoTriangle);
  for (std::uint32_t t = 0; t < low.uv_triangles.size(); ++t) {
    double x[3], y[3];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 uv = low.uvs[low.uv_triangles[t][k]];
      x[k] = double{uv.x} * size - 0.5;
      y[k] = (1 - double{uv.y}) * size - 0.5;
    }
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (!(std::abs(area) > 0 && std::isfinite(area))) continue;
    const auto first = [&](const double* v) {
      return static_cast<std::uint32_t>(
          std::clamp(std::ceil(std::min({v[0], v[1], v[2]}) - kTexelTolerance), 0.0, double(size)));
    };
    const auto end = [&](const double* v) {
      return static_cast<std::uint32_t>(std::clamp(
          std::floor(std::max({v[0], v[1], v[2]}) + kTexelTolerance) + 1, 0.0, double(size)));
    };
    for (std::uint32_t j = first(y); j < end(y); ++j) {
      for (std::uint32_t i = first(x); i < end(x); ++i) {
        bool is_inside_triangle = true;
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t n = (k + 1) % 3;
          const double dx = x[n] - x[k], dy = y[n] - y[k];
          const double side = (dx * (j - y[k]) - dy * (i - x[k])) * (area > 0 ? 1 : -1);
          is_inside_triangle = is_inside_triangle && side >= -kTexelTolerance * std::hypot(dx, dy);
        }
        std::uint32_t& texel = triangles[std::size_t{j} * size + i];
        if (is_inside_triangle && texel == kNoTriangle) texel = t;
      }
    }
  }
  return triangles;
}

/// The low poly's point at a texel's centre.
struct LowPolyPoint {
  // Unit normals of shading and of the face; zero if degenerate
  Vec3d position{}, shading{}, face{};
};

Vec3d normalize(const Vec3d& v) {
  const double l = length(v);
  return l > 0 && std::isfinite(l) ? v * (1 / l) : Vec3d();
}

LowPolyPoint low_poly_point(const Mesh& low, std::uint32_t triangle, std::size_t place,
                            std::uint32_t size) {
  const std::size_t row = place / size;
  const double px = static_cast<double>(place % size), py = static_cast<double>(row);
  double x[3], y[3];
  Vec3d p[3]{}, n[3]{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2 uv = low.uvs[low.uv_triangles[triangle][k]];
    x[k] = double{uv.x} * size - 0.5;
    y[k] = (1 - double{uv.y}) * size - 0.5;
    p[k] = to_double(low.positions[low.triangles[triangle][k]]);
    n[k] = to_double(low.normals[low.normal_triangles[triangle][k]]);
  }
  const double area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  const double second = ((px - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (py - y[0])) / area;
  const double third = ((x[1] - x[0]) * (py - y[0]) - (px - x[0]) * (y[1] - y[0])) / area;
  const double w[3] = {1 - second - third, second, third};
  LowPolyPoint point;
  for (std::size_t k = 0; k < 3; ++k) {
    point.position += p[k] * w[k];
    point.shading += n[k] * w[k];
  }
  point.shading = normalize(point.shading);
  point.face = normalize(cross(p[1] - p[0], p[2] - p[0]));
  return point;
}

void check_options(const Mesh& low, const GradientOptions& options) {
  if (options.size < 1 || options.size > 16384) {
    throw Error(ErrorCode::usage,
                "The map's size is " + std::to_string(options.size) + " texels; use 1 to 16384.");
  }
  if (!(options.reach > 0 && std::isfinite(options.reach))) {
    throw Error(ErrorCode::usage, "The search distance (reach) is " + decimal(options.reach) +
                                      ": it must be above 0.");
  }
  if (low.uv_triangles.size() != low.triangles.size() ||
      low.normal_triangles.size() != low.triangles.size()) {
    throw Error(ErrorCode::input, "Low poly '" + low.name +
                                      "' lacks UVs or normals: both are needed for every corner.");
  }
}

}  // namespace

GradientReference::GradientReference(const Volume& volume, const ContourOptions& contour,
                                     const Mesh& low, const GradientOptions& options)
    : size_(options.size) {
  check_options(low, options);
  double lowest = 0, highest = 0;
  const DeviceVoxels voxels = convert_voxels(volume, contour, lowest, highest);
  const std::vector<std::uint32_t> triangles = rasterize(low, size_);
  enum : std::uint8_t { kUncovered, kMeasured, kNoSurface, kAtBorder, kNoGradient };
  std::vector<std::uint8_t> status(triangles.size(), kUncovered);
  // Index of the first covered texel of each row
  std::vector<std::size_t> row_begins(size_ + 1, 0);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    row_begins[i / size_ + 1] += triangles[i] != kNoTriangle ? 1 : 0;
  }
  for (std::size_t y = 0; y < size_; ++y) row_begins[y + 1] += row_begins[y];
  covered_ = row_begins[size_];
  texels_.resize(covered_);
  const IndexAndWorldSpace index_and_world(volume);
  const Vec3d shift = Vec3d(low.origin[0], low.origin[1], low.origin[2]) - index_and_world.origin;

  const auto run = [&]<typename T>(const T*) {
    const VolumeField<T> field(voxels, volume, contour);
    const std::unique_ptr<CellGrid> cells = find_outer_surface_cells<T>(voxels, volume, contour);
    const SurfaceFinder<T> finder(field, cells.get(), contour.border == VolumeBorder::closed);
    parallel_for(size_, 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        Texel* texel = texels_.data() + row_begins[y];
        for (std::size_t i = y * size_; i < (y + 1) * size_; ++i) {
          if (triangles[i] == kNoTriangle) continue;
          const LowPolyPoint point = low_poly_point(low, triangles[i], i, size_);
          const Vec3d& line = options.line == GradientLine::face ? point.face : point.shading;
          Vec3d surface_point{};
          const auto line_result =
              finder.find(index_and_world.to_index(point.position + shift),
                          index_and_world.to_index(line * options.reach), surface_point);
          Vec3d outward_normal{};
          if (line_result == SurfaceFinder<T>::LineResult::surface) {
            outward_normal =
                -normalize(index_and_world.gradient_to_world(field.gradient(surface_point)));
          }
          status[i] = line_result == SurfaceFinder<T>::LineResult::no_crossing ? kNoSurface
                      : line_result == SurfaceFinder<T>::LineResult::border    ? kAtBorder
                      : dot(outward_normal, outward_normal) == 0               ? kNoGradient
                                                                               : kMeasured;
          *texel++ = {static_cast<std::uint32_t>(i), to_float(outward_normal),
                      to_float(point.shading)};
        }
      }
    });
  };
  switch (voxels.type) {
    case VoxelType::u8:
      run(static_cast<const std::uint8_t*>(nullptr));
      break;
    case VoxelType::i8:
      run(static_cast<const std::int8_t*>(nullptr));
      break;
    case VoxelType::u16:
      run(static_cast<const std::uint16_t*>(nullptr));
      break;
    case VoxelType::i16:
      run(static_cast<const std::int16_t*>(nullptr));
      break;
    default:
      run(static_cast<const float*>(nullptr));
      break;
  }
  for (const Texel& texel : texels_) {
    const std::uint8_t s = status[texel.place];
    no_surface_ += s == kNoSurface ? 1 : 0;
    cut_ += s == kAtBorder ? 1 : 0;
    no_gradient_ += s == kNoGradient ? 1 : 0;
  }
  std::erase_if(texels_, [&](const Texel& texel) { return status[texel.place] != kMeasured; });
}

template <typename Normal>
GradientError GradientReference::compare_with(const Normal& normal) const {
  GradientError error;
  error.texels = texels_.size();
  if (texels_.empty()) return error;
  std::vector<double> degrees(texels_.size());
  std::atomic<std::uint64_t> empty = 0;
  parallel_for(texels_.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d wanted = to_double(texels_[i].wanted);
      Vec3d given = normal(texels_[i]);
      if (!(dot(given, given) > kMinSquaredLength)) {
        given = to_double(texels_[i].shading);
        ++empty;
      }
      degrees[i] =
          std::atan2(length(cross(given, wanted)), dot(given, wanted)) * 180 / std::numbers::pi;
    }
  });
  error.empty = empty;
  double sum = 0, squares = 0;
  for (const double d : degrees) {
    sum += d;
    squares += d * d;
  }
  const auto count = static_cast<double>(degrees.size());
  error.mean_degrees = sum / count;
  error.rms_degrees = std::sqrt(squares / count);
  error.median_degrees = percentile(degrees, 50);
  error.p95_degrees = percentile(degrees, 95);
  error.p99_degrees = percentile(degrees, 99);
  error.max_degrees = *std::max_element(degrees.begin(), degrees.end());
  return error;
}

GradientError GradientReference::compare(const Image& map) const {
  if (map.width != size_ || map.height != size_ || map.channels < 3 ||
      map.pixels.size() != std::size_t{size_} * size_ * map.channels) {
    throw Error(ErrorCode::input,
                "The map has " + std::to_string(map.width) + " x " + std::to_string(map.height) +
                    " texels of " + std::to_string(map.channels) +
                    " channels: a normal map of side " + std::to_string(size_) + " is needed.");
  }
  return compare_with([&](const Texel& texel) {
    const float* n = &map.pixels[std::size_t{texel.place} * map.channels];
    return Vec3d(2.0 * n[0] - 1, 2.0 * n[1] - 1, 2.0 * n[2] - 1);
  });
}

GradientError GradientReference::compare_without_map() const {
  return compare_with([](const Texel& texel) { return to_double(texel.shading); });
}

}  // namespace kiln
