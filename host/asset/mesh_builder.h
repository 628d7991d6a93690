// Builder that every mesh reader feeds, and the rules that all formats share.
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

/// To single precision; beyond its range to infinity, where a plain conversion is undefined.
inline float narrow(double value) {
  constexpr double kMost = std::numeric_limits<float>::max();
  if (std::abs(value) > kMost) {
    return std::copysign(std::numeric_limits<float>::infinity(),
                         static_cast<float>(value > 0 ? 1 : -1));
  }
  return static_cast<float>(value);
}

/// Collects a mesh in double precision and ends in a kiln::Mesh.
///
/// Readers append to the pools directly. They check the indices for add_face() themselves, since
/// only they know the place in the file. `none` stands for a corner without UV or normal.
class MeshBuilder {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  using Position = std::array<double, 3>;

  explicit MeshBuilder(const MeshInput& input) : input_(input) {}

  std::vector<Position> positions;
  std::vector<Vec2> uvs;
  std::vector<UvSet> other_uvs;  ///< As many each as `uvs`
  std::vector<Vec3> normals;  ///< Any length; made unit by finish(), zero where that is impossible.
  std::vector<std::array<std::uint8_t, 4>> colors;  ///< Empty or one per position, in order.
  std::vector<Tangent> tangents;                    ///< Empty or one per position; any length.
  bool tangent_signs = false;  ///< True if the file gives their signs; else the UVs say them.

  /// The colour of a vertex in a format that has fractions as well as bytes: finish() tells which they are by
  /// the largest of the file. Vertices in increasing order; those left out are white. kFull: full either way.
  void set_color(std::size_t vertex, const std::array<double, 4>& rgba) {
    vertex_colors_.set(vertex, rgba);
  }
  /// The same in bytes, whatever the other colours are.
  void set_color_bytes(std::size_t vertex, const std::array<std::uint8_t, 4>& rgba) {
    vertex_colors_.set_bytes(vertex, rgba);
  }
  static constexpr double kFull = std::numeric_limits<double>::infinity();

  /// The colour of the next face alone, in the same two ways. finish() turns them into colours of vertices: one
  /// between faces of several colours is split, a vertex a colour.
  void set_face_color(const std::array<double, 4>& rgba) { next_color_ = rgba; }
  void set_face_color_bytes(const std::array<std::uint8_t, 4>& rgba) { next_color_bytes_ = rgba; }

  /// One polygon in the file's order. `uv` and `normal` are empty (no corner has any) or as long as
  /// `vertex`. Fewer than three corners: counted, and reported as a warning.
  /// \param mirrored  true where the places of its corners are mirrored: it is cut as the file has it, and its triangles
  ///                  are turned round then, so that they face outwards
  void add_face(std::span<const std::uint32_t> vertex, std::span<const std::uint32_t> uv = {},
                std::span<const std::uint32_t> normal = {}, bool mirrored = false);

  /// The same for a file's first faces, all of them triangles without a colour.
  /// \param has_uvs, has_normals  their corners have UVs and normals of the vertices' numbers
  /// \param fill  writes them, and returns false where they are not as it thought: then there are none
  /// \returns what `fill` does; false, too, where faces came before
  bool add_triangles(std::uint64_t count, bool has_uvs, bool has_normals,
                     const std::function<bool(std::span<Triangle>)>& fill);

  /// The group, object or material that the faces to come belong to. Never called: the mesh has none.
  void set_group(std::string_view name) { groups_.set(name, triangles_.size()); }
  void set_object(std::string_view name) { objects_.set(name, triangles_.size()); }
  void set_material(std::string_view name) { materials_.set(name, triangles_.size()); }
  /// The smoothing group of the faces to come; "off" and "0": none. Where they differ and the file has no normals,
  /// finish() makes normals by them.
  void set_smoothing(std::string_view name) { smoothing_.set(name, triangles_.size()); }
  /// A normal that finish() makes of the polygons whose corners have it, angle-weighted: a smooth piece of the surface
  /// around one vertex. \returns its index into `normals`
  std::uint32_t add_computed_normal() {
    computed_normals_.push_back(static_cast<std::uint32_t>(normals.size()));
    normals.push_back({});
    return computed_normals_.back();
  }
  std::vector<std::string> material_files;
  bool is_placed = false;  ///< True if positions are in metres with Y up by what the file says

  std::uint64_t faces() const { return faces_; }

  /// Words for a face in messages, such as "face 17": readers of line-based formats name the line.
  std::function<std::string(std::uint32_t triangle)> describe_face;

  /// Splits the polygons, chooses the origin, narrows to float, and checks the whole.
  /// \throws Error(input): no faces, no usable face, no finite vertex, out of float's range
  Mesh finish();

 private:
  /// Names of triangles of one kind.
  class Names {
   public:
    /// Sets the name of the triangles to come. \param triangles  number of those that came before
    void set(std::string_view name, std::size_t triangles);
    /// So many triangles have names, all but the first of them the last one set.
    void reach(std::size_t triangles) {
      if (!names_.empty()) of_.resize(triangles, now_);
    }
    void take(std::vector<std::uint32_t>& of, std::vector<std::string>& names) {
      of = std::move(of_);
      names = std::move(names_);
    }
    std::uint64_t bytes() const { return std::uint64_t{of_.capacity()} * sizeof(std::uint32_t); }

   private:
    std::vector<std::uint32_t> of_;  // triangles
    std::vector<std::string> names_;
    std::unordered_map<std::string, std::uint32_t> ids_;
    std::uint32_t now_ = 0;
  };

  /// Colours of vertices or of triangles, as bytes and as fractions until finish() has decided which they are.
  class Colors {
   public:
    bool empty() const { return bytes_.empty(); }
    void set(std::size_t i, const std::array<double, 4>& rgba);
    void set_bytes(std::size_t i, const std::array<std::uint8_t, 4>& rgba);
    /// Colours that were set.
    std::uint64_t count() const { return count_; }
    std::uint64_t memory() const { return 2 * std::uint64_t{bytes_.capacity()} * sizeof bytes_[0]; }
    /// Decides, and fills up with white.
    std::vector<std::array<std::uint8_t, 4>> finish(std::size_t size, const MeshInput& input);

   private:
    std::vector<std::array<std::uint8_t, 4>> bytes_, fractions_;
    double largest_ = 0;
    std::uint64_t count_ = 0;
  };

  struct Polygon {
    std::uint32_t first_triangle, corners;
    std::uint64_t offset;  ///< Into the polygon_ pools.
    bool mirrored;         ///< Its triangles are turned round
  };

  /// Around finite places.
  struct Box {
    Position low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    void add(const Position& p) {
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
    bool holds(const Position& p) const {
      return p[0] >= low[0] && p[0] <= high[0] && p[1] >= low[1] && p[1] <= high[1] &&
             p[2] >= low[2] && p[2] <= high[2];
    }
  };

  double move_to_world();
  void check_growth() const;
  void add_face_color(std::size_t triangles);
  void finish_colors();
  void give_face_colors(Mesh& mesh);
  void split_polygons();
  void number_polygons(Mesh& mesh) const;
  void check_finite() const;
  bool has_area_in_file(std::size_t triangle) const;
  Box box() const;
  void place(Mesh& mesh);
  void check_steps(const Mesh& mesh);
  void keep_flat(const Mesh& mesh, const Box& used);
  void complete_attributes(Mesh& mesh);
  void check_tangents(const Mesh& mesh);
  void give_tangents(Mesh& mesh);
  void give_normals_by_groups(Mesh& mesh);
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
  std::string coarse_;                           // why coordinates are too coarse, and the remedy
  std::uint64_t faces_ = 0, short_faces_ = 0, first_short_face_ = 0;
};

}  // namespace kiln
