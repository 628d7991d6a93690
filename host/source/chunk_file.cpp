#include "source/chunk_file.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
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
// Files that no run has used for longer than this are removed.
constexpr std::chrono::hours kMaxUnusedFileAge(24 * 30);
// Temporary files that are older than this are removed, since the process that wrote them must have been killed.
constexpr std::chrono::hours kMaxTemporaryFileAge(24);
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

/// Removes files that no run has used for a long time, and abandoned temporary files.
void remove_unused_files(const fs::path& folder) {
  std::error_code error;
  const auto now = fs::file_time_type::clock::now();
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const bool complete = at->path().extension() == kFileSuffix;
    const bool temporary = at->path().extension() == ".tmp";
    if (!complete && !temporary) continue;
    std::error_code file_error;
    const auto age = now - at->last_write_time(file_error);
    if (!file_error && age > (complete ? kMaxUnusedFileAge : kMaxTemporaryFileAge))
      fs::remove(at->path(), file_error);
  }
}

}  // namespace

ChunkFile::Writer::Writer(fs::path folder, std::string key, std::size_t chunks)
    : folder_(std::move(folder)),
      key_(std::move(key)),
      waiting_records_(chunks),
      record_ranges_(chunks) {
  os::create_private_folders(folder_);
  remove_unused_files(folder_);
  records_at_once_ =
      std::clamp(kMaxWaitingRecordBytes / sizeof(ChunkRecord) / std::max<std::size_t>(chunks, 1),
                 kMinRecordsAtOnce, kMaxRecordsAtOnce);
  file_ = os::create_unnamed(folder_);
  if (file_ >= 0) return;
  // Some file systems do not support unnamed temporary files (O_TMPFILE).
  temporary_ = folder_ / (file_name(key_) + "-" + os::process_namespace_id() + "-" +
                          std::to_string(os::process_id()) + ".tmp");
  os::remove_file(temporary_.c_str());
  file_ = os::create_file(temporary_, 0600);
  if (file_ < 0) fail(errno);
}

ChunkFile::Writer::~Writer() {
  if (file_ >= 0) os::close(file_);
  if (!temporary_.empty()) os::remove_file(temporary_.c_str());
}

void ChunkFile::Writer::fail(int error) const {
  throw Error(ErrorCode::output, "A high poly larger than memory is sorted into a file in '" +
                                     folder_.string() +
                                     "', which cannot be written: " + std::strerror(error) +
                                     ". Make room there, or set XDG_CACHE_HOME to another folder.");
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
  record_ranges_[chunk].push_back({written_records_, records.size()});
  write(records.data(), records.size() * sizeof(ChunkRecord));
  records.clear();
}

void ChunkFile::Writer::write(const void* data, std::size_t bytes) {
  std::size_t done = 0;
  while (done < bytes) {
    const std::ptrdiff_t now =
        os::write_some(file_, static_cast<const char*>(data) + done, bytes - done);
    if (now < 0 && errno == EINTR) continue;
    if (now <= 0) fail(now == 0 ? ENOSPC : errno);
    done += static_cast<std::size_t>(now);
  }
  written_records_ += bytes;
}

ChunkFile ChunkFile::Writer::finish(
    const ChunkSummary& summary,
    const std::function<std::vector<Box<Vec3>>(const ChunkFile&)>& find_boxes) {
  for (std::size_t chunk = 0; chunk < waiting_records_.size(); ++chunk) flush(chunk);
  waiting_records_ = {};
  ChunkFile file;
  file.path_ = folder_ / file_name(key_);
  file.record_ranges_ = record_ranges_;
  file.summary_ = summary;
  file.file_ =
      os::open_to_read(temporary_.empty() ? fs::path(os::path_of_open_file(file_)) : temporary_);
  if (file.file_ < 0) fail(errno);
  file.boxes_ = find_boxes(file);

  std::vector<char> tables;
  Tail tail;
  tail.tables = written_records_;
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
  write(tables.data(), tables.size());
  write(&tail, sizeof tail);
  // The file first gets a temporary, unique name, since another run may be writing a file of the same key at the same
  // time.
  const fs::path own = folder_ / (file_name(key_) + "-" + os::process_namespace_id() + "-" +
                                  std::to_string(os::process_id()) + ".tmp");
  if (temporary_.empty()) {
    os::remove_file(own.c_str());
    if (!os::name_file(file_, own)) fail(errno);
    temporary_ = own;
  }
  if (!os::replace(temporary_, file.path_)) fail(errno);
  temporary_.clear();
  os::close(std::exchange(file_, -1));
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
  file_ = os::open_to_read(path_);
  if (file_ < 0) return false;
  const auto facts = os::query_file(file_);
  Tail tail;
  if (!facts || !facts->is_owned_by_user || facts->bytes < sizeof tail ||
      !read_all(file_, facts->bytes - sizeof tail, &tail, sizeof tail) ||
      std::memcmp(tail.magic, kMagic, sizeof kMagic) != 0 ||
      tail.tables > facts->bytes - sizeof tail) {
    return false;
  }
  std::vector<char> tables(static_cast<std::size_t>(facts->bytes - sizeof tail - tail.tables));
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
  std::error_code error;
  fs::last_write_time(path_, fs::file_time_type::clock::now(), error);
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
