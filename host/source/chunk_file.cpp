#include "source/chunk_file.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/file.h"
#include "base/fnv.h"
#include "base/formatted.h"
#include "kiln/error.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr char kMagic[8] = {'k', 'i', 'l', 'n', 'c', 'h', 'k', '1'};
constexpr const char* kFileSuffix = ".chunks";
// Bytes of memory for records of all chunks that are not written yet
constexpr std::size_t kMaxWaitingRecordBytes = std::size_t{64} << 20;
constexpr std::size_t kMinRecordsAtOnce = 16, kMaxRecordsAtOnce = std::size_t{1} << 16;

static_assert(sizeof(ChunkRecord) == 16 && sizeof(Box<Vec3>) == 24);

/// The footer of a file of chunks: the last bytes, after the tables.
struct Tail {
  std::uint64_t tables = 0;  ///< Offset of the tables in the file
  std::uint64_t chunks = 0, extents = 0, key_bytes = 0;
  std::uint64_t hash = 0;  ///< Hash of the tables
  char magic[8] = {};
};

std::string file_name(const std::string& key) {
  return formatted("%016llx", static_cast<unsigned long long>(fnv1a(key))) + kFileSuffix;
}

std::uint64_t hash_of(const std::vector<char>& bytes) {
  return fnv1a({bytes.data(), bytes.size()});
}

template <typename T>
void append_bytes(std::vector<char>& to, std::span<const T> values) {
  const char* const at = reinterpret_cast<const char*>(values.data());
  to.insert(to.end(), at, at + values.size_bytes());
}

bool read_all(int file, std::uint64_t offset, void* to, std::size_t bytes) {
  return os::read_fully(file, offset, to, bytes) == bytes;
}

}  // namespace

ChunkFile::Writer::Writer(fs::path folder, std::string key, std::size_t chunks)
    : key_(std::move(key)),
      file_(std::move(folder), file_name(key_)),
      waiting_records_(chunks),
      record_ranges_(chunks) {
  records_at_once_ =
      std::clamp(kMaxWaitingRecordBytes / sizeof(ChunkRecord) / std::max<std::size_t>(chunks, 1),
                 kMinRecordsAtOnce, kMaxRecordsAtOnce);
}

void ChunkFile::Writer::add(std::size_t chunk, const ChunkRecord& record) {
  std::vector<ChunkRecord>& records = waiting_records_[chunk];
  if (records.capacity() == 0) records.reserve(records_at_once_);
  records.push_back(record);
  if (records.size() >= records_at_once_) flush(chunk);
}

void ChunkFile::Writer::flush(std::size_t chunk) {
  std::vector<ChunkRecord>& records = waiting_records_[chunk];
  if (records.empty()) return;
  record_ranges_[chunk].push_back({file_.size(), records.size()});
  file_.write(records.data(), records.size() * sizeof(ChunkRecord));
  records.clear();
}

ChunkFile ChunkFile::Writer::finish(
    const ChunkSummary& summary,
    const std::function<std::vector<Box<Vec3>>(const ChunkFile&)>& find_boxes) {
  for (std::size_t chunk = 0; chunk < waiting_records_.size(); ++chunk) flush(chunk);
  waiting_records_ = {};
  ChunkFile file;
  file.path_ = file_.path();
  file.record_ranges_ = record_ranges_;
  file.summary_ = summary;
  file.file_ = file_.open_to_read();
  file.boxes_ = find_boxes(file);

  std::vector<char> tables;
  Tail tail;
  tail.tables = file_.size();
  tail.chunks = record_ranges_.size();
  tail.key_bytes = key_.size();
  append_bytes(tables, std::span<const Box<Vec3>>(file.boxes_));
  append_bytes(tables, std::span<const ChunkSummary>(&summary, 1));
  for (const RecordRange& extents : record_ranges_) {
    const std::uint64_t count = extents.size();
    tail.extents += count;
    append_bytes(tables, std::span<const std::uint64_t>(&count, 1));
    append_bytes(tables, std::span<const std::array<std::uint64_t, 2>>(extents));
  }
  append_bytes(tables, std::span<const char>(key_));
  tail.hash = hash_of(tables);
  std::memcpy(tail.magic, kMagic, sizeof kMagic);
  file_.write(tables.data(), tables.size());
  file_.write(&tail, sizeof tail);
  file_.commit();
  return file;
}

ChunkFile::~ChunkFile() { close(); }

ChunkFile::ChunkFile(ChunkFile&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::exchange(other.file_, -1)),
      record_ranges_(std::move(other.record_ranges_)),
      boxes_(std::move(other.boxes_)),
      summary_(other.summary_) {}

ChunkFile& ChunkFile::operator=(ChunkFile&& other) noexcept {
  if (this == &other) return *this;
  close();
  path_ = std::move(other.path_);
  file_ = std::exchange(other.file_, -1);
  record_ranges_ = std::move(other.record_ranges_);
  boxes_ = std::move(other.boxes_);
  summary_ = other.summary_;
  return *this;
}

void ChunkFile::close() noexcept {
  if (file_ >= 0) os::close(std::exchange(file_, -1));
}

bool ChunkFile::open(const fs::path& folder, const std::string& key) {
  close();
  path_ = folder / file_name(key);
  std::uint64_t bytes = 0;
  file_ = open_cache_file(path_, bytes);
  if (file_ < 0) return false;
  Tail tail;
  if (bytes < sizeof tail || !read_all(file_, bytes - sizeof tail, &tail, sizeof tail) ||
      std::memcmp(tail.magic, kMagic, sizeof kMagic) != 0 || tail.tables > bytes - sizeof tail) {
    return false;
  }
  std::vector<char> tables(static_cast<std::size_t>(bytes - sizeof tail - tail.tables));
  if (!read_all(file_, tail.tables, tables.data(), tables.size()) || hash_of(tables) != tail.hash ||
      tail.key_bytes != key.size()) {
    return false;
  }
  std::size_t at = 0;
  const auto take = [&](void* to, std::uint64_t bytes) {
    if (bytes > tables.size() - at) return false;
    if (bytes != 0) std::memcpy(to, &tables[at], static_cast<std::size_t>(bytes));
    at += static_cast<std::size_t>(bytes);
    return true;
  };
  if (tail.chunks > tables.size()) return false;
  boxes_.resize(static_cast<std::size_t>(tail.chunks));
  record_ranges_.assign(boxes_.size(), {});
  if (!take(boxes_.data(), boxes_.size() * sizeof(Box<Vec3>)) || !take(&summary_, sizeof summary_))
    return false;
  for (RecordRange& extents : record_ranges_) {
    std::uint64_t count = 0;
    if (!take(&count, sizeof count) || count > tables.size()) return false;
    extents.resize(static_cast<std::size_t>(count));
    if (!take(extents.data(), count * sizeof extents[0])) return false;
  }
  std::string found(key.size(), '\0');
  if (!take(found.data(), found.size()) || found != key || at != tables.size()) return false;
  touch_cache_file(path_);
  return true;
}

std::uint64_t ChunkFile::records(std::size_t chunk) const {
  std::uint64_t count = 0;
  for (const auto& [offset, records] : record_ranges_[chunk]) count += records;
  return count;
}

std::vector<ChunkRecord> ChunkFile::read(std::size_t chunk) const {
  std::vector<ChunkRecord> result(static_cast<std::size_t>(records(chunk)));
  std::size_t at = 0;
  for (const auto& [offset, records] : record_ranges_[chunk]) {
    if (!read_all(file_, offset, &result[at],
                  static_cast<std::size_t>(records) * sizeof(ChunkRecord))) {
      throw Error(ErrorCode::input, "The cached file '" + path_.string() +
                                        "', a copy of the high poly sorted into chunks, cannot be "
                                        "read: delete this file, and bake again.");
    }
    at += static_cast<std::size_t>(records);
  }
  return result;
}

}  // namespace kiln
