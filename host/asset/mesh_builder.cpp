#include "asset/mesh_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <mutex>

#include "asset/axes.h"
#include "base/counted.h"
#include "base/formatted.h"
#include "base/parallel.h"
#include "io/file/bounds.h"
#include "mesh/box.h"
#include "mesh/frame.h"
#include "mesh/polygon.h"
#include "mesh/smoothing_groups.h"
#include "mesh/steps.h"
#include "mesh/usable.h"

namespace kiln {
namespace {

/// Maximum number of elements: indices have 32 bits, kNone takes one of their values, and OpenCL's
/// sizes are signed.
constexpr std::uint64_t kMaxCount = 0x7FFFFFFFu;

Vec3d vector_of(const MeshBuilder::Position& p) { return {p[0], p[1], p[2]}; }

std::string coordinates(const Vec3d& p) { return place_text(p.x, p.y, p.z); }

constexpr std::array<std::uint8_t, 4> kWhite{255, 255, 255, 255};

// Up to this number of faces, memory is not checked
constexpr std::uint64_t kUncheckedFaces = std::uint64_t{1} << 17;

// Number of elements in one task of a parallel loop
constexpr std::size_t kItemsPerPiece = std::size_t{1} << 16;

}  // namespace

Vec3 unit_normal(const Vec3& n) {
  const double x = n.x, y = n.y, z = n.z;
  const double length = std::sqrt(x * x + y * y + z * z);
  if (!(length > 0) || !std::isfinite(length)) return {};
  // A vector of unit length, within the precision of floats, is not changed, so that repeated
  // reading and writing does not accumulate errors.
  if (std::abs(length - 1) < 1.5e-7) return n;
  return {static_cast<float>(x / length), static_cast<float>(y / length),
          static_cast<float>(z / length)};
}

/// Checks that memory suffices before the lists grow: a text file may contain more faces than it
/// declares.
void MeshBuilder::check_growth() const {
  const auto bytes = [](const auto& list) {
    return std::uint64_t{list.capacity()} * sizeof(list[0]);
  };
  const std::uint64_t used_bytes =
      bytes(triangles_) + bytes(uv_triangles_) + bytes(normal_triangles_) + bytes(polygons_) +
      bytes(polygon_vertex_) + bytes(polygon_uv_) + bytes(polygon_normal_) + groups_.bytes() +
      objects_.bytes() + materials_.bytes() + smoothing_.bytes() + bytes(positions) +
      triangle_colors_.memory();
  const FailWith fail = [this](const std::string& place, const std::string& problem,
                               const Message& remedy) { input_.fail(place, problem, remedy); };
  require_memory("its faces", 2 * used_bytes, memory_failure(fail, ""));
}

void MeshBuilder::add_face(std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> uv,
                           std::span<const std::uint32_t> normal, bool mirrored) {
  const std::size_t n = vertex.size();
  const std::uint64_t face = faces_++;
  if (face >= std::max(kUncheckedFaces, reserved_faces_) && std::has_single_bit(face)) {
    check_growth();
  }
  if (n < 3) {
    if (short_faces_++ == 0) first_short_face_ = face;
    next_color_.reset();
    next_color_bytes_.reset();
    return;
  }
  if (triangles_.size() + n > kMaxCount) {
    input_.fail("", "it has more than " + std::to_string(kMaxCount) + " triangles",
                "Split or simplify the mesh.");
  }
  if (n > 3) {
    polygons_.push_back({static_cast<std::uint32_t>(triangles_.size()),
                         static_cast<std::uint32_t>(n), polygon_vertex_.size(), mirrored});
    // The three pools have the same layout, so one offset serves all of them.
    const auto append = [n](std::vector<std::uint32_t>& pool,
                            std::span<const std::uint32_t> values) {
      if (values.empty()) {
        pool.resize(pool.size() + n, kNone);
      } else {
        pool.insert(pool.end(), values.begin(), values.end());
      }
    };
    append(polygon_vertex_, vertex);
    append(polygon_uv_, uv);
    append(polygon_normal_, normal);
  }
  const auto fan_triangle = [mirrored](std::span<const std::uint32_t> values, std::size_t i) {
    return mirrored ? Triangle{values[0], values[i + 1], values[i]}
                    : Triangle{values[0], values[i], values[i + 1]};
  };
  const auto append_face = [&](std::vector<Triangle>& list, std::span<const std::uint32_t> values) {
    // No earlier vertex has the attribute, so there is nothing to fill
    if (values.empty() && list.empty()) return;
    list.resize(triangles_.size(), Triangle{kNone, kNone, kNone});
    for (std::size_t i = 1; i + 1 < n; ++i) {
      list.push_back(values.empty() ? Triangle{kNone, kNone, kNone} : fan_triangle(values, i));
    }
  };
  append_face(uv_triangles_, uv);
  append_face(normal_triangles_, normal);
  for (std::size_t i = 1; i + 1 < n; ++i) triangles_.push_back(fan_triangle(vertex, i));
  add_face_color(n - 2);
  for (Names* names : {&groups_, &objects_, &materials_, &smoothing_})
    names->extend_to(triangles_.size());
}

bool MeshBuilder::add_triangles(std::uint64_t count, bool has_uvs, bool has_normals,
                                const std::function<bool(std::span<Triangle>)>& fill) {
  if (faces_ != 0 || count > kMaxCount) return false;
  const FailWith fail = [this](const std::string& place, const std::string& problem,
                               const Message& remedy) { input_.fail(place, problem, remedy); };
  const std::uint64_t lists = 1 + (has_uvs ? 1 : 0) + (has_normals ? 1 : 0);
  require_memory("its faces", lists * count * sizeof(Triangle), memory_failure(fail, ""));
  triangles_.resize(count);
  if (!fill(triangles_)) {
    triangles_.clear();
    return false;
  }
  if (has_uvs) uv_triangles_ = triangles_;
  if (has_normals) normal_triangles_ = triangles_;
  faces_ = count;
  for (Names* names : {&groups_, &objects_, &materials_, &smoothing_}) names->extend_to(count);
  return true;
}

void MeshBuilder::reserve_triangles(std::uint64_t count, bool has_uvs) {
  reserved_faces_ = std::min(count, kMaxCount);
  triangles_.reserve(reserved_faces_);
  normal_triangles_.reserve(reserved_faces_);
  if (has_uvs) uv_triangles_.reserve(reserved_faces_);
  for (Names* names : {&objects_, &materials_}) names->reserve(reserved_faces_);
}

void MeshBuilder::Names::set(std::string_view name, std::size_t triangles) {
  if (name.empty()) name = "default";
  if (names_.empty() && triangles != 0) {
    // Faces before the first name get the name "default".
    ids_.emplace("default", 0);
    names_.emplace_back("default");
    name_of_triangle_.resize(triangles, 0);
  }
  const auto [entry, added] =
      ids_.emplace(std::string(name), static_cast<std::uint32_t>(names_.size()));
  if (added) names_.emplace_back(name);
  current_name_ = entry->second;
}

std::array<std::array<std::uint8_t, 4>, 2> MeshBuilder::color_versions(
    const std::array<double, 4>& rgba) {
  const auto scaled = [&rgba](double scale) {
    std::array<std::uint8_t, 4> bytes;
    for (std::size_t k = 0; k < 4; ++k) {
      const double value = rgba[k] * scale;
      bytes[k] = static_cast<std::uint8_t>(std::lround(value > 0 ? std::min(value, 255.0) : 0.0));
    }
    return bytes;
  };
  return {scaled(1), scaled(255)};
}

double MeshBuilder::largest_channel(const std::array<double, 4>& rgba) {
  double largest = 0;
  for (const double value : rgba) {
    if (std::isfinite(value)) largest = std::max(largest, value);
  }
  return largest;
}

bool MeshBuilder::are_fractions(double largest) {
  // Fractions that were converted may be slightly above 1, such as 1.0000001.
  constexpr double kMaxFraction = 1.001;
  return largest <= kMaxFraction;
}

void MeshBuilder::Colors::set(std::size_t i, const std::array<double, 4>& rgba) {
  largest_ = std::max(largest_, largest_channel(rgba));
  const auto [bytes, fractions] = color_versions(rgba);
  set_bytes(i, bytes);
  fractions_[i] = fractions;
}

void MeshBuilder::Colors::set_bytes(std::size_t i, const std::array<std::uint8_t, 4>& rgba) {
  for (auto* list : {&bytes_, &fractions_}) {
    if (list->size() <= i) list->resize(i + 1, kWhite);
    (*list)[i] = rgba;
  }
  ++count_;
}

/// Decides whether the colours of a file are fractions or bytes, if the format allows both.
/// \returns the colours, converted to bytes
std::vector<std::array<std::uint8_t, 4>> MeshBuilder::Colors::finish(std::size_t size,
                                                                     const MeshInput& input) {
  for (auto* list : {&bytes_, &fractions_}) list->resize(size, kWhite);
  constexpr double kMaxDarkByte = 16;
  if (are_fractions(largest_)) return std::move(fractions_);
  if (largest_ < kMaxDarkByte) {
    const std::string text = formatted("%.4g", largest_);
    input.warn(
        "color-scale",
        "its largest colour channel is " + text +
            ". Colours above 1 are read as 0 to 255, which makes these nearly black. If they are "
            "fractions brighter than white, export them clamped to 1.",
        count_);
  }
  return std::move(bytes_);
}

void MeshBuilder::finish_colors() {
  if (vertex_colors_.empty()) return;
  if (vertex_colors_.count() < positions.size()) {
    const std::uint64_t missing_count = positions.size() - vertex_colors_.count();
    input_.warn("missing-colors",
                std::to_string(missing_count) + " vertices have no colour; they are white.",
                missing_count);
  }
  colors = vertex_colors_.finish(positions.size(), input_);
}

/// Assigns the colour of a face to all of its triangles.
void MeshBuilder::add_face_color(std::size_t triangles) {
  if (!next_color_ && !next_color_bytes_) return;
  ++colored_faces_;
  for (std::size_t t = triangles_.size() - triangles; t < triangles_.size(); ++t) {
    if (next_color_) {
      triangle_colors_.set(t, *next_color_);
    } else {
      triangle_colors_.set_bytes(t, *next_color_bytes_);
    }
  }
  next_color_.reset();
  next_color_bytes_.reset();
}

/// Converts colours of faces to colours of vertices. A vertex gets the first colour of its faces;
/// for each further colour, a copy of the vertex is appended, so that indices in messages stay
/// valid. Colours of vertices take precedence, unless they are uniform while those of faces vary,
/// or all are white, since programs such as MeshLab always write vertex colours.
void MeshBuilder::convert_face_colors(Mesh& mesh) {
  if (triangle_colors_.empty()) return;
  const std::uint64_t colored = triangle_colors_.count();
  const auto triangle_colors = triangle_colors_.finish(mesh.triangles.size(), input_);
  const auto has_different_colors = [](const auto& list) {
    return std::any_of(list.begin(), list.end(), [&](const auto& c) { return c != list[0]; });
  };
  const bool white = mesh.colors.empty() || mesh.colors[0] == kWhite;
  if (has_different_colors(mesh.colors) || (!white && !has_different_colors(triangle_colors))) {
    if (has_different_colors(triangle_colors)) {
      input_.warn("face-colors-left-out",
                  counted(colored_faces_, "face") + (colored_faces_ == 1 ? " has" : " have") +
                      " a colour, and so do vertices: the colours of the vertices are used. To use "
                      "the colours of the faces, export the mesh without vertex colours.",
                  colored_faces_);
    }
    return;
  }
  if (colored < mesh.triangles.size()) {
    const std::uint64_t missing_count = faces_ - short_faces_ - colored_faces_;
    input_.warn("missing-colors",
                counted(missing_count, "face") +
                    (missing_count == 1 ? " has no colour; it is" : " have no colour; they are") +
                    " white.",
                missing_count);
  }
  mesh.colors.assign(mesh.positions.size(), kWhite);
  std::vector<bool> has_color(mesh.positions.size());
  // Index of the copied vertex for each pair of original vertex and colour
  std::unordered_map<std::uint64_t, std::uint32_t> vertex_copies;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::array<std::uint8_t, 4>& color = triangle_colors[t];
    for (std::uint32_t& corner : mesh.triangles[t]) {
      if (!has_color[corner]) {
        has_color[corner] = true;
        mesh.colors[corner] = color;
      }
      if (mesh.colors[corner] == color) continue;
      const std::uint64_t key = std::uint64_t{corner} << 32U | std::bit_cast<std::uint32_t>(color);
      const auto [entry, added] =
          vertex_copies.try_emplace(key, static_cast<std::uint32_t>(mesh.positions.size()));
      if (added) {
        if (mesh.positions.size() == kMaxCount) {
          input_.fail("",
                      "it needs more than " + std::to_string(kMaxCount) +
                          " vertices, since each colour at a vertex needs a copy of the vertex",
                      "Split or simplify the mesh.");
        }
        mesh.positions.push_back(Vec3(mesh.positions[corner]));
        mesh.colors.push_back(color);
      }
      corner = entry->second;
    }
  }
}

void MeshBuilder::split_polygons() {
  std::vector<Position> corners;
  std::vector<Triangle> polygon_triangles;
  std::uint64_t fan_count = 0;
  std::uint32_t first_fan = 0;
  for (const Polygon& polygon : polygons_) {
    corners.clear();
    for (std::uint32_t i = 0; i < polygon.corners; ++i) {
      corners.push_back(positions[polygon_vertex_[polygon.offset + i]]);
    }
    if (!triangulate(corners, input_.options.triangulation, polygon_triangles) && fan_count++ == 0)
      first_fan = polygon.first_triangle;
    for (std::size_t t = 0; t < polygon_triangles.size(); ++t) {
      if (polygon.mirrored) std::swap(polygon_triangles[t][1], polygon_triangles[t][2]);
      for (int k = 0; k < 3; ++k) {
        const std::uint64_t corner = polygon.offset + polygon_triangles[t][k];
        const std::size_t triangle = polygon.first_triangle + t;
        triangles_[triangle][k] = polygon_vertex_[corner];
        if (!uv_triangles_.empty()) uv_triangles_[triangle][k] = polygon_uv_[corner];
        if (!normal_triangles_.empty()) normal_triangles_[triangle][k] = polygon_normal_[corner];
      }
    }
  }
  if (fan_count != 0) {
    input_.warn("fan-split-polygons",
                std::to_string(fan_count) +
                    " polygons cross themselves, have no area or are too complex (" +
                    describe_face(first_fan) +
                    " for example) and were triangulated as if they were convex.",
                fan_count);
  }
}

void MeshBuilder::number_polygons(Mesh& mesh) const {
  if (polygons_.empty()) return;
  mesh.polygons.resize(mesh.triangles.size());
  auto next = polygons_.begin();
  std::uint32_t number = 0;
  for (std::size_t t = 0; t < mesh.polygons.size(); ++number) {
    const bool starts_polygon = next != polygons_.end() && next->first_triangle == t;
    const std::size_t count = starts_polygon ? next->corners - 2 : 1;
    if (starts_polygon) ++next;
    for (std::size_t k = 0; k < count; ++k) mesh.polygons[t++] = number;
  }
}

/// Warns of vertices that are not finite.
void MeshBuilder::check_finite() const {
  const auto is_bad = [](const Position& p) {
    return !std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]);
  };
  const auto bad_count =
      static_cast<std::uint64_t>(std::count_if(positions.begin(), positions.end(), is_bad));
  if (bad_count == positions.size()) {
    input_.fail("vertex 0", "all coordinates are NaN or infinite",
                "The program that wrote the file failed: export the mesh again.");
  }
  if (bad_count == 0) return;
  const auto first = std::find_if(positions.begin(), positions.end(), is_bad);
  input_.warn("non-finite-vertices",
              std::to_string(bad_count) + " vertices have a NaN or infinite coordinate (vertex " +
                  std::to_string(first - positions.begin()) + ": " +
                  coordinates(vector_of(*first)) + "); triangles with these vertices are skipped.",
              bad_count);
}

/// True if a triangle has an area in double precision, which is that of the file.
bool MeshBuilder::has_area_in_file(std::size_t triangle) const {
  const auto [a, b, c] = triangles_[triangle];
  return has_area(vector_of(positions[a]), vector_of(positions[b]), vector_of(positions[c]));
}

/// Bounding box of the triangles that have an area; if there are none, of all finite vertices.
Box<Vec3d> MeshBuilder::box() const {
  Box<Vec3d> total_box;
  std::mutex mutex;
  parallel_for(triangles_.size(), kItemsPerPiece, [&](std::size_t begin, std::size_t end) {
    Box<Vec3d> part;
    for (std::size_t t = begin; t < end; ++t) {
      if (!has_area_in_file(t)) continue;
      for (const std::uint32_t corner : triangles_[t]) part.add(vector_of(positions[corner]));
    }
    const std::lock_guard lock(mutex);
    total_box.join(part);
  });
  if (!total_box.is_empty()) return total_box;
  for (const Position& p : positions) {
    if (std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]))
      total_box.add(vector_of(p));
  }
  return total_box;
}

void MeshBuilder::convert_positions(Mesh& mesh) {
  check_finite();
  const Box<Vec3d> used_box = box();
  const auto& [low, high] = used_box;
  Position box_center{}, size{};
  double coordinate_extent = 0;
  for (int k = 0; k < 3; ++k) {
    size[k] = high[k] - low[k];
    box_center[k] = low[k] + size[k] / 2;
    coordinate_extent = std::max(coordinate_extent, size[k]);
  }
  const double diagonal =
      coordinate_extent > 0
          ? coordinate_extent * std::hypot(size[0] / coordinate_extent, size[1] / coordinate_extent,
                                           size[2] / coordinate_extent)
          : 0;
  mesh.origin = local_origin(box_center, diagonal);
  constexpr double kMaxFloat = std::numeric_limits<float>::max();
  // If the diagonal is smaller, floats are denormal and divide it into fewer than 2^24 steps.
  constexpr double kMinDiagonal = 0x1p-125;
  double reach = 0;
  for (int k = 0; k < 3; ++k) {
    reach =
        std::max({reach, std::abs(low[k] - mesh.origin[k]), std::abs(high[k] - mesh.origin[k])});
  }
  if (!(reach <= kMaxFloat)) {
    input_.fail("",
                "its coordinates reach " + coordinates(reach == std::abs(low[0]) ? low : high) +
                    ", beyond the range of single precision (3.4e38)",
                "Scale the mesh down.");
  }
  if (diagonal > 0 && diagonal < kMinDiagonal) {
    const std::string text = formatted("%.3g", diagonal);
    input_.fail("", "its size (" + text + ") is below the range of single precision",
                "Scale the mesh up.");
  }
  mesh.positions.resize(positions.size());
  parallel_for(positions.size(), kItemsPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Position& p = positions[i];
      mesh.positions[i] = {narrow(p[0] - mesh.origin[0]), narrow(p[1] - mesh.origin[1]),
                           narrow(p[2] - mesh.origin[2])};
    }
  });
  check_steps(mesh);
  collapse_flat_triangles(mesh, used_box);
}

/// Warns if edges are so short that the decimals in the file, or single precision, cannot represent
/// them well.
void MeshBuilder::check_steps(const Mesh& mesh) {
  const auto position = [&](std::uint32_t v) { return vector_of(positions[v]); };
  const FloatGrid grid(triangles_, position);
  const auto counts = [&](std::size_t t) { return has_area_in_file(t); };
  const auto stored = [&](std::uint32_t v) { return grid.step(position(v)); };
  const auto rounded = [&](std::uint32_t v) {
    Step coarsest;
    const Vec3& p = mesh.positions[v];
    const std::array<double, 3> stored = {p.x, p.y, p.z};
    for (std::size_t k = 0; k < 3; ++k) {
      const double size = 2 * std::abs(stored[k] - (positions[v][k] - mesh.origin[k]));
      if (size > coarsest.size) coarsest = {size, k};
    }
    return coarsest;
  };
  coarse_coordinates_ = coarse_steps({triangles_, counts, position, stored}, "stored");
  if (coarse_coordinates_.empty())
    coarse_coordinates_ = coarse_steps({triangles_, counts, position, rounded}, "rounded");
  // Checks whether a distant corner makes the bounding box so large that the other corners
  // coincide.
  const auto has_corners = [&](std::size_t t) {
    const Vec3d a = position(triangles_[t][0]), b = position(triangles_[t][1]),
                c = position(triangles_[t][2]);
    return length(cross(b - a, c - a)) > 0 && std::isfinite(length(a) + length(b) + length(c));
  };
  if (coarse_coordinates_.empty())
    coarse_coordinates_ = describe_stretched_box({triangles_, has_corners, position, {}});
  if (!coarse_coordinates_.empty()) input_.warn("coarse-coordinates", coarse_coordinates_, 1);
}

/// Moves the corners of a distant triangle without area to the same point; otherwise, rounding
/// might give it a large area.
void MeshBuilder::collapse_flat_triangles(const Mesh& mesh, const Box<Vec3d>& used) {
  if (std::all_of(positions.begin(), positions.end(),
                  [&](const Position& p) { return used.contains(vector_of(p)); })) {
    return;
  }
  // Relative error of floats that were written with nine digits
  constexpr double kNineDigitError = 1e-8;
  const auto is_rounded = [&](std::uint32_t v) {
    const Vec3& p = mesh.positions[v];
    const std::array<double, 3> stored = {p.x, p.y, p.z};
    for (std::size_t k = 0; k < 3; ++k) {
      const double file_coordinate = positions[v][k];
      if (std::abs(stored[k] + mesh.origin[k] - file_coordinate) >
          kNineDigitError * std::abs(file_coordinate))
        return true;
    }
    return false;
  };
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    Triangle& corners = triangles_[t];
    const bool has_distant_corner = std::any_of(
        corners.begin(), corners.end(),
        [&](std::uint32_t corner) { return !used.contains(vector_of(positions[corner])); });
    if (has_distant_corner && has_area(mesh.positions, corners) && !has_area_in_file(t) &&
        std::any_of(corners.begin(), corners.end(), is_rounded)) {
      corners = {corners[0], corners[0], corners[0]};
    }
  }
}

void MeshBuilder::complete_attributes(Mesh& mesh) {
  const auto fill = [this](std::vector<Triangle>& list, std::uint32_t placeholder) {
    if (list.empty()) return std::uint64_t{0};
    list.resize(triangles_.size(), Triangle{kNone, kNone, kNone});
    std::uint64_t incomplete_count = 0;
    for (Triangle& triangle : list) {
      if (std::find(triangle.begin(), triangle.end(), kNone) == triangle.end()) continue;
      ++incomplete_count;
      std::replace(triangle.begin(), triangle.end(), kNone, placeholder);
    }
    return incomplete_count;
  };
  std::uint64_t missing = 0;  // The UVs without the placeholder, which is no UV of the file
  if (const std::uint64_t missing_count =
          fill(uv_triangles_, static_cast<std::uint32_t>(uvs.size()))) {
    // The placeholder is NaN: a finite UV might lie in a chart, and would be baked there.
    constexpr float kMissingUv = std::numeric_limits<float>::quiet_NaN();
    uvs.push_back({kMissingUv, kMissingUv});
    for (UvSet& set : other_uvs) set.uvs.push_back({kMissingUv, kMissingUv});
    missing = 1;
    input_.warn("missing-uvs",
                counted(missing_count, "triangle") + (missing_count == 1 ? " has" : " have") +
                    " corners without a UV: no map is baked and no texture is read there.",
                missing_count);
  }
  if (const std::uint64_t missing_count =
          fill(normal_triangles_, static_cast<std::uint32_t>(normals.size()))) {
    normals.push_back({});
    input_.warn("missing-normals",
                counted(missing_count, "triangle") + (missing_count == 1 ? " has" : " have") +
                    " corners without a normal: these normals are computed.",
                missing_count);
  }
  if (uv_triangles_.empty()) {
    uvs.clear();
    missing = 0;
  }
  if (normal_triangles_.empty()) normals.clear();
  for (Vec3& normal : normals) normal = unit_normal(normal);
  const auto bad_count =
      static_cast<std::uint64_t>(std::count_if(
          uvs.begin(), uvs.end(),
          [](const Vec2& uv) { return !std::isfinite(uv.x) || !std::isfinite(uv.y); })) -
      missing;
  if (bad_count != 0) {
    input_.warn("non-finite-uvs",
                counted(bad_count, "UV") + (bad_count == 1 ? " is" : " are") +
                    " NaN or infinite: a bake skips triangles with these UVs.",
                bad_count);
  }
  mesh.uvs = std::move(uvs);
  if (!mesh.uvs.empty()) mesh.other_uvs = std::move(other_uvs);
  mesh.uv_triangles = std::move(uv_triangles_);
  mesh.normals = std::move(normals);
  mesh.normal_triangles = std::move(normal_triangles_);
  mesh.colors = std::move(colors);
  for (Names* names : {&groups_, &objects_, &materials_}) names->extend_to(triangles_.size());
  groups_.move_to(mesh.groups, mesh.group_names);
  objects_.move_to(mesh.objects, mesh.object_names);
  materials_.move_to(mesh.materials, mesh.material_names);
  mesh.material_files = std::move(material_files);
}

void MeshBuilder::count_degenerate(const Mesh& mesh) {
  struct TriangleCause {
    std::uint64_t count = 0;
    std::uint32_t first = 0;
    void add(std::uint32_t triangle) {
      if (count++ == 0) first = triangle;
    }
  };
  TriangleCause degenerate, rounded;
  // All threads search for triangles without area. These are few, so their causes are determined
  // afterwards, in order.
  std::vector<std::vector<std::uint32_t>> flat(mesh.triangles.size() / kItemsPerPiece + 1);
  parallel_for(mesh.triangles.size(), kItemsPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!has_area(mesh.positions, mesh.triangles[i])) {
        flat[begin / kItemsPerPiece].push_back(static_cast<std::uint32_t>(i));
      }
    }
  });
  std::uint64_t usable_count = mesh.triangles.size();
  for (const std::vector<std::uint32_t>& piece : flat) usable_count -= piece.size();
  for (const std::vector<std::uint32_t>& piece : flat) {
    for (const std::uint32_t i : piece) {
      const auto [a, b, c] = mesh.triangles[i];
      const bool has_repeated_corners = a == b || b == c || c == a;
      if (!has_repeated_corners && !(is_finite(mesh.positions[a]) && is_finite(mesh.positions[b]) &&
                                     is_finite(mesh.positions[c]))) {
        continue;
      }
      (!has_repeated_corners &&
               has_area(vector_of(positions[a]), vector_of(positions[b]), vector_of(positions[c]))
           ? rounded
           : degenerate)
          .add(i);
    }
  }
  if (usable_count == 0 && rounded.count != 0) {
    input_.fail(describe_face(rounded.first),
                "none of its " + std::to_string(mesh.triangles.size()) +
                    " triangles keeps an area in single precision" +
                    (coarse_coordinates_.empty()
                         ? ""
                         : ": " + coarse_coordinates_.substr(0, coarse_coordinates_.find(". "))),
                coarse_coordinates_.empty()
                    ? "Move the mesh to the world's origin."
                    : coarse_coordinates_.substr(coarse_coordinates_.find(". ") + 2));
  }
  if (usable_count == 0) {
    input_.fail(describe_face(0),
                "every one of its " + std::to_string(mesh.triangles.size()) +
                    " triangles is degenerate (repeated corners, no area, or a corner that is not "
                    "finite)",
                "Export the mesh again, and check its scale and number format.");
  }
  if (degenerate.count != 0) {
    input_.warn("degenerate-triangles",
                counted(degenerate.count, "triangle") + (degenerate.count == 1 ? " has" : " have") +
                    " no area in the file (" + describe_face(degenerate.first) +
                    " for example); these triangles are ignored.",
                degenerate.count);
  }
  if (rounded.count != 0) {
    input_.warn("rounded-triangles",
                counted(rounded.count, "triangle") + (rounded.count == 1 ? " has" : " have") +
                    " an area in the file, but none in single precision (" +
                    describe_face(rounded.first) + " for example); these triangles are ignored.",
                rounded.count);
  }
}

/// Requests normals that are computed from smoothing groups, unless the groups are the same
/// everywhere: some exporters write "s off" into every file.
void MeshBuilder::compute_group_normals(Mesh& mesh) {
  std::vector<std::uint32_t> groups;
  std::vector<std::string> names;
  smoothing_.move_to(groups, names);
  if (!mesh.normal_triangles.empty() || names.size() < 2) return;
  std::vector<std::uint32_t> numbers(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    numbers[i] = is_flat_group(names[i]) ? kFlatGroup : static_cast<std::uint32_t>(i);
  }
  for (std::uint32_t& group : groups) group = numbers[group];
  if (std::all_of(groups.begin(), groups.end(), [&](auto group) { return group == groups[0]; }))
    return;
  CornerNormals computed = group_normals(mesh, groups);
  mesh.normals = std::move(computed.normals);
  mesh.normal_triangles = std::move(computed.triangles);
}

/// Computes the normals that were requested by add_computed_normal(). All corners with the same
/// normal belong to one vertex of the surface, so in this computation normals take the place of
/// vertices.
void MeshBuilder::compute_normals(Mesh& mesh) const {
  if (computed_normals_.empty()) return;
  std::vector<Vec3> places(mesh.normals.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      places[mesh.normal_triangles[t][k]] = mesh.positions[mesh.triangles[t][k]];
    }
  }
  const std::vector<Vec3> computed_normals =
      vertex_normals(places, mesh.normal_triangles, mesh.polygons);
  for (const std::uint32_t normal : computed_normals_)
    mesh.normals[normal] = computed_normals[normal];
}

/// Converts positions to metres with Y up, if the file gives its axes and unit.
/// \returns Mesh::metres
double MeshBuilder::move_to_world() {
  const WorldFrame world = world_frame(input_.options, {}, 0);
  if (!world.map) return world.metres;
  const auto transformed = [](const AffineMap& m, double x, double y, double z) {
    Position result{};
    for (std::size_t k = 0; k < 3; ++k) result[k] = m[k] * x + m[4 + k] * y + m[8 + k] * z;
    return result;
  };
  AffineMap axis_rotation = *world.map;  // The rotation of the axes, without the scale of the unit
  const double unit =
      std::abs(axis_rotation[0]) + std::abs(axis_rotation[1]) + std::abs(axis_rotation[2]);
  for (double& value : axis_rotation) value /= unit;
  const auto rotated = [&](const Vec3& v) {
    const Position rotated_position = transformed(axis_rotation, v.x, v.y, v.z);
    return Vec3{narrow(rotated_position[0]), narrow(rotated_position[1]),
                narrow(rotated_position[2])};
  };
  for (Position& p : positions) p = transformed(*world.map, p[0], p[1], p[2]);
  for (Vec3& normal : normals) normal = rotated(normal);
  for (Tangent& tangent : tangents) tangent.direction = rotated(tangent.direction);
  return world.metres;
}

Mesh MeshBuilder::finish() {
  if (!describe_face) {
    describe_face = [](std::uint32_t triangle) { return "triangle " + std::to_string(triangle); };
  }
  if (positions.size() > kMaxCount) {
    input_.fail("", "it has more than " + std::to_string(kMaxCount) + " vertices",
                "Split or simplify the mesh.");
  }
  if (triangles_.empty()) {
    const std::string points = std::to_string(positions.size());
    input_.fail("",
                faces_ != 0 ? "none of its " + std::to_string(faces_) + " faces has three corners"
                            : "it has no faces, only " + points + " points",
                "Kiln needs a surface: export triangles, or reconstruct a surface from the points "
                "first.");
  }
  if (short_faces_ != 0) {
    input_.warn("short-faces",
                std::to_string(short_faces_) + " faces have fewer than three corners (face " +
                    std::to_string(first_short_face_) + " for one) and were left out.",
                short_faces_);
  }
  Mesh mesh;
  if (!is_placed) mesh.metres = move_to_world();
  finish_colors();
  split_polygons();
  convert_positions(mesh);
  complete_attributes(mesh);
  mesh.triangles = std::move(triangles_);
  number_polygons(mesh);
  compute_group_normals(mesh);
  compute_normals(mesh);
  copy_tangents(mesh);
  count_degenerate(mesh);
  convert_face_colors(mesh);
  return mesh;
}

}  // namespace kiln
