// Builder used by every mesh reader, with the rules common to all formats.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "asset/mesh_reader.h"

namespace kiln {

/// Converts to single precision; beyond its range to infinity, where a plain conversion is
/// undefined.
inline float narrow(double value) {
  constexpr double kMaxFloat = std::numeric_limits<float>::max();
  if (std::abs(value) > kMaxFloat) {
    return std::copysign(std::numeric_limits<float>::infinity(),
                         static_cast<float>(value > 0 ? 1 : -1));
  }
  return static_cast<float>(value);
}

/// A file's normal as readers keep it: of unit length, or zero if that is impossible.
Vec3 unit_normal(const Vec3& n);

/// Collects a mesh in double precision and ends in a kiln::Mesh.
///
/// Readers append to the pools directly. They check the indices for add_face() themselves, since
/// only they know the position in the file. `none` stands for a corner without UV or normal.
class MeshBuilder {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  using Position = std::array<double, 3>;

  explicit MeshBuilder(const MeshInput& input) : input_(input) {}

  std::vector<Position> positions;
  std::vector<Vec2> uvs;
  std::vector<UvSet> other_uvs;  ///< Parallel to `uvs`
  std::vector<Vec3> normals;  ///< Any length; normalised by finish(), zero if that is impossible.
  std::vector<std::array<std::uint8_t, 4>> colors;  ///< Empty or one per position, in order.
  std::vector<Tangent> tangents;                    ///< Empty or one per position; any length.
  bool tangent_signs = false;  ///< True if the file has their signs; else they follow from the UVs.

  /// Sets the colour of a vertex in a format that allows fractions and bytes; finish() decides by the largest
  /// value of the file. Vertices in ascending order; omitted ones are white. kFullAlpha: full in either unit.
  void set_color(std::size_t vertex, const std::array<double, 4>& rgba) {
    vertex_colors_.set(vertex, rgba);
  }
  /// Sets the colour in bytes, regardless of other colours.
  void set_color_bytes(std::size_t vertex, const std::array<std::uint8_t, 4>& rgba) {
    vertex_colors_.set_bytes(vertex, rgba);
  }
  static constexpr double kFullAlpha = std::numeric_limits<double>::infinity();

  /// Sets the colour of the next face only, in the same two forms. finish() converts them to colours of
  /// vertices: a vertex between faces of several colours is duplicated.
  void set_face_color(const std::array<double, 4>& rgba) { next_color_ = rgba; }
  void set_face_color_bytes(const std::array<std::uint8_t, 4>& rgba) { next_color_bytes_ = rgba; }

  /// One polygon in the file's order. `uv` and `normal` are empty or as long as `vertex`. Fewer than three corners:
  /// counted, and reported as a warning.
  /// \param mirrored  true if its transform mirrors: it is cut in the file's order, then its triangles are reversed, so
  ///                  that they face outwards
  void add_face(std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> uv = {},
                std::span<const std::uint32_t> normal = {}, bool mirrored = false);

  /// The same for a file's first faces, all of them triangles without a colour.
  /// \param has_uvs, has_normals  each corner uses the UV and the normal with its vertex's index
  /// \param fill  writes the triangles; returns false if one is invalid: none is added then
  /// \returns the result of `fill`; false also if faces were added before
  bool add_triangles(std::uint64_t count, bool has_uvs, bool has_normals,
                     const std::function<bool(std::span<Triangle>)>& fill);

  /// Sets the group, object or material of the following faces. If never called, the mesh has none.
  void set_group(std::string_view name) { groups_.set(name, triangles_.size()); }
  void set_object(std::string_view name) { objects_.set(name, triangles_.size()); }
  void set_material(std::string_view name) { materials_.set(name, triangles_.size()); }
  /// Sets the smoothing group of the following faces; "off" and "0": none. If groups differ and the file has no
  /// normals, finish() computes normals from them.
  void set_smoothing(std::string_view name) { smoothing_.set(name, triangles_.size()); }
  /// Adds a normal that finish() computes from the polygons whose corners use it, angle-weighted: for a smooth piece
  /// of the surface around one vertex. \returns its index into `normals`
  std::uint32_t add_computed_normal() {
    computed_normals_.push_back(static_cast<std::uint32_t>(normals.size()));
    normals.push_back({});
    return computed_normals_.back();
  }
  std::vector<std::string> material_files;
  bool is_placed = false;  ///< True if positions are in metres with Y up, as stated by the file

  std::uint64_t faces() const { return faces_; }

  /// Name of a face in messages, such as "face 17"; readers of line-based formats name the line.
  std::function<std::string(std::uint32_t triangle)> describe_face;

  /// Splits the polygons, chooses the origin, converts to floats, and validates the mesh.
  /// \throws Error(input): no faces, no usable face, no finite vertex, out of float's range
  Mesh finish();

 private:
  /// Names of triangles of one kind (groups, objects or materials).
  class Names {
   public:
    /// Sets the name of the following triangles. \param triangles  number of triangles so far
    void set(std::string_view name, std::size_t triangles);
    /// Extends the list to a number of triangles: new ones get the last name.
    void extend_to(std::size_t triangles) {
      if (!names_.empty()) name_of_triangle_.resize(triangles, current_name_);
    }
    void take(std::vector<std::uint32_t>& of, std::vector<std::string>& names) {
      of = std::move(name_of_triangle_);
      names = std::move(names_);
    }
    std::uint64_t bytes() const {
      return std::uint64_t{name_of_triangle_.capacity()} * sizeof(std::uint32_t);
    }

   private:
    std::vector<std::uint32_t> name_of_triangle_;  // index of the name, per triangle
    std::vector<std::string> names_;
    std::unordered_map<std::string, std::uint32_t> ids_;
    std::uint32_t current_name_ = 0;
  };

  /// Colours of vertices or of triangles, kept both as bytes and as fractions until finish() decides.
  class Colors {
   public:
    bool empty() const { return bytes_.empty(); }
    void set(std::size_t i, const std::array<double, 4>& rgba);
    void set_bytes(std::size_t i, const std::array<std::uint8_t, 4>& rgba);
    /// Number of colours set.
    std::uint64_t count() const { return count_; }
    std::uint64_t memory() const { return 2 * std::uint64_t{bytes_.capacity()} * sizeof bytes_[0]; }
    /// Decides between bytes and fractions, and pads with white.
    std::vector<std::array<std::uint8_t, 4>> finish(std::size_t size, const MeshInput& input);

   private:
    std::vector<std::array<std::uint8_t, 4>> bytes_, fractions_;
    double largest_ = 0;
    std::uint64_t count_ = 0;
  };

  struct Polygon {
    std::uint32_t first_triangle, corners;
    std::uint64_t offset;  ///< Into the polygon_ pools.
    bool mirrored;         ///< Its triangles are reversed
  };

  /// Of finite positions.
  struct Box {
    Position low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    void add(const Position& p) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
    bool contains(const Position& p) const {
      return p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1] &&
             p[2] >= low[2] && p[2] <= high[2];
    }
  };

  double move_to_world();
  void check_growth() const;
  void add_face_color(std::size_t triangles);
  void finish_colors();
  void convert_face_colors(Mesh& mesh);
  void split_polygons();
  void number_polygons(Mesh& mesh) const;
  void check_finite() const;
  bool has_area_in_file(std::size_t triangle) const;
  Box box() const;
  void place(Mesh& mesh);
  void check_steps(const Mesh& mesh);
  void collapse_flat_triangles(const Mesh& mesh, const Box& used);
  void complete_attributes(Mesh& mesh);
  void check_tangents(const Mesh& mesh);
  void copy_tangents(Mesh& mesh);
  void compute_group_normals(Mesh& mesh);
  void compute_normals(Mesh& mesh) const;
  void count_degenerate(const Mesh& mesh);

  const MeshInput& input_;
  Colors vertex_colors_, triangle_colors_;
  std::optional<std::array<double, 4>> next_color_;
  std::optional<std::array<std::uint8_t, 4>> next_color_bytes_;
  std::uint64_t colored_faces_ = 0;
  std::vector<Triangle> triangles_, uv_triangles_, normal_triangles_;
  std::vector<Polygon> polygons_;
  std::vector<std::uint32_t> polygon_vertex_, polygon_uv_, polygon_normal_;
  Names groups_, objects_, materials_, smoothing_;
  std::vector<std::uint32_t> computed_normals_;  // indices of add_computed_normal(), in order
  std::string coarse_coordinates_;  // message on too coarse coordinates, with its remedy
  std::uint64_t faces_ = 0, short_faces_ = 0, first_short_face_ = 0;
};

}  // namespace kiln
