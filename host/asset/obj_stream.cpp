#include "asset/obj_stream.h"

#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "asset/obj_parser.h"
#include "asset/parsed_mesh.h"
#include "io/file/byte_source.h"
#include "io/file/unicode.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

// Bytes of a vertex with its part of the faces, UVs and normals. Few files have less
constexpr std::uint64_t kMinObjBytesPerVertex = 75;

FailWith obj_failure(const MeshInput& input) {
  return [&input](const std::string& place, const std::string& problem, const Message& remedy) {
    input.fail(place, problem, remedy);
  };
}

/// Passes statements to the lists.
class ObjListReader : public ParsedMeshReader, private ObjParser {
 public:
  ObjListReader(const MeshInput& input, const ParsingRules& rules, std::uint64_t bytes,
                CacheFileWriter& file)
      : ObjParser(input),
        lists_(
            input, [this] { return place(); }, rules, bytes / kMinObjBytesPerVertex, file) {}

  void parse_lines(std::string_view lines) override { parse(lines); }
  ParsedSummary finish_lists(std::vector<std::uint64_t>& offsets) override {
    finish();
    if (has_material_files_ && has_uvs_) lists_.set_has_pictures();
    return lists_.finish(offsets);
  }
  /// Lines that a backslash joins are one.
  std::size_t end_of_lines(std::string_view piece) const override {
    for (std::size_t end = piece.rfind('\n'); end != piece.npos && end != 0;
         end = piece.rfind('\n', end - 1)) {
      const char before = piece[end - 1] == '\r' && end > 1 ? piece[end - 2] : piece[end - 1];
      if (before != '\\') return end + 1;
    }
    return 0;
  }

 private:
  void add_color(const std::array<double, 4>& rgba) override { lists_.add_color(rgba); }
  void set_color_bytes(std::size_t /*vertex*/,
                       const std::array<std::uint8_t, 4>& /*rgba*/) override {
    lists_.refuse(place(), "it has colours in #MRGB lines, after their vertices");
  }
  void add_vertex(const MeshBuilder::Position& position) override { lists_.add_vertex(position); }
  void add_uv(const Vec2& /*uv*/) override { has_uvs_ = true; }
  void add_normal(const Vec3& normal) override { lists_.add_normal(normal); }
  void add_face(Indices vertex, Indices /*uv*/, Indices normal) override {
    lists_.add_face(vertex, normal);
  }
  void set_group(std::string_view name) override { lists_.set_group(name); }
  void set_object(std::string_view name) override { lists_.set_group(name); }
  void set_material(std::string_view /*name*/) override {}
  void add_material_file(std::string_view /*name*/) override { has_material_files_ = true; }
  void set_smoothing(std::string_view name) override { lists_.set_smoothing(name); }

  ParsedMeshWriter lists_;
  bool has_uvs_ = false, has_material_files_ = false;
};

/// Faces in some lines of a file.
struct FaceSample {
  std::uint64_t triangles = 0;
  bool has_normals = false, has_uvs = false;

  void add_lines(std::string_view text) {
    TextScanner scan(text, '#', true);
    do {
      if (scan.token_in_line() != "f") continue;
      std::uint64_t corners = 0;
      for (std::string_view corner = scan.token_in_line(); !corner.empty();
           corner = scan.token_in_line()) {
        ++corners;
        const std::size_t uv = corner.find('/');
        if (uv == corner.npos) continue;
        const std::size_t normal = corner.find('/', uv + 1);
        has_normals = has_normals || normal != corner.npos;
        has_uvs = has_uvs || (uv + 1 < corner.size() && corner[uv + 1] != '/');
      }
      triangles += corners > 2 ? corners - 2 : 0;
    } while (scan.next_line());
  }
};

}  // namespace

ObjLayout obj_layout(const fs::path& path) {
  const MeshInput input{path.string(), {}};
  const std::unique_ptr<ByteSource> source = open_file(path, obj_failure(input));
  constexpr std::size_t kHeadBytes = std::size_t{1} << 16;
  ObjLayout layout;
  const std::string head = source->head(kHeadBytes);
  std::string converted;
  if (as_utf8(head, converted) != head) layout.obstacle = "is an OBJ that is not in UTF-8";
  FaceSample sample;
  const double share = sample_text(*source, [&](std::string_view text) { sample.add_lines(text); });
  layout.triangles = static_cast<std::uint64_t>(static_cast<double>(sample.triangles) * share);
  layout.has_normals = sample.has_normals;
  layout.has_pictures = sample.has_uvs && head.find("mtllib") != head.npos;
  return layout;
}

std::shared_ptr<const MeshStream> stream_obj(const fs::path& path, const fs::path& folder,
                                             const ParsingRules& rules) {
  return stream_parsed(path, folder, "obj", rules,
                       [&](const MeshInput& input, std::uint64_t bytes, CacheFileWriter& file) {
                         return std::make_unique<ObjListReader>(input, rules, bytes, file);
                       });
}

}  // namespace kiln
