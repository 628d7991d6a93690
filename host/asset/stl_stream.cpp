#include "asset/stl_stream.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "asset/file_identity.h"
#include "asset/mesh_reader.h"
#include "asset/parsed_mesh.h"
#include "asset/stl_text.h"
#include "asset/stl_triangles.h"
#include "base/file.h"
#include "base/fnv.h"
#include "base/formatted.h"
#include "base/memory.h"
#include "base/parallel.h"
#include "base/progress_guard.h"
#include "io/file/bounds.h"
#include "io/file/byte_source.h"
#include "io/file/cache_file.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kStlTrianglesPerPiece = std::size_t{1} << 18;
/// First bytes that tell whether a file is a text
constexpr std::size_t kTextHeadBytes = 1024;
/// Bytes of the two facets of a text that come with a vertex
constexpr std::uint64_t kTextBytesPerVertex = 512;
constexpr char kJoinedMagic[8] = {'k', 'i', 'l', 'n', 'm', 's', 'h', '1'};

/// The position of a corner, with the layout of Vec3
using Corner = std::array<float, 3>;
static_assert(sizeof(Corner) == sizeof(Vec3));

/// The last bytes of a file of joined vertices. Before them: the triangles, the vertices' positions, and the key.
struct JoinedTail {
  std::uint64_t triangles = 0, vertices = 0, key_bytes = 0;
  std::uint64_t hash = 0;  ///< Hash of the positions and the key
  char magic[8] = {};
};

std::uint64_t joined_bytes(const JoinedTail& tail) {
  return (tail.triangles + tail.vertices) * 12 + tail.key_bytes + sizeof(JoinedTail);
}

FailWith stl_failure(const MeshInput& input) {
  return [&input](const std::string& place, const std::string& problem, const Message& remedy) {
    input.fail(place, problem, remedy);
  };
}

/// A descriptor that is closed at its end, also where a constructor throws.
struct JoinedFile {
  JoinedFile() = default;
  JoinedFile(const JoinedFile&) = delete;
  JoinedFile& operator=(const JoinedFile&) = delete;
  ~JoinedFile() { close(); }
  void close() {
    if (descriptor >= 0) os::close(std::exchange(descriptor, -1));
  }

  int descriptor = -1;
};

class StlStream : public MeshStream {
 public:
  StlStream(const fs::path& path, const fs::path& folder)
      : input_{path.string(), {}}, name_(path.stem().string()), path_(path.string()) {
    const std::unique_ptr<ByteSource> source = open_file(path, stl_failure(input_));
    identity_ = file_identity(path, source->size());
    const std::string file_name =
        formatted("%016llx", static_cast<unsigned long long>(fnv1a(identity_))) + ".mesh";
    cache_path_ = folder / file_name;
    if (open_joined()) return;
    file_.close();
    join_vertices(*source, folder, file_name);
  }

  std::uint32_t vertex_count() const override { return static_cast<std::uint32_t>(tail_.vertices); }
  std::uint32_t triangle_count() const override {
    return static_cast<std::uint32_t>(tail_.triangles);
  }
  bool has_normals() const override { return false; }
  bool has_colors() const override { return false; }
  void read_positions(std::size_t first, std::span<Vec3> to) const override {
    read((tail_.triangles + first) * sizeof(Vec3), to.data(), to.size_bytes());
  }
  void read_triangles(std::size_t first, std::span<Triangle> to) const override {
    read(first * sizeof(Triangle), to.data(), to.size_bytes());
  }
  void read_normals(std::size_t /*first*/, std::span<Vec3> /*to*/) const override {}
  void read_colors(std::size_t /*first*/, std::span<Color> /*to*/) const override {}
  const std::string& name() const override { return name_; }
  const std::string& path() const override { return path_; }
  std::string identity() const override { return identity_; }

 private:
  /// Opens the file of an earlier run. \returns false if there is none, or if it is damaged
  bool open_joined() {
    std::uint64_t bytes = 0;
    file_.descriptor = open_cache_file(cache_path_, bytes);
    if (file_.descriptor < 0 || bytes < sizeof(JoinedTail) ||
        !read_all(bytes - sizeof(JoinedTail), &tail_, sizeof tail_) ||
        std::memcmp(tail_.magic, kJoinedMagic, sizeof kJoinedMagic) != 0 ||
        tail_.key_bytes != identity_.size() || tail_.triangles > bytes / sizeof(Triangle) ||
        tail_.vertices > bytes / sizeof(Vec3) || joined_bytes(tail_) != bytes) {
      return false;
    }
    std::string key(identity_.size(), '\0');
    if (!read_all(bytes - sizeof(JoinedTail) - key.size(), key.data(), key.size()) ||
        key != identity_ || tail_.hash != hash_of_positions()) {
      return false;
    }
    touch_cache_file(cache_path_);
    return true;
  }

  /// A hash of the key and of 64 of each 16,384 vertices: it finds files that another run of Kiln did not complete.
  std::uint64_t hash_of_positions() const {
    constexpr std::size_t kHashedVertices = 64, kVerticesPerHash = std::size_t{1} << 14;
    std::uint64_t hash = fnv1a(identity_);
    std::vector<Vec3> positions(kHashedVertices);
    for (std::uint64_t v = 0; v < tail_.vertices; v += kVerticesPerHash) {
      const auto count =
          static_cast<std::size_t>(std::min<std::uint64_t>(kHashedVertices, tail_.vertices - v));
      if (!read_all((tail_.triangles + v) * sizeof(Vec3), positions.data(), count * sizeof(Vec3))) {
        return ~hash;
      }
      hash = hash * 0x9E3779B97F4A7C15U ^
             fnv1a({reinterpret_cast<const char*>(positions.data()), count * sizeof(Vec3)});
    }
    return hash;
  }

  void join_vertices(const ByteSource& source, const fs::path& folder,
                     const std::string& file_name) {
    const std::string head = source.head(kStlHeaderBytes);
    const std::uint64_t count = (source.size() - kStlHeaderBytes) / kStlTriangleBytes;
    const std::string_view header = std::string_view(head).substr(0, kStlHeaderBytes - 4);
    if (header.find(kStlColorPrefix) != std::string_view::npos) refuse_colors("header");
    CacheFileWriter writer(folder, file_name);
    const auto expected = static_cast<std::size_t>(count / 2 + count / 32);
    std::vector<Corner> positions;
    CornerWelder<Corner> welder(positions, expected, [&](std::size_t slots, std::size_t vertices) {
      require_memory("Joining its vertices",
                     vertices * sizeof(Corner) + slots * sizeof(std::uint32_t),
                     memory_failure(stl_failure(input_), ""));
    });
    positions.reserve(expected);
    std::vector<char> bytes;
    std::vector<Corner> corners;
    std::vector<Triangle> triangles;
    const std::uint64_t pieces = (count + kStlTrianglesPerPiece - 1) / kStlTrianglesPerPiece;
    for (std::uint64_t piece = 0; piece < pieces; ++piece) {
      ProgressGuard::poll_within_stage("joining the high poly's vertices, piece " +
                                       std::to_string(piece + 1) + " of " + std::to_string(pieces));
      const std::uint64_t first = piece * kStlTrianglesPerPiece;
      const auto now =
          static_cast<std::size_t>(std::min<std::uint64_t>(kStlTrianglesPerPiece, count - first));
      bytes.resize(now * kStlTriangleBytes);
      const std::size_t got =
          source.read_at(kStlHeaderBytes + first * kStlTriangleBytes, bytes.data(), bytes.size());
      if (got != bytes.size() || source.was_written()) {
        input_.fail("", "it changed while it was read", "Wait until it is written, and try again.");
      }
      read_corners(first, bytes, corners);
      triangles.resize(now);
      constexpr std::size_t kPrefetchedCorners = 24;
      for (std::size_t i = 0; i < corners.size(); ++i) {
        if (i + kPrefetchedCorners < corners.size()) {
          welder.prefetch(corners[i + kPrefetchedCorners]);
        }
        triangles[i / 3][i % 3] = welder.add(corners[i]);
      }
      writer.write(triangles.data(), triangles.size() * sizeof(Triangle));
    }
    finish(positions, count, writer);
  }

  /// Reads the corners of some triangles. \throws Error(input) if one has a colour
  void read_corners(std::uint64_t first, const std::vector<char>& bytes,
                    std::vector<Corner>& corners) const {
    const std::size_t count = bytes.size() / kStlTriangleBytes;
    corners.resize(3 * count);
    parallel_for(count, kStreamedElementsPerRead, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const char* at = &bytes[t * kStlTriangleBytes];
        // This bit of a triangle's last byte is set if the triangle has a colour.
        constexpr unsigned kColorBit = 0x80;
        if ((static_cast<unsigned char>(at[kStlTriangleBytes - 1]) & kColorBit) != 0) {
          refuse_colors("triangle " + std::to_string(first + t));
        }
        at += kStlNormalBytes;
        for (std::size_t k = 0; k < 3; ++k) {
          for (float& value : corners[3 * t + k]) {
            value = std::bit_cast<float>(little_endian_word(at));
            at += sizeof(float);
          }
        }
      }
    });
  }

  [[noreturn]] void refuse_colors(const std::string& place) const {
    input_.fail(place, "it has a colour, and colours of an STL larger than memory are not read",
                "Write it as a binary, little-endian PLY of triangles, or without colours.");
  }

  /// Completes the file of joined vertices, and opens it.
  void finish(const std::vector<Corner>& positions, std::uint64_t triangles,
              CacheFileWriter& writer) {
    writer.write(positions.data(), positions.size() * sizeof(Corner));
    tail_ = {triangles, positions.size(), identity_.size(), 0, {}};
    std::memcpy(tail_.magic, kJoinedMagic, sizeof kJoinedMagic);
    file_.descriptor = writer.open_to_read();
    tail_.hash = hash_of_positions();
    writer.write(identity_.data(), identity_.size());
    writer.write(&tail_, sizeof tail_);
    writer.commit();
  }

  bool read_all(std::uint64_t offset, void* to, std::size_t bytes) const {
    return os::read_fully(file_.descriptor, offset, to, bytes) == bytes;
  }
  void read(std::uint64_t offset, void* to, std::size_t bytes) const {
    if (read_all(offset, to, bytes)) return;
    throw Error(ErrorCode::input, "'" + cache_path_.string() +
                                      "', the high poly with joined vertices, cannot be read: "
                                      "remove it, and bake again.");
  }

  MeshInput input_;
  std::string name_, path_, identity_;
  fs::path cache_path_;
  JoinedFile file_;
  JoinedTail tail_;
};

bool is_text(const ByteSource& source) {
  return StlTextParser::is_text(source.head(kTextHeadBytes), source.size());
}

/// Passes the facets of a text to the lists, and joins their corners.
class StlListReader : public ParsedMeshReader, private StlTextParser {
 public:
  StlListReader(const MeshInput& input, const ParsingRules& rules, std::uint64_t bytes,
                CacheFileWriter& file)
      : StlTextParser(input),
        lists_(
            input, [this] { return place(); }, rules, bytes / kTextBytesPerVertex, file),
        welder_(lists_.positions(), bytes / kTextBytesPerVertex,
                [&input](std::size_t slots, std::size_t vertices) {
                  require_memory(
                      "Joining its vertices",
                      vertices * sizeof(MeshBuilder::Position) + slots * sizeof(std::uint32_t),
                      memory_failure(stl_failure(input), ""));
                }) {}

  void parse_lines(std::string_view lines) override { parse(lines); }
  ParsedSummary finish_lists(std::vector<std::uint64_t>& offsets) override {
    finish();
    return lists_.finish(offsets);
  }
  /// Lines may end with CR alone. A CR at the end of the piece may be the first half of CR LF, which is not cut.
  std::size_t end_of_lines(std::string_view piece) const override {
    for (std::size_t end = piece.size(); end != 0; --end) {
      const char last = piece[end - 1];
      if (last == '\n' || (last == '\r' && end < piece.size())) return end;
    }
    return 0;
  }

 private:
  std::uint32_t add_vertex(const MeshBuilder::Position& position) override {
    return welder_.add(position);
  }
  void add_facet(const std::vector<std::uint32_t>& corners) override {
    lists_.add_face(corners, {});
  }
  void set_solid(std::string_view name) override { lists_.set_group(name); }

  ParsedMeshWriter lists_;
  CornerWelder<MeshBuilder::Position> welder_;
};

}  // namespace

StlLayout stl_layout(const fs::path& path) {
  const MeshInput input{path.string(), {}};
  const std::unique_ptr<ByteSource> source = open_file(path, stl_failure(input));
  StlLayout layout;
  if (is_text(*source)) {
    layout.is_text = true;
    std::uint64_t facets = 0;
    const double share = sample_text(
        *source, [&](std::string_view text) { facets += StlTextParser::count_facets(text); });
    layout.triangles = static_cast<std::uint64_t>(static_cast<double>(facets) * share);
    return layout;
  }
  const std::string head = source->head(kStlHeaderBytes);
  if (head.size() < kStlHeaderBytes) return layout;
  const std::uint64_t count = little_endian_word(head.data() + kStlHeaderBytes - 4);
  const std::uint64_t needed = kStlHeaderBytes + count * kStlTriangleBytes;
  if (needed > source->size()) return layout;
  layout.triangles = count;
  if (needed < source->size()) layout.obstacle = "has bytes after its last triangle";
  return layout;
}

std::shared_ptr<const MeshStream> stream_stl(const fs::path& path, const fs::path& folder,
                                             const ParsingRules& rules) {
  {
    const MeshInput input{path.string(), {}};
    const std::unique_ptr<ByteSource> source = open_file(path, stl_failure(input));
    if (!is_text(*source)) return std::make_shared<StlStream>(path, folder);
  }
  return stream_parsed(path, folder, "stl", rules,
                       [&](const MeshInput& input, std::uint64_t bytes, CacheFileWriter& file) {
                         return std::make_unique<StlListReader>(input, rules, bytes, file);
                       });
}

}  // namespace kiln
