#include "cl/tuning.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "base/fnv.h"
#include "cl/kernel_folder.h"
#include "cl/private_file.h"
#include "kiln/version.h"

namespace kiln::ocl {
namespace {

namespace fs = std::filesystem;

// maximum size of a file; a valid one is smaller than 1 KiB
constexpr std::size_t kMaxTuningBytes = std::size_t{1} << 16;

struct Group {
  std::string_view key;
  std::uint32_t Tuning::*member;
};
constexpr std::array<Group, 5> kGroups{{{"ray_group", &Tuning::ray_group},
                                        {"closest_group", &Tuning::closest_group},
                                        {"occlusion_group", &Tuning::occlusion_group},
                                        {"raster_group", &Tuning::raster_group},
                                        {"view_group", &Tuning::view_group}}};
constexpr std::string_view kMinTrianglesKey = "min_device_build_triangles";

std::string quote(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) {
      char code[8];
      std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned>(c));
      quoted += code;
      continue;
    }
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

/// Reads a flat JSON object: keys with strings, non-negative integers or null as values. (The JSON library is part of
/// the rooms of files, which builds may leave out.)
class FlatObject {
 public:
  struct Value {
    bool is_text = false;
    std::string text;                     ///< Of a string
    std::optional<std::uint64_t> number;  ///< nullopt: null
  };

  /// \returns false if the text is not such an object
  bool parse(std::string_view text) {
    rest_ = text;
    if (!take('{')) return false;
    if (!take('}')) {
      do {
        std::string key;
        Value value;
        if (!take_string(key) || !take(':') || !take_value(value)) return false;
        if (!values_.emplace(std::move(key), std::move(value)).second) return false;
      } while (take(','));
      if (!take('}')) return false;
    }
    skip_space();
    return rest_.empty();
  }
  const Value* find(std::string_view key) const {
    const auto found = values_.find(key);
    return found == values_.end() ? nullptr : &found->second;
  }
  /// The string of a key; empty if there is none.
  std::string text(std::string_view key) const {
    const Value* value = find(key);
    return value != nullptr && value->is_text ? value->text : std::string();
  }

 private:
  void skip_space() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
  }
  bool take(char wanted) {
    skip_space();
    if (rest_.empty() || rest_.front() != wanted) return false;
    rest_.remove_prefix(1);
    return true;
  }
  bool take_string(std::string& text) {
    if (!take('"')) return false;
    while (!rest_.empty()) {
      const char c = rest_.front();
      rest_.remove_prefix(1);
      if (c == '"') return true;
      if (static_cast<unsigned char>(c) < 0x20) return false;
      if (c != '\\') {
        text += c;
        continue;
      }
      if (rest_.empty()) return false;
      const char escaped = rest_.front();
      rest_.remove_prefix(1);
      if (escaped == '"' || escaped == '\\' || escaped == '/') {
        text += escaped;
        continue;
      }
      // format_tuning() writes control characters so; other escapes name no device.
      unsigned code = 0;
      if (escaped != 'u' || rest_.size() < 4) return false;
      const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + 4, code, 16);
      if (error != std::errc() || end != rest_.data() + 4 || code >= 0x20) return false;
      text += static_cast<char>(code);
      rest_.remove_prefix(4);
    }
    return false;
  }
  bool take_value(Value& value) {
    skip_space();
    if (rest_.starts_with('"')) {
      value.is_text = true;
      return take_string(value.text);
    }
    if (rest_.starts_with("null")) {
      rest_.remove_prefix(4);
      return true;
    }
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), number);
    if (error != std::errc()) return false;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    value.number = number;
    return true;
  }

  std::string_view rest_;
  std::map<std::string, Value, std::less<>> values_;
};

std::mutex warnings_mutex;
std::vector<Warning>& recorded_warnings() {
  static auto* const warnings =
      new std::vector<Warning>();  // never freed: destructors may still ask for it
  return *warnings;
}

void record_warning(const fs::path& file, const std::string& problem) {
  const std::lock_guard lock(warnings_mutex);
  Warning warning{"tuning",
                  "The tuning in '" + file.string() + "' is ignored: " + problem +
                      ". 'kiln devices --tune' writes a new one, or remove the file.",
                  1};
  std::vector<Warning>& warnings = recorded_warnings();
  const bool is_known = std::any_of(warnings.begin(), warnings.end(), [&](const Warning& known) {
    return known.message == warning.message;
  });
  if (!is_known) warnings.push_back(std::move(warning));
}

/// The text of a file; nullopt if there is none. \param problem [out] why an existing file is not read, else empty
std::optional<std::string> read_text(const fs::path& file, std::string& problem) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(file, ignored))) return std::nullopt;
  if (os::find_unsafe_level(file).filename() == file.filename()) {
    problem = "other users may write to it";
    return std::nullopt;
  }
  if (!fs::is_regular_file(file, ignored)) {
    problem = "it is no file";
    return std::nullopt;
  }
  std::FILE* const stream = std::fopen(file.string().c_str(), "rb");
  if (stream == nullptr) {
    problem = "it cannot be read";
    return std::nullopt;
  }
  std::string text(kMaxTuningBytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), stream));
  std::fclose(stream);
  if (text.size() <= kMaxTuningBytes) return text;
  problem = "it is too large";
  return std::nullopt;
}

}  // namespace

fs::path tuning_file(const DeviceInfo& device) {
  char name[32];
  std::snprintf(name, sizeof name, "%016llx.json",
                static_cast<unsigned long long>(
                    fnv1a(device.name + '\n' + device.platform + '\n' + device.driver)));
  return kernel_folder().kiln / "tuning" / name;
}

std::string format_tuning(const DeviceInfo& device, const Tuning& tuning) {
  std::string text =
      "{\n  \"device\": " + quote(device.name) + ",\n  \"platform\": " + quote(device.platform) +
      ",\n  \"driver\": " + quote(device.driver) + ",\n  \"kiln\": " + quote(version()) +
      ",\n  \"" + std::string(kMinTrianglesKey) + "\": " +
      (tuning.min_device_build_triangles == Tuning::kNever
           ? "null"
           : std::to_string(tuning.min_device_build_triangles));
  for (const Group& group : kGroups) {
    const std::uint32_t size = tuning.*group.member;
    text +=
        ",\n  \"" + std::string(group.key) + "\": " + (size == 0 ? "null" : std::to_string(size));
  }
  return text + "\n}\n";
}

Tuning parse_tuning(std::string_view text, const DeviceInfo& device, std::string& problem) {
  problem.clear();
  FlatObject object;
  if (!object.parse(text)) {
    problem = "it is not the JSON that Kiln writes";
    return {};
  }
  if (object.text("device").empty() || object.text("kiln").empty()) {
    problem = "it names no device and no version of Kiln";
    return {};
  }
  if (object.text("device") != device.name || object.text("platform") != device.platform) {
    problem = "it is that of '" + object.text("device") + "', not of '" + device.name + "'";
    return {};
  }
  if (object.text("kiln") != version() || object.text("driver") != device.driver) return {};
  Tuning tuning;
  const FlatObject::Value* const triangles = object.find(kMinTrianglesKey);
  if (triangles == nullptr || triangles->is_text) {
    problem = std::string(kMinTrianglesKey) + " must be a number of triangles, or null";
    return {};
  }
  tuning.min_device_build_triangles = triangles->number.value_or(Tuning::kNever);
  for (const Group& group : kGroups) {
    const FlatObject::Value* const value = object.find(group.key);
    const std::uint64_t size = value == nullptr ? 0 : value->number.value_or(1);
    if (value == nullptr || value->is_text || !std::has_single_bit(size) ||
        size > Tuning::kMaxGroup) {
      problem = std::string(group.key) + " must be a power of two up to " +
                std::to_string(Tuning::kMaxGroup) + ", or null";
      return {};
    }
    if (value->number) tuning.*group.member = static_cast<std::uint32_t>(size);
  }
  return tuning;
}

Tuning load_tuning(const DeviceInfo& device) {
  const fs::path file = tuning_file(device);
  std::string problem;
  Tuning tuning;
  if (const std::optional<std::string> text = read_text(file, problem))
    tuning = parse_tuning(*text, device, problem);
  if (!problem.empty()) record_warning(file, problem);
  if (const char* builder = std::getenv("KILN_BVH_BUILDER")) {
    if (std::string_view(builder) == "device") tuning.min_device_build_triangles = 0;
    if (std::string_view(builder) == "host") tuning.min_device_build_triangles = Tuning::kNever;
  }
  return tuning;
}

void store_tuning(const DeviceInfo& device, const Tuning& tuning) {
  const fs::path file = tuning_file(device);
  if (replace_private_file(file, format_tuning(device, tuning))) return;
  throw Error(ErrorCode::output, "The tuning cannot be written to '" + file.string() +
                                     "'. Set POCL_CACHE_DIR to a folder that you may write to.");
}

std::vector<Warning> tuning_warnings() {
  const std::lock_guard lock(warnings_mutex);
  return recorded_warnings();
}

}  // namespace kiln::ocl
