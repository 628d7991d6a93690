// Parses the statements of Wavefront OBJ, for readers of whole files and of pieces.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asset/mesh_builder.h"
#include "io/file/text_scanner.h"

namespace kiln {

/// Parses statements, resolves their indices, and passes them to the functions that a reader overrides, in the order of
/// the file. Errors name the line.
class ObjParser {
 public:
  explicit ObjParser(const MeshInput& input) : input_(input), scan_({}) {}
  ObjParser(const ObjParser&) = delete;
  ObjParser& operator=(const ObjParser&) = delete;
  virtual ~ObjParser() = default;

  /// Parses whole lines. May be called for consecutive pieces of a file. \throws Error(input)
  void parse(std::string_view lines);
  /// Checks indices that refer to elements after their face, and adds the warnings. \throws Error(input)
  void finish();

 protected:
  using Indices = std::span<const std::uint32_t>;

  /// The colour of the next vertex, whose channels may be fractions or bytes.
  virtual void add_color(const std::array<double, 4>& rgba) = 0;
  virtual void add_vertex(const MeshBuilder::Position& position) = 0;
  virtual void add_uv(const Vec2& uv) = 0;
  virtual void add_normal(const Vec3& normal) = 0;
  /// A polygon with any number of corners. \param uv, normal  empty, or as long as `vertex`, with MeshBuilder::kNone at
  /// corners without one
  virtual void add_face(Indices vertex, Indices uv, Indices normal) = 0;
  /// The colour of an earlier vertex, as ZBrush writes it.
  virtual void set_color_bytes(std::size_t vertex, const std::array<std::uint8_t, 4>& rgba) = 0;
  virtual void set_group(std::string_view name) = 0;
  virtual void set_object(std::string_view name) = 0;
  virtual void set_material(std::string_view name) = 0;
  virtual void set_smoothing(std::string_view name) = 0;
  virtual void add_material_file(std::string_view name) = 0;

  const MeshInput& input() const { return input_; }
  std::uint64_t line() const { return scan_.line(); }
  std::string place() const { return scan_.place(); }
  // Numbers of vertices and of normals that were parsed so far
  std::size_t vertices() const { return vertices_; }
  std::size_t normals() const { return normals_; }

 private:
  /// The largest index into a list of vertices, UVs or normals so far, and where it is in the file.
  /// It can only be checked at the end, since elements of the list may follow the face.
  struct LargestIndex {
    std::uint64_t index = 0, line = 0;
  };

  /// Counts corners whose index of a UV or a normal is 0.
  struct ZeroIndices {
    std::uint64_t count = 0;
    std::string first;
  };

  void parse_statement(std::string_view keyword);
  void parse_material_files(std::string_view names);
  void parse_polypaint(std::string_view digits);
  void finish_polypaint();
  double number(const char* rule);
  void parse_vertex();
  void parse_texture_coordinate();
  std::uint32_t resolve_index(std::string_view text, std::size_t pool, LargestIndex& reach,
                              const char* what);
  bool has_index(std::string_view text, ZeroIndices& zeros) const;
  void warn_of_zeros(const ZeroIndices& zeros, const char* what) const;
  void parse_face();
  void check_forward_references();

  const MeshInput& input_;
  TextScanner scan_;
  std::size_t vertices_ = 0, uvs_ = 0, normals_ = 0;
  std::uint64_t faces_ = 0;
  std::vector<std::uint32_t> vertex_, uv_, normal_;  // Indices at the corners of the current face
  LargestIndex largest_vertex_index_, largest_uv_index_, largest_normal_index_;
  ZeroIndices zero_uvs_, zero_normals_;
  std::vector<std::uint32_t> polypaint_;
  std::uint64_t ignored_ = 0, bad_polypaint_ = 0;
  std::string ignored_example_, bad_polypaint_example_;
};

}  // namespace kiln
