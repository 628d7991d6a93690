#include "asset/parsed_mesh.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "asset/file_identity.h"
#include "base/file.h"
#include "base/fnv.h"
#include "base/formatted.h"
#include "base/memory.h"
#include "base/option.h"
#include "base/progress_guard.h"
#include "clean/high_hulls.h"
#include "io/file/bounds.h"
#include "mesh/polygon.h"
#include "mesh/usable.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kTextBytesPerPiece = std::size_t{1} << 24;
constexpr std::uint64_t kMaxElements = 0x7FFFFFFF;
constexpr char kParsedMagic[8] = {'k', 'i', 'l', 'n', 'o', 'b', 'j', '1'};
constexpr std::size_t kElementsPerBlock = ParsedListWriter::kElementsPerBlock;
constexpr std::array<std::size_t, kParsedLists> kElementBytes = {12, 12, 12, 12, 8};

/// A colour of a vertex by both readings, as in MeshBuilder.
using ColorPair = std::array<MeshStream::Color, 2>;
static_assert(sizeof(ColorPair) == 8 && sizeof(Vec3) == 12 && sizeof(Triangle) == 12);

/// The last bytes of a file of parsed lists. Before them: the blocks, their offsets by list, and the key.
struct ParsedTail {
  ParsedSummary summary;
  std::uint64_t offsets = 0, key_bytes = 0;
  std::uint64_t hash = 0;  ///< Of the offsets and the key
  char magic[8] = {};
};

FailWith parsing_failure(const MeshInput& input) {
  return [&input](const std::string& place, const std::string& problem, const Message& remedy) {
    input.fail(place, problem, remedy);
  };
}

}  // namespace

void ParsedListWriter::flush() {
  if (block_.empty()) return;
  offsets_.push_back(file_.size());
  file_.write(block_.data(), block_.size());
  block_.clear();
}

ParsedMeshWriter::ParsedMeshWriter(const MeshInput& input, std::function<std::string()> place,
                                   const ParsingRules& rules, std::size_t vertices,
                                   CacheFileWriter& file)
    : input_(input), place_(std::move(place)), rules_(rules) {
  for (const std::size_t bytes : kElementBytes) lists_.emplace_back(file, bytes);
  positions_.reserve(vertices);
}

ParsedSummary ParsedMeshWriter::finish(std::vector<std::uint64_t>& offsets) {
  refuse_what_a_whole_read_changes();
  for (const MeshBuilder::Position& p : positions_) {
    lists_[kPositions].add(Vec3{narrow(p[0]), narrow(p[1]), narrow(p[2])});
  }
  if (lists_[kColors].count() != 0) fill_colors();
  ParsedSummary summary;
  for (std::size_t i = 0; i < kParsedLists; ++i) {
    lists_[i].flush();
    summary.counts[i] = lists_[i].count();
    offsets.insert(offsets.end(), lists_[i].offsets().begin(), lists_[i].offsets().end());
  }
  summary.largest_color = largest_color_;
  summary.has_pictures = has_pictures_ ? 1 : 0;
  return summary;
}

void ParsedMeshWriter::refuse(const std::string& place, const std::string& problem) const {
  input_.fail(place, problem + ", which only a whole read allows",
              kWriteAsPly + option("memory_limit") + ".");
}

void ParsedMeshWriter::add_color(const std::array<double, 4>& rgba) {
  fill_colors();
  const ColorPair pair = MeshBuilder::color_versions(rgba);
  largest_color_ = std::max(largest_color_, MeshBuilder::largest_channel(rgba));
  lists_[kColors].add(pair);
}

/// Vertices without a colour are white.
void ParsedMeshWriter::fill_colors() {
  constexpr MeshStream::Color kWhite{255, 255, 255, 255};
  while (lists_[kColors].count() < positions_.size())
    lists_[kColors].add(ColorPair{kWhite, kWhite});
}

void ParsedMeshWriter::add_vertex(const MeshBuilder::Position& position) {
  const std::size_t count = positions_.size();
  if (count == kMaxElements) input_.fail(place_(), "it has too many vertices", "Split the mesh.");
  if (count == positions_.capacity()) {
    require_memory("Its vertices", 3 * (count + 1) * sizeof position,
                   memory_failure(parsing_failure(input_), ""));
  }
  positions_.push_back(position);
}

void ParsedMeshWriter::add_normal(const Vec3& normal) {
  const Vec3 unit = unit_normal(normal);
  if (unit == Vec3{}) has_bad_normals_ = true;
  lists_[kNormals].add(unit);
}

void ParsedMeshWriter::set_group(std::string_view name) {
  if (!rules_.keep_hulls && names_hidden_hull(std::string(name))) {
    input_.fail(
        place_(),
        "it has a collision hull ('" + std::string(name) + "'), which a whole read leaves out",
        "Remove it from the file, add " + option("keep_hulls") + ", or raise the " +
            option("memory_limit") + ".");
  }
}

void ParsedMeshWriter::set_smoothing(std::string_view name) {
  smoothing_ = MeshBuilder::is_flat_group(name) ? std::string() : std::string(name);
}

void ParsedMeshWriter::check_indices(Indices vertex, Indices normal) const {
  const auto is_known = [](Indices indices, std::size_t count) {
    return std::all_of(indices.begin(), indices.end(),
                       [&](std::uint32_t i) { return i < count || i == MeshBuilder::kNone; });
  };
  if (!is_known(vertex, positions_.size()) || !is_known(normal, lists_[kNormals].count())) {
    refuse(place_(), "a face stands before its vertices or normals");
  }
  const bool has_normals = lists_[kNormalTriangles].count() != 0;
  const bool starts = lists_[kTriangleList].count() == 0;
  if (std::find(normal.begin(), normal.end(), MeshBuilder::kNone) != normal.end() ||
      (!starts && has_normals == normal.empty())) {
    refuse(place_(), "some of its corners have normals, and others have none");
  }
}

void ParsedMeshWriter::add_face(Indices vertex, Indices normal) {
  if (vertex.size() < 3) return;
  check_indices(vertex, normal);
  if (lists_[kTriangleList].count() == 0) first_smoothing_ = smoothing_;
  has_several_groups_ = has_several_groups_ || smoothing_ != first_smoothing_;
  if (lists_[kTriangleList].count() + vertex.size() > kMaxElements) {
    input_.fail("", "it has too many triangles", "Split or simplify the mesh.");
  }
  if (vertex.size() == 3) {
    add_triangle(vertex, normal, {0, 1, 2});
    return;
  }
  if (polygon_place_.empty()) polygon_place_ = place_();
  polygon_.clear();
  for (const std::uint32_t v : vertex) polygon_.push_back(positions_[v]);
  triangulate(polygon_, rules_.triangulation, polygon_triangles_);
  for (const Triangle& corners : polygon_triangles_) add_triangle(vertex, normal, corners);
}

void ParsedMeshWriter::add_triangle(Indices vertex, Indices normal, const Triangle& corners) {
  Triangle triangle{};
  std::array<Vec3d, 3> at{};
  std::array<Vec3, 3> rounded{};
  for (std::size_t k = 0; k < 3; ++k) {
    triangle[k] = vertex[corners[k]];
    const MeshBuilder::Position& p = positions_[triangle[k]];
    at[k] = {p[0], p[1], p[2]};
    rounded[k] = {narrow(p[0]), narrow(p[1]), narrow(p[2])};
  }
  lists_[kTriangleList].add(triangle);
  if (!normal.empty()) {
    lists_[kNormalTriangles].add(
        Triangle{normal[corners[0]], normal[corners[1]], normal[corners[2]]});
  }
  if (has_area(at[0], at[1], at[2])) {
    for (const Vec3d& p : at) box_.add(p);
  } else if (has_area(rounded, {0, 1, 2})) {
    flat_triangles_.push_back(triangle);
  }
}

void ParsedMeshWriter::refuse_what_a_whole_read_changes() const {
  if (lists_[kTriangleList].count() == 0) {
    input_.fail("", "it has no faces of three corners or more", "Export triangles.");
  }
  const bool has_normals = lists_[kNormalTriangles].count() != 0;
  // Normals that are computed are weighted by polygons.
  if (!polygon_place_.empty() && (!has_normals || has_bad_normals_)) {
    refuse(polygon_place_, has_normals ? "it has polygons, and normals without a direction"
                                       : "it has polygons without normals");
  }
  if (!has_normals && has_several_groups_) {
    refuse("", "it has several smoothing groups, but no normals");
  }
  for (const Triangle& triangle : flat_triangles_) {
    for (const std::uint32_t v : triangle) {
      const auto& [x, y, z] = positions_[v];
      if (box_.contains(Vec3d{x, y, z})) continue;
      refuse("", "it has triangles without an area that get one once they are rounded");
    }
  }
}

namespace {

/// A parsed mesh.
class ParsedMesh : public MeshStream {
 public:
  ParsedMesh(const fs::path& path, const fs::path& folder, const std::string& format,
             const ParsingRules& rules, const MakeParsedMeshReader& make_reader)
      : input_{path.string(), {}}, name_(path.stem().string()), path_(path.string()) {
    const std::unique_ptr<ByteSource> source = open_file(path, parsing_failure(input_));
    identity_ = file_identity(path, source->size()) + "\n" + format + " " +
                std::to_string(static_cast<int>(rules.triangulation)) +
                (rules.keep_hulls ? " hulls" : "");
    const std::string file_name =
        formatted("%016llx", static_cast<unsigned long long>(fnv1a(identity_))) + ".mesh";
    cache_path_ = folder / file_name;
    if (open_parsed()) return;
    close();
    CacheFileWriter writer(folder, file_name);
    parse(*source, *make_reader(input_, source->size(), writer), writer);
    if (!open_parsed()) {
      close();
      fail_to_read();
    }
  }
  ~ParsedMesh() override { close(); }

  std::uint32_t vertex_count() const override { return count(kPositions); }
  std::uint32_t triangle_count() const override { return count(kTriangleList); }
  bool has_normals() const override { return count(kNormalTriangles) != 0; }
  bool has_colors() const override { return count(kColors) != 0; }
  bool has_pictures() const override { return summary_.has_pictures != 0; }
  bool has_normal_indices() const override { return has_normals(); }
  std::uint32_t normal_count() const override { return count(kNormals); }
  void read_positions(std::size_t first, std::span<Vec3> to) const override {
    read(kPositions, first, to);
  }
  void read_triangles(std::size_t first, std::span<Triangle> to) const override {
    read(kTriangleList, first, to);
  }
  void read_normal_triangles(std::size_t first, std::span<Triangle> to) const override {
    read(kNormalTriangles, first, to);
  }
  void read_normals(std::size_t first, std::span<Vec3> to) const override {
    read(kNormals, first, to);
  }
  void read_colors(std::size_t first, std::span<Color> to) const override {
    std::vector<ColorPair> pairs(to.size());
    read(kColors, first, std::span<ColorPair>(pairs));
    const std::size_t version = MeshBuilder::are_fractions(summary_.largest_color) ? 1 : 0;
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = pairs[i][version];
  }
  const std::string& name() const override { return name_; }
  const std::string& path() const override { return path_; }
  std::string identity() const override { return identity_; }

 private:
  std::uint32_t count(ParsedList list) const {
    return static_cast<std::uint32_t>(summary_.counts[list]);
  }

  void parse(const ByteSource& source, ParsedMeshReader& reader, CacheFileWriter& writer) {
    std::string piece;
    std::uint64_t at = 0;
    const std::uint64_t pieces = (source.size() + kTextBytesPerPiece - 1) / kTextBytesPerPiece;
    while (at < source.size()) {
      ProgressGuard::poll_within_stage("parsing the high poly, piece " +
                                       std::to_string(at / kTextBytesPerPiece + 1) + " of " +
                                       std::to_string(pieces));
      const std::size_t kept = piece.size();
      piece.resize(kept + static_cast<std::size_t>(
                              std::min<std::uint64_t>(kTextBytesPerPiece, source.size() - at)));
      const std::size_t got = source.read_at(at, &piece[kept], piece.size() - kept);
      if (got != piece.size() - kept || source.was_written()) {
        input_.fail("", "it changed while it was read", "Wait until it is written, and try again.");
      }
      at += got;
      const std::size_t end = at == source.size() ? piece.size() : end_of_lines(reader, piece);
      reader.parse_lines(std::string_view(piece).substr(0, end));
      piece.erase(0, end);
    }
    std::vector<std::uint64_t> offsets;
    ParsedTail tail;
    tail.summary = reader.finish_lists(offsets);
    tail.offsets = offsets.size();
    tail.key_bytes = identity_.size();
    tail.hash = hash_of(offsets);
    std::memcpy(tail.magic, kParsedMagic, sizeof kParsedMagic);
    writer.write(offsets.data(), offsets.size() * sizeof(std::uint64_t));
    writer.write(identity_.data(), identity_.size());
    writer.write(&tail, sizeof tail);
    writer.commit();
  }

  std::size_t end_of_lines(const ParsedMeshReader& reader, std::string_view piece) const {
    const std::size_t end = reader.end_of_lines(piece);
    if (end != 0) return end;
    input_.fail("", "it has a line of more than " + std::to_string(kTextBytesPerPiece) + " bytes",
                kWriteAsPly + option("memory_limit") + ".");
  }

  std::uint64_t hash_of(const std::vector<std::uint64_t>& offsets) const {
    return fnv1a(identity_) * 0x9E3779B97F4A7C15U ^
           fnv1a({reinterpret_cast<const char*>(offsets.data()),
                  offsets.size() * sizeof(std::uint64_t)});
  }

  /// Opens the file of an earlier run. \returns false if there is none, or if it is damaged
  bool open_parsed() {
    std::uint64_t bytes = 0;
    file_ = open_cache_file(cache_path_, bytes);
    ParsedTail tail;
    if (file_ < 0 || bytes < sizeof tail || !read_all(bytes - sizeof tail, &tail, sizeof tail) ||
        std::memcmp(tail.magic, kParsedMagic, sizeof kParsedMagic) != 0 ||
        tail.key_bytes != identity_.size()) {
      return false;
    }
    std::uint64_t blocks = 0, used = sizeof tail + tail.key_bytes;
    for (std::size_t i = 0; i < kParsedLists; ++i) {
      const std::uint64_t elements = tail.summary.counts[i];
      if (elements > kMaxElements) return false;
      blocks += (elements + kElementsPerBlock - 1) / kElementsPerBlock;
      used += elements * kElementBytes[i];
    }
    if (blocks != tail.offsets || used + blocks * sizeof(std::uint64_t) != bytes) return false;
    std::vector<std::uint64_t> offsets(static_cast<std::size_t>(blocks));
    std::string key(identity_.size(), '\0');
    const std::uint64_t key_at = bytes - sizeof tail - key.size();
    if (!read_all(key_at, key.data(), key.size()) || key != identity_ ||
        !read_all(key_at - offsets.size() * sizeof(std::uint64_t), offsets.data(),
                  offsets.size() * sizeof(std::uint64_t)) ||
        hash_of(offsets) != tail.hash) {
      return false;
    }
    summary_ = tail.summary;
    auto next = offsets.begin();
    for (std::size_t i = 0; i < kParsedLists; ++i) {
      const auto own = static_cast<std::ptrdiff_t>((summary_.counts[i] + kElementsPerBlock - 1) /
                                                   kElementsPerBlock);
      offsets_[i].assign(next, next + own);
      next += own;
    }
    touch_cache_file(cache_path_);
    return true;
  }

  template <typename T>
  void read(ParsedList list, std::size_t first, std::span<T> to) const {
    while (!to.empty()) {
      const std::size_t in_block = first % kElementsPerBlock;
      const std::size_t now = std::min(to.size(), kElementsPerBlock - in_block);
      if (!read_all(offsets_[list][first / kElementsPerBlock] + in_block * sizeof(T), to.data(),
                    now * sizeof(T))) {
        fail_to_read();
      }
      first += now;
      to = to.subspan(now);
    }
  }

  [[noreturn]] void fail_to_read() const {
    throw Error(ErrorCode::input, "'" + cache_path_.string() +
                                      "', the high poly as it was parsed, cannot be read: remove "
                                      "it, and bake again.");
  }
  bool read_all(std::uint64_t offset, void* to, std::size_t bytes) const {
    return os::read_fully(file_, offset, to, bytes) == bytes;
  }
  void close() noexcept {
    if (file_ >= 0) os::close(std::exchange(file_, -1));
  }

  MeshInput input_;
  std::string name_, path_, identity_;
  fs::path cache_path_;
  int file_ = -1;
  ParsedSummary summary_;
  std::array<std::vector<std::uint64_t>, kParsedLists> offsets_;
};

}  // namespace

std::shared_ptr<const MeshStream> stream_parsed(const fs::path& path, const fs::path& folder,
                                                const std::string& format,
                                                const ParsingRules& rules,
                                                const MakeParsedMeshReader& make_reader) {
  return std::make_shared<ParsedMesh>(path, folder, format, rules, make_reader);
}

double sample_text(const ByteSource& source, const std::function<void(std::string_view)>& use) {
  constexpr std::uint64_t kSamples = 32;
  constexpr std::size_t kSampleBytes = std::size_t{1} << 16;
  std::uint64_t sampled_bytes = 0;
  const bool is_small = source.size() <= kSamples * kSampleBytes;
  const std::uint64_t pieces = is_small ? 1 : kSamples;
  std::string piece(is_small ? static_cast<std::size_t>(source.size()) : kSampleBytes, '\0');
  const std::uint64_t step = is_small ? 0 : (source.size() - kSampleBytes) / (kSamples - 1);
  for (std::uint64_t i = 0; i < pieces; ++i) {
    const std::size_t got = source.read_at(i * step, piece.data(), piece.size());
    sampled_bytes += got;
    use(std::string_view(piece).substr(0, got));
  }
  return sampled_bytes == 0
             ? 0
             : static_cast<double>(source.size()) / static_cast<double>(sampled_bytes);
}

}  // namespace kiln
