// Builds the meshes of all readers, so that the same rules apply to all formats.
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

/// Converts to single precision. A number beyond its range becomes infinite, whereas the behaviour
/// of a plain conversion would be undefined.
inline float narrow(double value) {
  constexpr double kMaxFloat = std::numeric_limits<float>::max();
  if (std::abs(value) > kMaxFloat) {
    return std::copysign(std::numeric_limits<float>::infinity(),
                         static_cast<float>(value > 0 ? 1 : -1));
  }
  return static_cast<float>(value);
}

/// A normal of a file with unit length, or zero if it cannot be normalized.
Vec3 unit_normal(const Vec3& n);

/// Collects a mesh in double precision, then makes a kiln::Mesh of it.
///
/// Readers append directly to the public lists. They have to check the indices that they pass to
/// add_face(), since only they know the position in the file. kNone stands for a corner without a
/// UV or a normal.
class MeshBuilder {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  using Position = std::array<double, 3>;

  explicit MeshBuilder(const MeshInput& input) : input_(input) {}

  std::vector<Position> positions;
  std::vector<Vec2> uvs;
  std::vector<UvSet> other_uvs;  ///< Further UV sets, with as many UVs as `uvs`
  /// Normals of any length. finish() normalises them; those for which that is impossible become
  /// zero
  std::vector<Vec3> normals;
  /// Empty, or one per position in the same order
  std::vector<std::array<std::uint8_t, 4>> colors;
  std::vector<Tangent> tangents;  ///< Empty, or one per position; of any length
  /// True if the file gives the signs of bitangents; otherwise the UVs determine them
  bool tangent_signs = false;

  /// Sets the colour of a vertex, for formats in which colours may be fractions or bytes. finish()
  /// decides by the largest value in the file. Must be called in ascending order of vertices;
  /// omitted ones are white. kFullAlpha means opaque in both cases.
  void set_color(std::size_t vertex, const std::array<double, 4>& rgba) {
    vertex_colors_.set(vertex, rgba);
  }
  /// Sets the colour of a vertex as bytes. Unlike with set_color(), the meaning does not depend on
  /// the file's other colours.
  void set_color_bytes(std::size_t vertex, const std::array<std::uint8_t, 4>& rgba) {
    vertex_colors_.set_bytes(vertex, rgba);
  }
  static constexpr double kFullAlpha = std::numeric_limits<double>::infinity();
  /// A colour as set_color() reads it: its channels as bytes, and as fractions.
  static std::array<std::array<std::uint8_t, 4>, 2> color_versions(
      const std::array<double, 4>& rgba);
  /// The largest finite channel of a colour; 0 if none is above that.
  static double largest_channel(const std::array<double, 4>& rgba);
  /// True if the largest channel of a file's colours shows that they are fractions.
  static bool are_fractions(double largest);

  /// Sets the colour of the next face only, as a number of either kind or as bytes. finish()
  /// converts colours of faces to colours of vertices: it duplicates vertices between faces of
  /// different colours.
  void set_face_color(const std::array<double, 4>& rgba) { next_color_ = rgba; }
  void set_face_color_bytes(const std::array<std::uint8_t, 4>& rgba) { next_color_bytes_ = rgba; }

  /// Adds a polygon, with its corners in the order of the file. `uv` and `normal` are empty, or as
  /// long as `vertex`. Polygons with fewer than three corners are only counted, and reported in a
  /// warning.
  /// \param mirrored  true if the polygon's transform mirrors. It is triangulated in the order of
  ///   the file, then its triangles are reversed, so that they face outwards
  void add_face(std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> uv = {},
                std::span<const std::uint32_t> normal = {}, bool mirrored = false);

  /// Adds the first faces of a file, which must all be triangles without a colour.
  /// \param has_uvs, has_normals  true: each corner uses the UV or the normal with the same index
  ///   as its vertex
  /// \param fill  writes the triangles. If one is invalid, it returns false, and no triangle is
  ///   added
  /// \returns the result of `fill`; also false if faces were added before
  bool add_triangles(std::uint64_t count, bool has_uvs, bool has_normals,
                     const std::function<bool(std::span<Triangle>)>& fill);

  /// Reserves memory for triangles that will be added. Their number must be known, and checked
  /// against the memory limit. All of them must have normals.
  void reserve_triangles(std::uint64_t count, bool has_uvs);

  /// Sets the group, object or material of the faces that follow. If a function is never called,
  /// the mesh has none of these.
  void set_group(std::string_view name) { groups_.set(name, triangles_.size()); }
  void set_object(std::string_view name) { objects_.set(name, triangles_.size()); }
  void set_material(std::string_view name) { materials_.set(name, triangles_.size()); }
  /// Sets the smoothing group of the faces that follow; "off" and "0" mean none. If a file has
  /// several groups but no normals, finish() computes normals from the groups.
  void set_smoothing(std::string_view name) { smoothing_.set(name, triangles_.size()); }
  /// True if triangles in the smoothing group of this name are flat; so are those without a name.
  static bool is_flat_group(std::string_view name) {
    return name.empty() || name == "off" || name == "0" || name == "default";
  }
  /// Adds a normal that finish() computes: the mean of the normals of polygons whose corners use
  /// it, weighted by the corners' angles. It serves one smooth piece of the surface around a
  /// vertex.
  /// \returns its index in `normals`
  std::uint32_t add_computed_normal() {
    computed_normals_.push_back(static_cast<std::uint32_t>(normals.size()));
    normals.push_back({});
    return computed_normals_.back();
  }
  std::vector<std::string> material_files;
  /// True if positions are in metres with Y up already, as the file says
  bool is_placed = false;

  std::uint64_t faces() const { return faces_; }

  /// Describes the face of a triangle in messages, such as "face 17". Readers of line-based formats
  /// give the line.
  std::function<std::string(std::uint32_t triangle)> describe_face;

  /// Triangulates the polygons, chooses the origin, converts to floats, and validates the mesh.
  /// \throws Error(input) if there is no face, no usable face or no finite vertex, or if the mesh
  ///   exceeds the range of float
  Mesh finish();

 private:
  /// The names that triangles have, of one kind: groups, objects or materials.
  class Names {
   public:
    /// Sets the name of the triangles that follow. \param triangles  number of triangles so far
    void set(std::string_view name, std::size_t triangles);
    /// Extends the list to a number of triangles. New triangles get the current name.
    void extend_to(std::size_t triangles) {
      if (!names_.empty()) name_of_triangle_.resize(triangles, current_name_);
    }
    void reserve(std::size_t triangles) { name_of_triangle_.reserve(triangles); }
    void move_to(std::vector<std::uint32_t>& of, std::vector<std::string>& names) {
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

  /// Colours of vertices or triangles. They are stored both as bytes and as fractions until
  /// finish() decides what they are.
  class Colors {
   public:
    bool empty() const { return bytes_.empty(); }
    void set(std::size_t i, const std::array<double, 4>& rgba);
    void set_bytes(std::size_t i, const std::array<std::uint8_t, 4>& rgba);
    /// Number of colours that were set.
    std::uint64_t count() const { return count_; }
    std::uint64_t memory() const { return 2 * std::uint64_t{bytes_.capacity()} * sizeof bytes_[0]; }
    /// Decides between bytes and fractions. Elements without a colour become white.
    std::vector<std::array<std::uint8_t, 4>> finish(std::size_t size, const MeshInput& input);

   private:
    std::vector<std::array<std::uint8_t, 4>> bytes_, fractions_;
    double largest_ = 0;
    std::uint64_t count_ = 0;
  };

  struct Polygon {
    std::uint32_t first_triangle, corners;
    std::uint64_t offset;  ///< Index of the first corner in the lists polygon_*
    bool mirrored;         ///< True if the triangles of the polygon are reversed
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
  void convert_positions(Mesh& mesh);
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
  // The warning that coordinates are too coarse, with its remedy
  std::string coarse_coordinates_;
  std::uint64_t faces_ = 0, reserved_faces_ = 0, short_faces_ = 0, first_short_face_ = 0;
};

}  // namespace kiln
