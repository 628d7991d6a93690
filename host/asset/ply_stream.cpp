#include "asset/ply_stream.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

#include "asset/file_identity.h"
#include "asset/mesh_builder.h"
#include "asset/mesh_ply.h"
#include "io/file/byte_source.h"

namespace kiln {
namespace {

using namespace ply;

// Maximum length of a header; no large scan has a longer one
constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 18;
constexpr std::size_t kTriangleFaceBytes = 13;  // Size of a triangle: a count and three indices
constexpr std::size_t kStreamedAtOnce = std::size_t{1} << 20;

/// Where the values of vertices and faces lie in the file.
struct StreamLayout {
  std::uint64_t vertices = 0, triangles = 0;
  std::size_t vertex_bytes = 0;
  std::uint64_t first_vertex = 0, first_face = 0;
  std::array<std::size_t, 3> position{}, normal{};
  std::array<std::optional<std::size_t>, 4> color{};
  bool has_normals = false, has_uvs = false, has_colors = false;
};

FailWith stream_failure(const MeshInput& input) {
  return [&input](const std::string& place, const std::string& problem, const Message& remedy) {
    input.fail(place, problem, remedy);
  };
}

/// Finds the layout. If the file cannot be read in pieces, returns the reason; otherwise an empty
/// text.
std::string find_stream_layout(const Header& header, StreamLayout& layout) {
  if (header.encoding != Encoding::little_endian || std::endian::native != std::endian::little) {
    return "is not a binary, little-endian PLY";
  }
  const auto& all = header.elements;
  if (all.size() < 2 || all[0].name != "vertex" || all[1].name != "face") {
    return "does not hold vertices, then faces";
  }
  constexpr std::uint64_t kMaxElementCount = 0x7FFFFFFF;
  if (all[0].count == 0 || all[1].count == 0) return "is empty";
  if (all[0].count > kMaxElementCount || all[1].count > kMaxElementCount)
    return "has more than 2^31 vertices or faces";
  layout.vertices = all[0].count;
  layout.triangles = all[1].count;
  std::size_t found = 0;
  for (const Property& property : all[0].properties) {
    const std::size_t at = layout.vertex_bytes;
    if (property.list) return "has lists at its vertices";
    layout.vertex_bytes += size_of(property.type);
    const auto place = [&](Role first) {
      return static_cast<std::size_t>(property.role) - static_cast<std::size_t>(first);
    };
    switch (property.role) {
      case Role::x:
      case Role::y:
      case Role::z:
        if (property.type != Type::float32) return "has coordinates that are not 32-bit floats";
        layout.position[place(Role::x)] = at;
        ++found;
        break;
      case Role::nx:
      case Role::ny:
      case Role::nz:
        if (property.type != Type::float32) return "has normals that are not 32-bit floats";
        layout.normal[place(Role::nx)] = at;
        layout.has_normals = true;
        break;
      case Role::red:
      case Role::green:
      case Role::blue:
      case Role::alpha:
        if (property.type != Type::uint8) return "has colours that are not 8-bit";
        layout.color[place(Role::red)] = at;
        layout.has_colors = true;
        break;
      case Role::u:
      case Role::v:
        layout.has_uvs = true;
        break;
      default:
        break;
    }
  }
  if (found != 3) return "has vertices without coordinates";
  const std::vector<Property>& face = all[1].properties;
  const bool has_only_index_lists = face.size() == 1 && face[0].list &&
                                    face[0].role == Role::indices &&
                                    size_of(face[0].count_type) == 1 &&
                                    (face[0].type == Type::int32 || face[0].type == Type::uint32);
  if (!has_only_index_lists) return "has faces with more than a list of indices";
  layout.first_vertex = header.body;
  layout.first_face = layout.first_vertex + layout.vertices * layout.vertex_bytes;
  return {};
}

class PlyStream : public MeshStream {
 public:
  explicit PlyStream(const std::filesystem::path& path)
      : input_{path.string(), {}, nullptr, {}, path.parent_path()},
        path_(path.string()),
        name_(path.stem().string()),
        source_(open_file(path, stream_failure(input_))) {
    const std::string head = source_->head(kMaxHeaderBytes);
    const MeshInput start{path_, head};
    const std::string reason = find_stream_layout(parse_header(start), layout_);
    if (!reason.empty()) {
      throw Error(ErrorCode::internal, "'" + path_ + "' " + reason + ": it cannot be streamed.");
    }
    if (layout_.first_face + layout_.triangles * kTriangleFaceBytes > source_->size()) {
      input_.fail("header", "it declares more elements than the file can hold (truncated)",
                  "Copy or export it again.");
    }
    identity_ = file_identity(path, source_->size());
  }

  std::uint32_t vertex_count() const override {
    return static_cast<std::uint32_t>(layout_.vertices);
  }
  std::uint32_t triangle_count() const override {
    return static_cast<std::uint32_t>(layout_.triangles);
  }
  bool has_normals() const override { return layout_.has_normals; }
  bool has_colors() const override { return layout_.has_colors; }
  const std::string& name() const override { return name_; }
  const std::string& path() const override { return path_; }
  std::string identity() const override { return identity_; }

  void read_positions(std::size_t first, std::span<Vec3> to) const override {
    for_each_vertex(first, to.size(), [&](std::size_t i, const char* at) {
      to[i] = vector_at(at, layout_.position);
    });
  }

  void read_normals(std::size_t first, std::span<Vec3> to) const override {
    for_each_vertex(first, to.size(), [&](std::size_t i, const char* at) {
      to[i] = unit_normal(vector_at(at, layout_.normal));
    });
  }

  void read_colors(std::size_t first, std::span<Color> to) const override {
    for_each_vertex(first, to.size(), [&](std::size_t i, const char* at) {
      to[i] = {0, 0, 0, 255};
      for (std::size_t c = 0; c < 4; ++c) {
        if (layout_.color[c]) to[i][c] = static_cast<std::uint8_t>(at[*layout_.color[c]]);
      }
    });
  }

  void read_triangles(std::size_t first, std::span<Triangle> to) const override {
    for_each_element(
        layout_.first_face, kTriangleFaceBytes, first, to.size(),
        [&](std::size_t i, const char* at) {
          if (*at != 3) {
            input_.fail("face " + std::to_string(first + i),
                        "it has " + std::to_string(static_cast<unsigned char>(*at)) + " corners",
                        "A high poly that is larger than memory must consist of triangles "
                        "only: triangulate it.");
          }
          std::memcpy(to[i].data(), at + 1, sizeof to[i]);
          for (const std::uint32_t v : to[i]) {
            if (v < layout_.vertices) continue;
            input_.fail("face " + std::to_string(first + i),
                        "it refers to vertex " + std::to_string(v) + ", but the file has " +
                            std::to_string(layout_.vertices),
                        "Export the mesh again.");
          }
        });
  }

 private:
  static Vec3 vector_at(const char* at, const std::array<std::size_t, 3>& offsets) {
    Vec3 result;
    std::memcpy(&result.x, at + offsets[0], sizeof result.x);
    std::memcpy(&result.y, at + offsets[1], sizeof result.y);
    std::memcpy(&result.z, at + offsets[2], sizeof result.z);
    return result;
  }

  template <typename Take>
  void for_each_vertex(std::size_t first, std::size_t count, const Take& take) const {
    for_each_element(layout_.first_vertex, layout_.vertex_bytes, first, count, take);
  }

  /// Calls take(i, bytes) for elements `first` to `first` + `count` - 1, which are read in pieces.
  template <typename Take>
  void for_each_element(std::uint64_t start, std::size_t bytes, std::size_t first,
                        std::size_t count, const Take& take) const {
    const std::size_t max_elements = std::max<std::size_t>(1, kStreamedAtOnce / bytes);
    std::vector<char> piece(std::min(count, max_elements) * bytes);
    for (std::size_t done = 0; done < count; done += max_elements) {
      const std::size_t element_count = std::min(max_elements, count - done);
      const std::size_t read_bytes =
          source_->read_at(start + (first + done) * bytes, piece.data(), element_count * bytes);
      if (read_bytes != element_count * bytes || source_->was_written()) {
        input_.fail("", "it changed while it was read", "Wait until it is written, and try again.");
      }
      for (std::size_t i = 0; i < element_count; ++i) take(done + i, &piece[i * bytes]);
    }
  }

  MeshInput input_;
  std::string path_, name_, identity_;
  std::unique_ptr<ByteSource> source_;
  StreamLayout layout_;
};

}  // namespace

PlyLayout ply_layout(const std::filesystem::path& path) {
  const MeshInput input{path.string(), {}};
  const std::unique_ptr<ByteSource> source = open_file(path, stream_failure(input));
  const std::string head = source->head(kMaxHeaderBytes);
  PlyLayout result;
  if (!head.starts_with("ply")) {
    result.obstacle = "is no PLY";
    return result;
  }
  const MeshInput start{path.string(), head};
  StreamLayout layout;
  const Header header = parse_header(start);
  result.obstacle = find_stream_layout(header, layout);
  result.triangles = layout.triangles;
  result.has_uvs = layout.has_uvs;
  result.has_normals = layout.has_normals;
  result.has_pictures = layout.has_uvs && !header.texture_files.empty();
  return result;
}

std::shared_ptr<const MeshStream> stream_ply(const std::filesystem::path& path) {
  return std::make_shared<PlyStream>(path);
}

}  // namespace kiln
