// Custom maps: the caller supplies a function in OpenCL C that computes the map's value from the
// matched point.
#include "detail/own.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cmath>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <utility>

#include "base/counted.h"
#include "base/formatted.h"
#include "base/option.h"
#include "base/parallel.h"
#include "base/stopwatch.h"
#include "cl/driver.h"
#include "detail/device_shading.h"
#include "image/gutter.h"
#include "mesh/kernels_shared.h"
#include "shared/own.h"
#include "source/high_poly_uvs.h"

namespace kiln {
namespace {

constexpr std::size_t kTexelsPerTask = 1 << 12;
// Number of samples per launch. It limits the time of a launch if the function is expensive.
constexpr std::uint32_t kSamplesPerLaunch = 1U << 16;

class OwnMapMaker : public MapMaker {
 public:
  OwnMapMaker(const MapRequest& request, const OwnMap& map, std::string_view name)
      : context_(context_of(request.source.device)),
        source_(request.source),
        reads_(request.reads()),
        name_(name),
        message_label_(map.file.empty() ? map.name : map.name + " ('" + map.file + "')"),
        channels_(map.channels),
        seconds_(request.options.own_map_seconds),
        two_sided_(request.options.match.two_sided),
        map_origin_(map_origin(request.options, request.source.frame)),
        kernel_(build(map, request.source.device)),
        shading_(device_shading(context_, request.surface)) {
    triangles_ = cl::Array<std::uint32_t>(
        context_,
        std::span<const std::uint32_t>(source_.triangles[0].data(), source_.triangles.size() * 3));
    if (!has_uvs(source_)) return;
    uvs_ = cl::Array<float>(context_,
                            std::span<const float>(&source_.uvs[0].x, source_.uvs.size() * 2));
    uv_triangles_ = cl::Array<std::uint32_t>(
        context_, std::span<const std::uint32_t>(source_.uv_triangles[0].data(),
                                                 source_.uv_triangles.size() * 3));
  }

  void run(const TexelBand& band, const DeviceCorrespondence& match,
           const BandPixels& out) override {
    if (band.sample_count == 0) return;
    average(band, match, values_of(band, match), out);
  }

  void run_blended(const TexelBand& band, const DeviceCorrespondence& match,
                   const DeviceCorrespondence& other, const cl::Array<float>& shares,
                   const BandPixels& out) override {
    if (band.sample_count == 0) return;
    std::vector<float> values = values_of(band, match);
    const std::vector<float> other_values = values_of(band, other);
    const std::vector<std::uint32_t>& triangle = reads_->read(other.triangle, band.sample_count);
    const std::vector<float>& share = reads_->read(shares, band.sample_count);
    for (std::size_t s = 0; s < band.sample_count; ++s) {
      if (triangle[s] == KILN_NO_TRIANGLE) continue;
      for (std::size_t c = 0; c < 4; ++c) {
        float& value = values[s + c * band.capacity];
        value = value * share[s] + other_values[s + c * band.capacity] * (1 - share[s]);
      }
    }
    average(band, match, values, out);
  }

  void report(BakedMap&, std::vector<Warning>& warnings) const override {
    if (nonfinite_count_ == 0) return;
    warnings.push_back(
        {"own-map-non-finite",
         "The map " + std::string(name_) + " is NaN or infinite at " +
             counted(nonfinite_count_, "texel") +
             (nonfinite_count_ == 1 ? ", which was set to 0." : ", which were set to 0."),
         nonfinite_count_});
  }

 private:
  cl::Kernel build(const OwnMap& map, const Device& device) {
    const cl::OwnMapRun run_scope(message_label_, seconds_);
    Stopwatch stopwatch;
    try {
      cl::Kernel kernel = context_.kernel_with("own", "kiln_own_evaluate", map.source, map.file);
      seconds_to_compile_ = std::max(0.0, seconds_ - stopwatch.lap());
      return kernel;
    } catch (const Error&) {
      // If a compilation exceeds its time limit, its thread runs on and still uses the device's
      // context. Such devices are therefore never released.
      static auto* const unreleased_devices = new std::vector<Device>();
      static std::mutex mutex;
      const std::lock_guard lock(mutex);
      if (driver_failed()) unreleased_devices->push_back(device);
      throw;
    }
  }

  /// Uploads the positions again if vertices may have moved since the last band.
  void upload() {
    if (source_version_ == reads_->source_version() && !positions_.empty()) return;
    if (positions_.empty()) positions_ = cl::Array<float>(context_, source_.positions.size() * 3);
    positions_.write(context_,
                     std::span<const float>(&source_.positions[0].x, source_.positions.size() * 3));
    source_version_ = reads_->source_version();
  }

  /// Computes the values of a band's samples: four planes of the band's capacity.
  std::vector<float> values_of(const TexelBand& band, const DeviceCorrespondence& match) {
    upload();
    if (values_.size() < std::size_t{4} * band.capacity) {
      values_ = cl::Array<float>();
      values_ = cl::Array<float>(context_, std::size_t{4} * band.capacity);
    }
    const Tree& tree = source_.rays().tree();
    kiln_user_map_params params{};
    params.low_capacity = params.out_capacity = band.capacity;
    params.hit_capacity = match.capacity;
    params.two_sided = two_sided_ ? 1 : 0;
    params.has_uvs = uvs_.empty() ? 0 : 1;
    params.has_match = match.distance.empty() || match.status.empty() ? 0 : 1;
    params.scale = static_cast<float>(source_.frame.scale);
    params.center_x = static_cast<float>(source_.frame.center[0] - map_origin_[0]);
    params.center_y = static_cast<float>(source_.frame.center[1] - map_origin_[1]);
    params.center_z = static_cast<float>(source_.frame.center[2] - map_origin_[2]);
    // Waits for earlier commands, so that their time and errors are not attributed to the caller's
    // function
    context_.finish();
    auto run_scope = std::make_unique<cl::OwnMapRun>(message_label_, seconds_);
    for (; params.first < band.sample_count; params.first = params.end) {
      params.end = params.first + std::min(kSamplesPerLaunch, band.sample_count - params.first);
      const auto launch = [&](const kiln_user_map_params& of) {
        context_.launch(kernel_, params.end - params.first, kLocal, of, band.triangle,
                        band.barycentric, band.points, shading_, match.triangle, match.barycentric,
                        match.distance, match.status, positions_, triangles_,
                        source_.attributes.normal_indices, source_.attributes.normals, uvs_,
                        uv_triangles_, tree.nodes, tree.blocks, values_);
      };
      if (!std::exchange(is_compiled_, true)) {
        // At the first launch, PoCL compiles the kernel again for the size of its work-groups. This
        // launch has the same size but no samples, so that the compilation is timed separately from
        // the function.
        kiln_user_map_params none = params;
        none.end = none.first;
        launch(none);
        if (!context_.finish_within(seconds_to_compile_))
          run_scope.release()->abandon_compilation();
      }
      launch(params);
      if (context_.finish_within(seconds_)) continue;
      [[maybe_unused]] const auto* const leaked_scope = run_scope.release();
      const std::string limit = formatted("%g s", seconds_);
      throw Error(ErrorCode::input, "The map " + message_label_ + " did not finish " +
                                        std::to_string(params.end - params.first) + " samples in " +
                                        limit +
                                        ": its function may never return. Correct it, or raise " +
                                        option("own_map_seconds") + ".");
    }
    std::vector<float> values(std::size_t{4} * band.capacity);
    values_.read(context_, values);
    return values;
  }

  void average(const TexelBand& band, const DeviceCorrespondence& match,
               std::span<const float> values, const BandPixels& out) {
    const std::vector<std::uint32_t>& index = reads_->read(band.texel_index, band.texel_count);
    const std::vector<std::uint32_t>& first =
        reads_->read(band.texel_first, band.texel_count + std::size_t{1});
    const std::vector<std::uint32_t>& triangle = reads_->read(match.triangle, band.sample_count);
    parallel_for(band.texel_count, kTexelsPerTask, [&](std::size_t begin, std::size_t end) {
      std::uint64_t nonfinite_count = 0;
      for (std::size_t t = begin; t < end; ++t) {
        std::array<double, 4> sum{};
        std::size_t sample_count = 0;
        for (std::size_t s = first[t]; s < first[t + 1]; ++s) {
          if (triangle[s] == KILN_NO_TRIANGLE) continue;
          for (std::size_t c = 0; c < channels_; ++c) sum[c] += values[s + c * band.capacity];
          ++sample_count;
        }
        out.coverage[index[t]] = sample_count != 0 ? kCoverageBaked : kCoverageMissed;
        bool is_finite_value = true;
        for (std::size_t c = 0; c < channels_; ++c) {
          const double value = sample_count != 0 ? sum[c] / static_cast<double>(sample_count) : 0;
          is_finite_value = is_finite_value && std::isfinite(value);
          out.values[index[t] * channels_ + c] =
              std::isfinite(value) ? static_cast<float>(value) : 0.0F;
        }
        nonfinite_count += is_finite_value ? 0 : 1;
      }
      nonfinite_count_ += nonfinite_count;
    });
  }

  cl::Context& context_;
  const Source::Impl& source_;
  std::shared_ptr<BandReads> reads_;
  std::string_view name_;
  std::string message_label_;
  std::size_t channels_;
  double seconds_;
  // Seconds of the time limit that remained after the driver's first compilation
  double seconds_to_compile_ = 0;
  bool is_compiled_ = false;  // True once the kernel was launched, which completes its compilation
  bool two_sided_;
  std::array<double, 3> map_origin_;
  cl::Kernel kernel_;
  cl::Array<kiln_low_shading> shading_;
  cl::Array<std::uint32_t> triangles_, uv_triangles_;
  cl::Array<float> positions_, uvs_, values_;
  std::uint64_t source_version_ = 0;
  std::atomic<std::uint64_t> nonfinite_count_{0};
};

/// Simplifies a source so that it can be checked: replaces digraphs and trigraphs of #, joins
/// continued lines, replaces comments by blanks, and empties strings.
std::string preprocessed(std::string_view source) {
  std::string joined_lines;
  for (std::size_t i = 0; i < source.size();) {
    const std::string_view remaining = source.substr(i);
    const std::size_t slash = remaining.starts_with("?\?/") ? 3 : remaining[0] == '\\' ? 1 : 0;
    const std::size_t end =
        slash == 0 ? remaining.npos : remaining.find_first_not_of(" \t\r", slash);
    const std::size_t hash = remaining.starts_with("?\?=") ? 3
                             : remaining.starts_with("%:") ? 2
                                                           : 0;
    if (end != remaining.npos && remaining[end] == '\n') {
      i += end + 1;
      continue;
    }
    joined_lines += hash != 0 ? '#' : remaining[0];
    i += std::max<std::size_t>(hash, 1);
  }
  std::string without_comments;
  for (std::size_t i = 0; i < joined_lines.size();) {
    const std::size_t begin = i;
    if (joined_lines.compare(i, 2, "//") == 0) {
      i = std::min(joined_lines.find('\n', i), joined_lines.size());
    } else if (joined_lines.compare(i, 2, "/*") == 0) {
      i = std::min(joined_lines.find("*/", i + 2), joined_lines.size() - 2) + 2;
      without_comments += ' ';
      without_comments.append(
          static_cast<std::size_t>(std::count(&joined_lines[begin], &joined_lines[0] + i, '\n')),
          '\n');
    } else {
      const char quote = joined_lines[i++];
      while ((quote == '"' || quote == '\'') && i < joined_lines.size() &&
             joined_lines[i] != '\n') {
        if (joined_lines[i] == '\\') ++i;
        if (i < joined_lines.size() && joined_lines[i++] == quote) break;
      }
      i = std::min(i, joined_lines.size());
      without_comments += quote;
      if (i - begin > 1) without_comments += quote;
    }
  }
  return without_comments;
}

bool has_assembly(std::string_view line) {
  const auto is_word_character = [&](std::size_t i) {
    return std::isalnum(static_cast<unsigned char>(line[i])) != 0 || line[i] == '_';
  };
  std::size_t end = 0;
  for (std::size_t begin = line.find("asm"); begin != line.npos; begin = line.find("asm", end)) {
    end = begin + 3;
    while (begin > 0 && is_word_character(begin - 1)) --begin;
    while (end < line.size() && is_word_character(end)) ++end;
    const std::string_view word = line.substr(begin, end - begin);
    if (word == "asm" || word == "__asm" || word == "__asm__") return true;
  }
  return false;
}

/// Rejects sources that would compile but could not run, or that would fail with an unclear error
/// of the linker.
void check_source(const OwnMap& map) {
  const auto fail = [&](const std::string& problem) {
    throw Error(ErrorCode::input, "The map " + map.name + " ('" + map.file + "') " + problem);
  };
  const std::string source = preprocessed(map.source);
  if (source.find("kiln_map") == std::string::npos) {
    fail("has no function kiln_map(): write float4 kiln_map(const kiln_point* p) { ... }.");
  }
  std::istringstream source_lines(source);
  std::string line;
  for (std::size_t number = 1; std::getline(source_lines, line); ++number) {
    if (has_assembly(line)) {
      fail("contains inline assembly in line " + std::to_string(number) +
           ", which not every device can run: write OpenCL C.");
    }
    const auto skip_blanks = [&](std::size_t from) { return line.find_first_not_of(" \t", from); };
    const std::size_t mark = skip_blanks(0);
    if (mark == std::string::npos || line[mark] != '#') continue;
    const std::size_t word = skip_blanks(mark + 1);
    if (word == std::string::npos ||
        (line.compare(word, 7, "include") != 0 && line.compare(word, 6, "import") != 0)) {
      continue;
    }
    fail("includes another file in line " + std::to_string(number) +
         ": a map must be a single file.");
  }
}

}  // namespace

MapRow own_map(const OwnMap& map) {
  check_source(map);
  if (map.channels != 1 && map.channels != 3 && map.channels != 4) {
    throw Error(ErrorCode::usage, "The map " + map.name + " has " + std::to_string(map.channels) +
                                      " channels: it must be 1, 3 or 4.");
  }
  MapRow row;
  row.info.kind = MapKind(map.name);
  row.info.channels = map.channels;
  row.info.type = MapType::vector;
  row.info.description = "value that the caller's function returns for the point";
  row.info.missed = MissedTexels::neighbours;
  row.info.options = "encoding.origin";
  row.follows_positions = row.reads_around = true;
  row.make = [name = row.info.kind.name,
              &map](const MapRequest& request) -> std::unique_ptr<MapMaker> {
    return std::make_unique<OwnMapMaker>(request, map, name);
  };
  return row;
}

}  // namespace kiln
