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
constexpr std::string_view kNoDeviceBuild = "never";  // value of kMinTrianglesKey
constexpr std::string_view kDefaultSize = "default";  // value of a group's key

/// A name of a device on one line: each control character becomes a space.
std::string one_line(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return text;
}

/// Values by their keys, of lines `KEY VALUE`; nullopt if the last line does not end, a line has no space, or a key
/// occurs twice.
std::optional<std::map<std::string_view, std::string_view>> parse_lines(std::string_view text) {
  std::map<std::string_view, std::string_view> values;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::size_t space = text.find(' ');
    if (end == text.npos || space >= end) return std::nullopt;
    if (!values.emplace(text.substr(0, space), text.substr(space + 1, end - space - 1)).second)
      return std::nullopt;
    text.remove_prefix(end + 1);
  }
  return values;
}

/// The whole number of a value; nullopt if it is none.
std::optional<std::uint64_t> to_number(std::string_view value) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size()) return std::nullopt;
  return number;
}

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
  std::snprintf(name, sizeof name, "%016llx.txt",
                static_cast<unsigned long long>(
                    fnv1a(device.name + '\n' + device.platform + '\n' + device.driver)));
  return kernel_folder().kiln / "tuning" / name;
}

std::string format_tuning(const DeviceInfo& device, const Tuning& tuning) {
  std::string text = "device " + one_line(device.name) + "\nplatform " + one_line(device.platform) +
                     "\ndriver " + one_line(device.driver) + "\nkiln " + version() + '\n' +
                     std::string(kMinTrianglesKey) + ' ' +
                     (tuning.min_device_build_triangles == Tuning::kNever
                          ? std::string(kNoDeviceBuild)
                          : std::to_string(tuning.min_device_build_triangles)) +
                     '\n';
  for (const Group& group : kGroups) {
    const std::uint32_t size = tuning.*group.member;
    text += std::string(group.key) + ' ' +
            (size == 0 ? std::string(kDefaultSize) : std::to_string(size)) + '\n';
  }
  return text;
}

Tuning parse_tuning(std::string_view text, const DeviceInfo& device, std::string& problem) {
  problem.clear();
  const auto values = parse_lines(text);
  if (!values) {
    problem = "its lines are not those that Kiln writes";
    return {};
  }
  const auto value_of = [&](std::string_view key) {
    const auto found = values->find(key);
    return found == values->end() ? std::string_view() : found->second;
  };
  if (value_of("device").empty() || value_of("kiln").empty()) {
    problem = "it names no device and no version of Kiln";
    return {};
  }
  if (value_of("device") != one_line(device.name) ||
      value_of("platform") != one_line(device.platform)) {
    problem = "it is that of '" + std::string(value_of("device")) + "', not of '" +
              one_line(device.name) + "'";
    return {};
  }
  if (value_of("kiln") != version() || value_of("driver") != one_line(device.driver)) return {};
  Tuning tuning;
  if (const std::string_view value = value_of(kMinTrianglesKey); value != kNoDeviceBuild) {
    const std::optional<std::uint64_t> triangles = to_number(value);
    if (!triangles) {
      problem = std::string(kMinTrianglesKey) + " must be a number of triangles, or " +
                std::string(kNoDeviceBuild);
      return {};
    }
    tuning.min_device_build_triangles = *triangles;
  }
  for (const Group& group : kGroups) {
    const std::string_view value = value_of(group.key);
    if (value == kDefaultSize) continue;
    const std::uint64_t size = to_number(value).value_or(0);
    if (!std::has_single_bit(size) || size > Tuning::kMaxGroup) {
      problem = std::string(group.key) + " must be a power of two up to " +
                std::to_string(Tuning::kMaxGroup) + ", or " + std::string(kDefaultSize);
      return {};
    }
    tuning.*group.member = static_cast<std::uint32_t>(size);
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
