#include "job/files.h"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <unordered_set>

#include "base/file.h"
#include "job/describe.h"
#include "kiln/error.h"
#include "kiln/files.h"
#include "kiln/map.h"
#include "options/json.h"
#include "options/parse.h"

namespace kiln {
namespace {

/// A regular file, open for reading. It is opened before its type is checked, without blocking if it is a pipe.
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& path) : file_(os::open_to_read(path)) {
    const std::optional<os::FileStatus> facts = file_ < 0 ? std::nullopt : os::query_file(file_);
    if (!facts) {
      problem_ = std::strerror(errno);
    } else if (!facts->is_regular) {
      problem_ = "it is no regular file";
    } else {
      size_ = facts->bytes;
    }
  }
  ~RegularFile() {
    if (file_ >= 0) os::close(file_);
  }
  RegularFile(const RegularFile&) = delete;
  RegularFile& operator=(const RegularFile&) = delete;

  /// The error message; empty if the file is readable.
  const std::string& problem() const { return problem_; }
  std::uint64_t size() const { return size_; }
  /// Reads up to `count` bytes: fewer at the end of the file, or after an I/O error, which sets problem().
  std::string read(std::size_t count) {
    // Allocates memory for the size that the file reports, or for the bytes read so far, instead of `count` bytes at
    // once.
    constexpr std::size_t kMinBytes = std::size_t{1} << 16;
    std::string bytes;
    std::size_t bytes_read = 0;
    while (problem_.empty() && bytes_read < count) {
      if (bytes_read == bytes.size()) {
        bytes.resize(std::min<std::uint64_t>(
            count, std::max<std::uint64_t>({2 * bytes_read, kMinBytes, size_ + 1})));
      }
      bytes_read +=
          os::read_fully(file_, bytes_read, bytes.data() + bytes_read, bytes.size() - bytes_read);
      if (bytes_read == bytes.size()) continue;
      if (errno != 0) problem_ = std::strerror(errno);
      break;
    }
    bytes.resize(bytes_read);
    return bytes;
  }

 private:
  int file_;
  std::uint64_t size_ = 0;
  std::string problem_;
};

}  // namespace

std::string read_small_file(const std::filesystem::path& path, std::size_t max_bytes,
                            const Message& what) {
  OutputSet::protect(path);
  RegularFile file(path);
  // Files in /proc have contents but report 0 bytes, so one byte more than the limit is read to detect the excess.
  std::string bytes = file.size() > max_bytes ? std::string() : file.read(max_bytes + 1);
  if (!file.problem().empty()) {
    throw OptionError(
        what + " cannot be read (" + file.problem() + "): check the path, and name a text file.",
        ErrorCode::input);
  }
  if (file.size() > max_bytes || bytes.size() > max_bytes) {
    throw OptionError(what + " is longer than " + std::to_string(max_bytes >> 20) +
                          " MiB, the limit for such a file: check the path.",
                      ErrorCode::input);
  }
  // Parsers might stop at a null byte and silently ignore the rest.
  if (bytes.find('\0') != std::string::npos) {
    throw OptionError(
        what +
            " contains null bytes, so it is not text: check the path, and save it as plain text.",
        ErrorCode::input);
  }
  return bytes;
}

std::string head_of_file(const std::filesystem::path& path, std::size_t count) {
  return RegularFile(path).read(count);
}

bool is_readable_file(const std::filesystem::path& path) {
  return RegularFile(path).problem().empty();
}

namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) { return !path.empty() && path != "-"; }

}  // namespace

namespace {

/// A key that is equal for all paths of one file: device and inode of an existing file, else its canonical path.
std::string file_key(const fs::path& path) {
  if (const std::optional<os::FileStatus> facts = os::query_file(path)) {
    return std::to_string(facts->id.device) + ":" + std::to_string(facts->id.file);
  }
  std::error_code error;
  const fs::path found = os::canonical(path, error);
  return os::name_key(error ? os::absolute_normal(path) : found);
}

}  // namespace

bool is_write_protected(const fs::path& path) {
  const auto found = os::query_file(path);
  return found && found->is_regular && !os::may_write(path);
}

bool is_same_file(const fs::path& a, const fs::path& b) { return file_key(a) == file_key(b); }

void check_paths(const std::vector<fs::path>& inputs, const std::vector<fs::path>& outputs) {
  for (const fs::path& input : inputs) {
    if (is_file(input)) OutputSet::protect(input);
  }
  std::unordered_set<std::string> used_file_keys;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (!is_file(outputs[i])) continue;
    std::error_code error;
    if (fs::is_directory(outputs[i], error)) {
      throw Error(ErrorCode::output,
                  "'" + outputs[i].string() +
                      "' is a folder, but the output needs a file of that name: move the folder "
                      "away, or choose another folder for the output.");
    }
    if (error == std::errc::filename_too_long) {
      throw Error(ErrorCode::output,
                  "'" + outputs[i].string() +
                      "' is too long a name for this file system: choose a shorter one.");
    }
    if (os::is_device_name(outputs[i])) {
      throw Error(ErrorCode::output,
                  "'" + outputs[i].string() +
                      "' is a name that Windows reserves for a device: choose another.");
    }
    OutputSet::check(outputs[i]);
    if (!used_file_keys.insert(file_key(outputs[i])).second) {
      fail_usage("Two outputs have the same name, '" + outputs[i].string() +
                 "': choose another for one of them.");
    }
  }
}

bool is_obj_by_kiln(const fs::path& obj) {
  return is_readable_file(obj) && head_of_file(obj, 6) == "# Kiln";
}

void check_obj_is_replaceable(const fs::path& obj, bool force) {
  if (force || !is_readable_file(obj) || is_obj_by_kiln(obj)) return;
  throw OptionError("'" + obj.string() +
                        "' exists and was not written by Kiln: choose another folder, or add " +
                        option("force") + " to overwrite it.",
                    ErrorCode::output);
}

void prepare_parent(const fs::path& file) {
  std::error_code error;
  const bool stream = fs::exists(file, error) && !fs::is_regular_file(file, error);
  if (is_file(file) && !stream) prepare_output_folder(file.parent_path());
}

namespace {

constexpr std::size_t kMaxLowRecordBytes = 1 << 16;

fs::path record_path(const fs::path& folder, const std::string& stem) {
  return folder / ("." + stem + ".kiln.json");
}

/// The mesh that is named in the record of a folder of maps; empty if there is no record that Kiln wrote.
fs::path recorded_source(const fs::path& folder, const std::string& stem) {
  const fs::path path = record_path(folder, stem);
  if (!is_readable_file(path)) return {};
  Json json = Json::parse(head_of_file(path, kMaxLowRecordBytes));
  if (!json.is_object() || !json["low"].is_string()) return {};
  return folder / unescape_bytes(json["low"].text());
}

/// The first map in a folder by name, of any format or UDIM tile; empty if there is none.
fs::path first_map_in(const fs::path& folder, const std::string& stem) {
  std::string first;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    const bool is_map = std::any_of(maps().begin(), maps().end(), [&](const MapInfo& map) {
      return name.starts_with(stem + "_" + std::string(map.kind.name) + ".");
    });
    if (is_map && (first.empty() || name < first)) first = name;
  }
  return first.empty() ? fs::path() : folder / first;
}

}  // namespace

void check_folder_holds_same_low(const fs::path& folder, const std::string& stem,
                                 const fs::path& source) {
  const fs::path recorded = recorded_source(folder, stem);
  std::error_code ignored;
  // The recorded mesh may have been renamed, so a missing one is no conflict.
  if (recorded.empty() || !fs::exists(recorded, ignored)) return;
  // The maps may belong to the low poly that Kiln wrote into the same folder.
  const fs::path written_mesh = folder / (stem + ".obj");
  if (is_same_file(recorded, source) || is_same_file(recorded, written_mesh) ||
      is_same_file(source, written_mesh))
    return;
  // checked last, since it lists all files of the folder
  const fs::path map = first_map_in(folder, stem);
  if (map.empty()) return;
  fail_usage("'" + map.string() + "' is a map of '" + os::normal(recorded).string() +
             "', and would be overwritten by a map of '" + source.string() + "'. Choose another " +
             option("out") +
             ", rename one of "
             "the meshes, or add " +
             option("force") + ".");
}

void save_low_record(const fs::path& folder, const std::string& stem, const fs::path& source) {
  std::error_code error;
  fs::path path = fs::relative(source, folder, error);
  if (error || path.empty()) path = os::absolute(source, error);
  Json record;
  record["low"] = path.generic_string();
  save_text(record_path(folder, stem), to_text(record));
}

}  // namespace kiln
