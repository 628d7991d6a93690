// The only source file of mesh input that uses OpenMesh.
#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <locale>
#include <mutex>
#include <sstream>

#include "asset/mesh_ply.h"

namespace kiln::ply {
namespace {

namespace om = OpenMesh;

/// Receives elements from OpenMesh's readers. Only PLY files accepted by openmesh_reads() occur, so
/// edges, halfedges and status are ignored.
class Importer final : public om::IO::BaseImporter {
 public:
  Importer(MeshBuilder& builder, bool normals, bool uvs)
      : builder_(builder), normals_(normals), uvs_(uvs) {}

  om::VertexHandle add_vertex(const om::Vec3f& p) override { return push({p[0], p[1], p[2]}); }
  om::VertexHandle add_vertex(const om::Vec3d& p) override { return push({p[0], p[1], p[2]}); }
  om::VertexHandle add_vertex() override { return push({}); }
  void set_point(om::VertexHandle v, const om::Vec3f& p) override {
    builder_.positions[index(v)] = {p[0], p[1], p[2]};
  }

  om::FaceHandle add_face(const VHandles& corners) override {
    corners_.clear();
    for (const om::VertexHandle corner : corners) {
      corners_.push_back(static_cast<std::uint32_t>(corner.idx()));
    }
    using Indices = std::span<const std::uint32_t>;
    builder_.add_face(corners_, uvs_ ? Indices(corners_) : Indices(),
                      normals_ ? Indices(corners_) : Indices());
    return om::FaceHandle(static_cast<int>(builder_.faces() - 1));
  }

  void set_normal(om::VertexHandle, const om::Vec3f& n) override {
    builder_.normals.push_back({n[0], n[1], n[2]});
  }
  void set_texcoord(om::VertexHandle, const om::Vec2f& t) override {
    builder_.uvs.push_back({t[0], t[1]});
  }
  void set_color(om::VertexHandle, const om::Vec4uc& c) override {
    builder_.colors.push_back({c[0], c[1], c[2], c[3]});
  }
  void set_color(om::VertexHandle, const om::Vec3uc& c) override {
    builder_.colors.push_back({c[0], c[1], c[2], 255});
  }

  std::size_t n_vertices() const override { return builder_.positions.size(); }
  std::size_t n_faces() const override { return builder_.faces(); }
  std::size_t n_edges() const override { return 0; }
  void reserve(unsigned vertices, unsigned, unsigned) override {
    builder_.positions.reserve(vertices);
  }

  // Never called.
  om::HalfedgeHandle add_edge(om::VertexHandle, om::VertexHandle) override {
    return om::HalfedgeHandle();
  }
  om::FaceHandle add_face(om::HalfedgeHandle) override { return om::FaceHandle(); }
  void add_face_texcoords(om::FaceHandle, om::VertexHandle,
                          const std::vector<om::Vec2f>&) override {}
  void add_face_texcoords(om::FaceHandle, om::VertexHandle,
                          const std::vector<om::Vec3f>&) override {}
  void set_face_texindex(om::FaceHandle, int) override {}
  void set_halfedge(om::VertexHandle, om::HalfedgeHandle) override {}
  void set_normal(om::VertexHandle, const om::Vec3d&) override {}
  void set_color(om::VertexHandle, const om::Vec3f&) override {}
  void set_color(om::VertexHandle, const om::Vec4f&) override {}
  void set_status(om::VertexHandle, const om::Attributes::StatusInfo&) override {}
  void set_next(om::HalfedgeHandle, om::HalfedgeHandle) override {}
  void set_face(om::HalfedgeHandle, om::FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec2f&) override {}
  void set_texcoord(om::VertexHandle, const om::Vec3f&) override {}
  void set_texcoord(om::HalfedgeHandle, const om::Vec3f&) override {}
  void set_status(om::HalfedgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_color(om::EdgeHandle, const om::Vec3uc&) override {}
  void set_color(om::EdgeHandle, const om::Vec4uc&) override {}
  void set_color(om::EdgeHandle, const om::Vec3f&) override {}
  void set_color(om::EdgeHandle, const om::Vec4f&) override {}
  void set_status(om::EdgeHandle, const om::Attributes::StatusInfo&) override {}
  void set_normal(om::FaceHandle, const om::Vec3f&) override {}
  void set_normal(om::FaceHandle, const om::Vec3d&) override {}
  void set_color(om::FaceHandle, const om::Vec3uc&) override {}
  void set_color(om::FaceHandle, const om::Vec4uc&) override {}
  void set_color(om::FaceHandle, const om::Vec3f&) override {}
  void set_color(om::FaceHandle, const om::Vec4f&) override {}
  void set_status(om::FaceHandle, const om::Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}

 private:
  static std::size_t index(om::VertexHandle v) { return static_cast<std::size_t>(v.idx()); }
  om::VertexHandle push(MeshBuilder::Position p) {
    builder_.positions.push_back(p);
    return om::VertexHandle(static_cast<int>(builder_.positions.size() - 1));
  }

  MeshBuilder& builder_;
  bool normals_, uvs_;
  std::vector<std::uint32_t> corners_;
};

/// Silences OpenMesh's output streams; only Kiln's own message may reach the terminal.
class Quiet {
 public:
  Quiet() {
    for (std::size_t i = 0; i < streams_.size(); ++i) {
      enabled_[i] = streams_[i]->is_enabled();
      streams_[i]->disable();
    }
  }
  ~Quiet() {
    for (std::size_t i = 0; i < streams_.size(); ++i) {
      if (enabled_[i]) streams_[i]->enable();
    }
  }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  std::array<om::mostream*, 3> streams_{&::omout(), &::omlog(), &::omerr()};
  std::array<bool, 3> enabled_{};
};

/// Header for OpenMesh: required lines only, with names that it knows.
std::string plain_header(const Header& header) {
  std::string text = header.encoding == Encoding::big_endian
                         ? "ply\nformat binary_big_endian 1.0\n"
                         : "ply\nformat binary_little_endian 1.0\n";
  const auto name = [](Type type) {
    static constexpr const char* kNames[] = {"char", "uchar", "short", "ushort",
                                             "int",  "uint",  "float", "double"};
    return std::string(kNames[static_cast<int>(type)]);
  };
  for (const Element& element : header.elements) {
    text += "element " + element.name + " " + std::to_string(element.count) + "\n";
    for (const Property& property : element.properties) {
      text += "property " + (property.list ? "list " + name(property.count_type) + " " : "") +
              name(property.type) + " " + (property.list ? "vertex_indices" : property.name) + "\n";
    }
  }
  return text + "end_header\n";
}

}  // namespace

void read_with_openmesh(const MeshInput& input, const Header& header, MeshBuilder& builder) {
  om::IO::Options options;
  bool normals = false, uvs = false;
  for (const Property& property : header.elements[0].properties) {
    if (property.role == Role::nx) normals = true;
    if (property.role == Role::u) uvs = true;
    if (property.role == Role::red) options += om::IO::Options::VertexColor;
  }
  if (normals) options += om::IO::Options::VertexNormal;
  if (uvs) options += om::IO::Options::VertexTexCoord;
  options += om::IO::Options::Binary;

  std::string content = plain_header(header);
  content.append(input.bytes.substr(header.body));
  std::istringstream stream(std::move(content), std::ios::in | std::ios::binary);
  // In locales with decimal commas OpenMesh would wait forever for the 1.0 of the header.
  stream.imbue(std::locale::classic());
  Importer importer(builder, normals, uvs);
  static std::mutex one_at_a_time;
  const std::lock_guard lock(one_at_a_time);
  const Quiet quiet;
  const bool done = om::IO::IOManager().read(stream, "ply", importer, options);
  const std::uint64_t vertices = header.elements[0].count, faces = header.elements[1].count;
  const auto complete = [vertices](std::size_t count, bool wanted) {
    return count == (wanted ? vertices : 0);
  };
  if (!done || builder.positions.size() != vertices || builder.faces() != faces ||
      !complete(builder.normals.size(), normals) || !complete(builder.uvs.size(), uvs)) {
    input.fail("",
               "OpenMesh read " + std::to_string(builder.positions.size()) + " of " +
                   std::to_string(vertices) + " vertices and " + std::to_string(builder.faces()) +
                   " of " + std::to_string(faces) + " faces",
               "Convert the file to ASCII PLY, and report this as a defect of Kiln.");
  }
}

}  // namespace kiln::ply
