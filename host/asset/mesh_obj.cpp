// Reads Wavefront OBJ. Kiln has its own reader because a half-edge mesh would drop faces at non-manifold edges, and
// because errors must name the line.
#include <algorithm>
#include <string>
#include <vector>

#include "asset/mesh_builder.h"
#include "asset/obj_parser.h"

namespace kiln {
namespace {

class ObjReader : public ObjParser {
 public:
  explicit ObjReader(const MeshInput& input) : ObjParser(input), builder_(input) {}

  Mesh read() {
    parse(input().bytes);
    finish();
    builder_.describe_face = [this](std::uint32_t triangle) {
      const auto next_line = std::upper_bound(
          face_lines_.begin(), face_lines_.end(), triangle,
          [](std::uint32_t value, const FaceLine& entry) { return value < entry.triangle; });
      return next_line == face_lines_.begin() ? std::string()
                                              : "line " + std::to_string(next_line[-1].line);
    };
    return builder_.finish();
  }

 private:
  struct FaceLine {
    std::uint32_t triangle;
    std::uint64_t line;
  };

  void add_color(const std::array<double, 4>& rgba) override {
    builder_.set_color(vertices(), rgba);
  }
  void add_vertex(const MeshBuilder::Position& position) override {
    builder_.positions.push_back(position);
  }
  void add_uv(const Vec2& uv) override { builder_.uvs.push_back(uv); }
  void add_normal(const Vec3& normal) override { builder_.normals.push_back(normal); }
  void add_face(Indices vertex, Indices uv, Indices normal) override {
    if (vertex.size() >= 3) {
      face_lines_.push_back({triangles_, line()});
      triangles_ += static_cast<std::uint32_t>(vertex.size() - 2);
    }
    builder_.add_face(vertex, uv, normal);
  }
  void set_color_bytes(std::size_t vertex, const std::array<std::uint8_t, 4>& rgba) override {
    builder_.set_color_bytes(vertex, rgba);
  }
  void set_group(std::string_view name) override { builder_.set_group(name); }
  void set_object(std::string_view name) override { builder_.set_object(name); }
  void set_material(std::string_view name) override { builder_.set_material(name); }
  void set_smoothing(std::string_view name) override { builder_.set_smoothing(name); }
  void add_material_file(std::string_view name) override {
    builder_.material_files.emplace_back(name);
  }

  MeshBuilder builder_;
  std::vector<FaceLine> face_lines_;
  std::uint32_t triangles_ = 0;
};

}  // namespace

Mesh read_obj(const MeshInput& input) { return ObjReader(input).read(); }

}  // namespace kiln
