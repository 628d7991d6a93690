// Builds meshes for all readers, by rules that all formats share.
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
#include "mesh/box.h"

namespace kiln {

/// Converts to single precision. Beyond its range the result is infinite, whereas a plain conversion would be
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
  std::vector<UvSet> other_uvs;  ///< Further UV sets, parallel to `uvs`
  /// Normals of any length; finish() normalises them, or sets them to zero if that is impossible
  std::vector<Vec3> normals;
  std::vector<std::array<std::uint8_t, 4>> colors;  ///< Empty, or one per position in order
  std::vector<Tangent> tangents;                    ///< Empty, or one per position, of any length
  /// True if the file states the signs of bitangents; otherwise they follow from the UVs
  bool tangent_signs = false;

  /// Sets the colour of a vertex in a format that allows fractions and bytes; finish() decides by the largest value in
  /// the file. Vertices must be in ascending order; omitted ones are white. kFullAlpha means opaque in either unit.
  void set_color(std::size_t vertex, const std::array<double, 4>& rgba) {
    vertex_colors_.set(vertex, rgba);
  }
  /// Sets the colour of a vertex as bytes; unlike set_color(), its unit does not depend on the file's other colours.
  void set_color_bytes(std::size_t vertex, const std::array<std::uint8_t, 4>& rgba) {
    vertex_colors_.set_bytes(vertex, rgba);
  }
  static constexpr double kFullAlpha = std::numeric_limits<double>::infinity();

  /// Sets the colour of the next face only, in the same two forms. finish() converts such colours to colours of
  /// vertices: a vertex between faces of several colours is duplicated.
  void set_face_color(const std::array<double, 4>& rgba) { next_color_ = rgba; }
  void set_face_color_bytes(const std::array<std::uint8_t, 4>& rgba) { next_color_bytes_ = rgba; }

  /// Adds a polygon with the file's order of corners. `uv` and `normal` are empty or as long as `vertex`. Polygons with
  /// fewer than three corners are counted, and reported as a warning.
  /// \param mirrored  true if its transform mirrors: the polygon is triangulated in the file's order, then its
  /// triangles are reversed, so that they face outwards
  void add_face(std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> uv = {},
                std::span<const std::uint32_t> normal = {}, bool mirrored = false);

  /// Adds the first faces of a file, all of which are triangles without a colour.
  /// \param has_uvs, has_normals  true: each corner uses the UV or the normal with its vertex's index
  /// \param fill  writes the triangles; returns false if one is invalid: then none is added
  /// \returns the result of `fill`; false also if faces were added before
  bool add_triangles(std::uint64_t count, bool has_uvs, bool has_normals,
                     const std::function<bool(std::span<Triangle>)>& fill);

  /// Reserves memory for triangles whose number is known, and checked against the memory limit, before they are added.
  /// All of them have normals.
  void reserve_triangles(std::uint64_t count, bool has_uvs);

  /// Sets the group, object or material of the faces that follow. If it is never called, the mesh has none.
  void set_group(std::string_view name) { groups_.set(name, triangles_.size()); }
  void set_object(std::string_view name) { objects_.set(name, triangles_.size()); }
  void set_material(std::string_view name) { materials_.set(name, triangles_.size()); }
  /// Sets the smoothing group of the faces that follow; "off" and "0": none. If groups differ and the file has no
  /// normals, finish() computes normals from the groups.
  void set_smoothing(std::string_view name) { smoothing_.set(name, triangles_.size()); }
  /// Adds a normal that finish() computes from the polygons whose corners use it, weighted by angles. It serves one
  /// smooth piece of the surface around a vertex.
  /// \returns its index in `normals`
  std::uint32_t add_computed_normal() {
    computed_normals_.push_back(static_cast<std::uint32_t>(normals.size()));
    normals.push_back({});
    return computed_normals_.back();
  }
  std::vector<std::string> material_files;
  /// True if positions are already in metres with Y up, as the file stated
  bool is_placed = false;

  std::uint64_t faces() const { return faces_; }

  /// Names a triangle's face in messages, such as "face 17"; readers of line-based formats name the line.
  std::function<std::string(std::uint32_t triangle)> describe_face;

  /// Triangulates the polygons, chooses the origin, converts to floats, and validates the mesh.
  /// \throws Error(input) if there is no face, no usable face or no finite vertex, or if the mesh exceeds float's range
  Mesh finish();

 private:
  /// Names of triangles of one kind: groups, objects or materials.
  class Names {
   public:
    /// Sets the name of the triangles that follow. \param triangles  number of triangles so far
    void set(std::string_view name, std::size_t triangles);
    /// Extends the list to a number of triangles; new ones get the last name.
    void extend_to(std::size_t triangles) {
      if (!names_.empty()) name_of_triangle_.resize(triangles, current_name_);
    }
    void reserve(std::size_t triangles) { name_of_triangle_.reserve(triangles); }
    void take(std::vector<std::uint32_t>& of, std::vector<std::string>& names) {
      of = std::move(name_of_triangle_);
      names = std::move(names_);
    }
    std::uint64_t bytes() const {
      return std::uint64_t{name_of_triangle_.capacity()} * sizeof(std::uint32_t);
    }

   private:
    std::vector<std::uint32_t> name_of_triangle_;  // For each triangle, the index of its name
    std::vector<std::string> names_;
    std::unordered_map<std::string, std::uint32_t> ids_;
    std::uint32_t current_name_ = 0;
  };

  /// Colours of vertices or triangles, stored both as bytes and as fractions until finish() decides.
  class Colors {
   public:
    bool empty() const { return bytes_.empty(); }
    void set(std::size_t i, const std::array<double, 4>& rgba);
    void set_bytes(std::size_t i, const std::array<std::uint8_t, 4>& rgba);
    /// Number of colours that were set.
    std::uint64_t count() const { return count_; }
    std::uint64_t memory() const { return 2 * std::uint64_t{bytes_.capacity()} * sizeof bytes_[0]; }
    /// Decides between bytes and fractions; elements without a colour become white.
    std::vector<std::array<std::uint8_t, 4>> finish(std::size_t size, const MeshInput& input);

   private:
    std::vector<std::array<std::uint8_t, 4>> bytes_, fractions_;
    double largest_ = 0;
    std::uint64_t count_ = 0;
  };

  struct Polygon {
    std::uint32_t first_triangle, corners;
    std::uint64_t offset;  ///< Position of the first corner in the polygon_ pools
    bool mirrored;         ///< True if the polygon's triangles are reversed
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
  Box<Vec3d> box() const;
  void place(Mesh& mesh);
  void check_steps(const Mesh& mesh);
  void collapse_flat_triangles(const Mesh& mesh, const Box<Vec3d>& used);
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
  // Indices of the normals from add_computed_normal(), ascending
  std::vector<std::uint32_t> computed_normals_;
  // the message about coordinates that are too coarse, with its remedy
  std::string coarse_coordinates_;
  std::uint64_t faces_ = 0, reserved_faces_ = 0, short_faces_ = 0, first_short_face_ = 0;
};

}  // namespace kiln
