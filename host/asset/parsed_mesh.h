// The binary form of a text mesh that is larger than memory: lists in a file of the cache, and the stream that reads them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asset/mesh_builder.h"
#include "io/file/byte_source.h"
#include "io/file/cache_file.h"
#include "mesh/box.h"
#include "mesh/mesh_stream.h"

namespace kiln {

/// The lists of a parsed mesh. Each is written in blocks, between those of the other lists.
enum ParsedList : std::size_t { kTriangleList, kNormalTriangles, kPositions, kNormals, kColors };
inline constexpr std::size_t kParsedLists = 5;

/// Facts of the whole file.
struct ParsedSummary {
  std::array<std::uint64_t, kParsedLists> counts{};
  double largest_color = 0;
  std::uint64_t has_pictures = 0;
};

/// Appends elements to one list.
class ParsedListWriter {
 public:
  ParsedListWriter(CacheFileWriter& file, std::size_t element_bytes)
      : file_(file), element_bytes_(element_bytes) {}

  template <typename T>
  void add(const T& element) {
    const char* const bytes = reinterpret_cast<const char*>(&element);
    block_.insert(block_.end(), bytes, bytes + sizeof element);
    ++count_;
    if (block_.size() == kElementsPerBlock * element_bytes_) flush();
  }
  void flush();
  std::uint64_t count() const { return count_; }
  const std::vector<std::uint64_t>& offsets() const { return offsets_; }

  /// Elements of each block but the last one of a list
  static constexpr std::size_t kElementsPerBlock = std::size_t{1} << 16;

 private:
  CacheFileWriter& file_;
  std::size_t element_bytes_;
  std::vector<char> block_;
  std::vector<std::uint64_t> offsets_;
  std::uint64_t count_ = 0;
};

/// Rules by which a text is parsed.
struct ParsingRules {
  Triangulation triangulation = Triangulation::automatic;  ///< For polygons
  /// Read objects and groups that engines never draw (names_hidden_hull()). If false, a file with such names is
  /// refused, since a whole read leaves them out.
  bool keep_hulls = false;
};

/// Writes lists of what a whole read of the file would give. Refuses a mesh that a whole read would change by means that
/// a reader of pieces lacks. Positions stay in memory, in double precision, until the end.
class ParsedMeshWriter {
 public:
  using Indices = std::span<const std::uint32_t>;

  /// \param place     names the current line
  /// \param vertices  expected number of vertices
  ParsedMeshWriter(const MeshInput& input, std::function<std::string()> place,
                   const ParsingRules& rules, std::size_t vertices, CacheFileWriter& file);

  /// Vertices so far. A reader that appends to them itself checks the memory that they take.
  std::vector<MeshBuilder::Position>& positions() { return positions_; }
  void add_vertex(const MeshBuilder::Position& position);
  /// The colour of the next vertex.
  void add_color(const std::array<double, 4>& rgba);
  void add_normal(const Vec3& normal);
  /// \param normal  empty, or one for each corner
  void add_face(Indices vertex, Indices normal);
  void set_group(std::string_view name);
  void set_smoothing(std::string_view name);
  void set_has_pictures() { has_pictures_ = true; }
  [[noreturn]] void refuse(const std::string& place, const std::string& problem) const;

  /// Completes the lists. \param offsets  [out] the offsets of their blocks, list by list
  ParsedSummary finish(std::vector<std::uint64_t>& offsets);

 private:
  void fill_colors();
  void check_indices(Indices vertex, Indices normal) const;
  void add_triangle(Indices vertex, Indices normal, const Triangle& corners);
  void refuse_what_a_whole_read_changes() const;

  const MeshInput& input_;
  std::function<std::string()> place_;
  ParsingRules rules_;
  std::vector<ParsedListWriter> lists_;
  std::vector<MeshBuilder::Position> positions_;
  std::vector<MeshBuilder::Position> polygon_;
  std::vector<Triangle> polygon_triangles_;
  // Triangles that have an area once they are rounded, but none in the file
  std::vector<Triangle> flat_triangles_;
  Box<Vec3d> box_;  // Of triangles with an area in the file
  double largest_color_ = 0;
  std::string smoothing_, first_smoothing_;  // Groups of the next and of the first face
  std::string polygon_place_;                // Line of the first polygon
  bool has_pictures_ = false, has_bad_normals_ = false, has_several_groups_ = false;
};

/// Parses the text of a mesh into lists.
class ParsedMeshReader {
 public:
  ParsedMeshReader() = default;
  ParsedMeshReader(const ParsedMeshReader&) = delete;
  ParsedMeshReader& operator=(const ParsedMeshReader&) = delete;
  virtual ~ParsedMeshReader() = default;

  /// Parses whole lines; called for consecutive pieces of the file. \throws Error(input)
  virtual void parse_lines(std::string_view lines) = 0;
  /// See ParsedMeshWriter::finish(). Called after the last piece.
  virtual ParsedSummary finish_lists(std::vector<std::uint64_t>& offsets) = 0;
  /// The end of the last whole line in a piece; 0 if there is none.
  virtual std::size_t end_of_lines(std::string_view piece) const = 0;
};

/// Makes the reader of a file of so many bytes, whose lists go to `file`.
using MakeParsedMeshReader = std::function<std::unique_ptr<ParsedMeshReader>(
    const MeshInput& input, std::uint64_t bytes, CacheFileWriter& file)>;

/// Opens a text mesh that is parsed once: its lists are written to a file in `folder` (CacheFileWriter), which later calls
/// use while the path, size and time of the mesh, the format and the rules are the same. The progress names the piece; it
/// can be cancelled.
/// \param make_reader  called only if the text has to be parsed
/// \throws Error(input); Error(output) if the file cannot be written
std::shared_ptr<const MeshStream> stream_parsed(const std::filesystem::path& path,
                                                const std::filesystem::path& folder,
                                                const std::string& format,
                                                const ParsingRules& rules,
                                                const MakeParsedMeshReader& make_reader);

/// Calls use(text) for the whole file if it is small, else for 32 pieces of 64 KiB that are spread over it, and begin and
/// end anywhere. \returns the file's size divided by that of the pieces; 0 for an empty file
double sample_text(const ByteSource& source, const std::function<void(std::string_view)>& use);

/// Ends a message about a file that has to be read whole; the memory limit's option follows.
inline constexpr const char* kWriteAsPly =
    "Write it as a binary, little-endian PLY of triangles, or raise the ";

}  // namespace kiln
