// A file with the triangles of a large mesh, sorted by position into chunks. It is cached for later runs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "io/file/cache_file.h"
#include "kiln/types.h"
#include "mesh/box.h"

namespace kiln {

/// A triangle as it is stored in a chunk.
struct ChunkRecord {
  Triangle corners{};          ///< Vertices of the whole mesh
  std::uint32_t triangle = 0;  ///< The triangle's index in the whole mesh
};

/// Values of the whole mesh that are computed while its triangles are sorted into chunks. The file stores them for later
/// runs.
struct ChunkSummary {
  /// Box of the mesh's triangles with area, in the mesh's units
  std::array<double, 3> low{}, high{};
  Box<Vec3> used;  ///< Box of all triangles' finite corners, in the working frame
  /// Number of triangles that searches ignore, since they have no area
  std::uint64_t unsearchable_triangles = 0;
};

/// A file of chunks. Within a chunk, records have the order in which they were added.
///
/// It is a file of a cache (CacheFileWriter): whole or absent, and removed by age.
class ChunkFile {
 public:
  /// Collects the records of all chunks, and writes them to the file.
  class Writer {
   public:
    /// \param folder created if it does not exist \throws Error(output) if it cannot be written to
    Writer(std::filesystem::path folder, std::string key, std::size_t chunks);

    void add(std::size_t chunk, const ChunkRecord& record);
    /// Completes the file and gives it its name. \param boxes  box of each chunk
    ChunkFile finish(const ChunkSummary& summary,
                     const std::function<std::vector<Box<Vec3>>(const ChunkFile&)>& find_boxes);

   private:
    void flush(std::size_t chunk);

    std::string key_;
    CacheFileWriter file_;
    std::size_t records_at_once_ = 0;
    std::vector<std::vector<ChunkRecord>> waiting_records_;
    std::vector<std::vector<std::array<std::uint64_t, 2>>> record_ranges_;
  };

  ChunkFile() = default;
  ~ChunkFile();
  ChunkFile(ChunkFile&& other) noexcept;
  ChunkFile& operator=(ChunkFile&& other) noexcept;

  /// Opens the file of a key, and sets its time of last use. \returns false if there is none, or if it is damaged
  bool open(const std::filesystem::path& folder, const std::string& key);

  std::size_t size() const { return record_ranges_.size(); }  ///< Number of chunks
  std::uint64_t records(std::size_t chunk) const;
  const Box<Vec3>& box(std::size_t chunk) const { return boxes_[chunk]; }
  const ChunkSummary& summary() const { return summary_; }
  /// Reads a chunk. Thread-safe. \throws Error(input) if the file was changed meanwhile
  std::vector<ChunkRecord> read(std::size_t chunk) const;

 private:
  friend class Writer;
  /// A range of a chunk's records: its offset in the file, and its number of records.
  using RecordRange = std::vector<std::array<std::uint64_t, 2>>;

  void close() noexcept;

  std::filesystem::path path_;
  int file_ = -1;
  std::vector<RecordRange> record_ranges_;
  std::vector<Box<Vec3>> boxes_;
  ChunkSummary summary_;
};

}  // namespace kiln
