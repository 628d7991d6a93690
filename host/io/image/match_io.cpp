#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "base/parallel.h"
#include "io/image/exr.h"
#include "io/image/exr_header.h"
#include "io/image/image_reader.h"
#include "io/image/match_reader.h"
#include "kiln/bake.h"
#include "shared/match.h"

namespace kiln {
namespace {

// A map's largest side times its most samples.
constexpr std::uint32_t kLargestSide = 16384 * 16;
constexpr std::uint32_t kMostSamples = 16;
// How far a barycentric weight may lie outside [0, 1] by rounding.
constexpr float kWeightSlack = 1e-3F;

constexpr const char* kKind = "a saved match";
constexpr const char* kSamples = "samples";
constexpr const char* kSourceTriangles = "sourceTriangles";
constexpr const char* kSourceHash = "sourceHash";
constexpr const char* kLowHash = "lowHash";

struct ChannelType {
  const char* name;
  Imf::PixelType type;
};
constexpr std::array<ChannelType, 5> kChannels = {{{"distance", Imf::FLOAT},
                                                   {"status", Imf::UINT},
                                                   {"triangle", Imf::UINT},
                                                   {"u", Imf::FLOAT},
                                                   {"v", Imf::FLOAT}}};

[[noreturn]] void fail(const std::string& file, const std::string& what) {
  throw Error(ErrorCode::input, "Could not read '" + file + "' as a saved match: " + what +
                                    ". Save the match again with save_match().");
}

template <typename T>
void add_slice(Imf::FrameBuffer& buffer, const char* name, Imf::PixelType type, const T* data,
               std::uint32_t width) {
  buffer.insert(name, Imf::Slice(type, reinterpret_cast<char*>(const_cast<T*>(data)), sizeof(T),
                                 sizeof(T) * width));
}

void check_sizes(const Match& match) {
  const std::size_t count = std::size_t{match.width} * match.height;
  if (count == 0 || match.width > kLargestSide || match.height > kLargestSide ||
      match.samples < 1 || match.samples > kMostSamples || match.width % match.samples != 0 ||
      match.height % match.samples != 0 || match.triangle.size() != count ||
      match.u.size() != count || match.v.size() != count || match.distance.size() != count ||
      match.status.size() != count) {
    throw Error(ErrorCode::usage,
                "A match of " + std::to_string(match.width) + " x " + std::to_string(match.height) +
                    " with " + std::to_string(match.samples) +
                    " samples cannot be saved: its arrays must have width x height elements, and "
                    "both sides must be multiples of samples (1 to 16).");
  }
}

bool is_weight(float value) { return value >= -kWeightSlack && value <= 1.0F + kWeightSlack; }

// What a sample that was found must satisfy; of the others only the status counts.
bool is_sound(const Match& match, std::size_t i) {
  const std::uint8_t status = match.status[i];
  if (status == KILN_STATUS_NONE || status == KILN_STATUS_MISS) return true;
  return status < KILN_STATUS_COUNT && match.triangle[i] < match.source_triangles &&
         is_weight(match.u[i]) && is_weight(match.v[i]) && is_weight(match.u[i] + match.v[i]) &&
         std::isfinite(match.distance[i]);
}

void check_contents(const Match& match, const std::string& file) {
  const std::size_t count = match.status.size();
  std::atomic<std::size_t> worst{count};
  parallel_for(count, std::size_t{1} << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (is_sound(match, i)) continue;
      std::size_t seen = worst;
      while (i < seen && !worst.compare_exchange_weak(seen, i)) {
      }
      return;
    }
  });
  if (worst == count) return;
  const std::size_t i = worst;
  fail(file, "sample " + std::to_string(i % match.width) + ", " + std::to_string(i / match.width) +
                 " has triangle " + std::to_string(match.triangle[i]) + " of " +
                 std::to_string(match.source_triangles) + ", weights " +
                 std::to_string(match.u[i]) + " and " + std::to_string(match.v[i]) + ", distance " +
                 std::to_string(match.distance[i]) + " and status " +
                 std::to_string(match.status[i]) + ", which cannot be");
}

/// A 64-bit number as text; 0 where there is none.
std::uint64_t read_number(const Imf::Header& header, const char* name) {
  const auto* attribute = header.findTypedAttribute<Imf::StringAttribute>(name);
  std::uint64_t value = 0;
  if (attribute != nullptr) {
    const std::string& text = attribute->value();
    const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
    if (result.ec != std::errc()) value = 0;
  }
  return value;
}

void read_attributes(const Imf::Header& header, const std::string& file, Match& match) {
  const auto* samples = header.findTypedAttribute<Imf::IntAttribute>(kSamples);
  const auto* triangles = header.findTypedAttribute<Imf::StringAttribute>(kSourceTriangles);
  if (samples == nullptr || triangles == nullptr) {
    fail(file, "it lacks the attributes samples and sourceTriangles");
  }
  if (samples->value() < 1 || samples->value() > static_cast<int>(kMostSamples)) {
    fail(file, "samples is " + std::to_string(samples->value()) + ", not 1 to 16");
  }
  match.samples = static_cast<std::uint32_t>(samples->value());
  const std::string& text = triangles->value();
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), match.source_triangles);
  if (error != std::errc() || end != text.data() + text.size() ||
      match.source_triangles > KILN_NO_TRIANGLE) {
    fail(file, "sourceTriangles is no number of triangles");
  }
  match.source_hash = read_number(header, kSourceHash);
  match.low_hash = read_number(header, kLowHash);
  if (match.width % match.samples != 0 || match.height % match.samples != 0) {
    fail(file, "its sides are no multiples of its samples");
  }
}

/// Bytes a sample: what a match keeps, and its status as OpenEXR reads it.
constexpr std::uint64_t kSampleBytes = 4 * sizeof(float) + 1 + sizeof(std::uint32_t);

Match read_match(const ByteSource& source, const std::string& file, const ExrPlan& plan) {
  ExrSource stream(source, file);
  Imf::InputFile input(stream, plan.threads);
  const Imf::Header& header = input.header();
  for (const ChannelType& channel : kChannels) {
    const Imf::Channel* found = header.channels().findChannel(channel.name);
    if (found == nullptr || found->type != channel.type || found->xSampling != 1 ||
        found->ySampling != 1) {
      fail(file, std::string("it has no channel '") + channel.name + "' of type " +
                     (channel.type == Imf::UINT ? "unsigned int" : "float"));
    }
  }
  const Imath::Box2i window = header.dataWindow();
  if (window.min.x != 0 || window.min.y != 0) fail(file, "its data window does not start at 0, 0");
  Match match;
  match.width = static_cast<std::uint32_t>(window.max.x + 1);
  match.height = static_cast<std::uint32_t>(window.max.y + 1);
  read_attributes(header, file, match);

  const std::size_t count = std::size_t{match.width} * match.height;
  check_memory(image_failure(file, kKind), "dataWindow",
               "its " + std::to_string(count) + " samples", kSampleBytes * count + plan.buffers);
  match.triangle.resize(count);
  match.u.resize(count);
  match.v.resize(count);
  match.distance.resize(count);
  match.status.resize(count);
  std::vector<std::uint32_t> status(count);
  Imf::FrameBuffer buffer;
  add_slice(buffer, "triangle", Imf::UINT, match.triangle.data(), match.width);
  add_slice(buffer, "u", Imf::FLOAT, match.u.data(), match.width);
  add_slice(buffer, "v", Imf::FLOAT, match.v.data(), match.width);
  add_slice(buffer, "distance", Imf::FLOAT, match.distance.data(), match.width);
  add_slice(buffer, "status", Imf::UINT, status.data(), match.width);
  input.setFrameBuffer(buffer);
  input.readPixels(0, window.max.y);
  std::transform(status.begin(), status.end(), match.status.begin(), [](std::uint32_t value) {
    return static_cast<std::uint8_t>(std::min(value, 255U));
  });
  return match;
}

}  // namespace

void save_match(const Match& match, const std::filesystem::path& path) {
  check_sizes(match);
  Imf::Header header(static_cast<int>(match.width), static_cast<int>(match.height));
  // Zlib's fastest level: weights and distances hardly compress at any.
  header.compression() = Imf::ZIP_COMPRESSION;
  header.zipCompressionLevel() = 1;
  for (const ChannelType& channel : kChannels) {
    header.channels().insert(channel.name, Imf::Channel(channel.type));
  }
  header.insert(kSamples, Imf::IntAttribute(static_cast<int>(match.samples)));
  header.insert(kSourceTriangles, Imf::StringAttribute(std::to_string(match.source_triangles)));
  header.insert(kSourceHash, Imf::StringAttribute(std::to_string(match.source_hash)));
  header.insert(kLowHash, Imf::StringAttribute(std::to_string(match.low_hash)));
  const std::vector<std::uint32_t> status(match.status.begin(), match.status.end());
  Imf::FrameBuffer buffer;
  add_slice(buffer, "triangle", Imf::UINT, match.triangle.data(), match.width);
  add_slice(buffer, "u", Imf::FLOAT, match.u.data(), match.width);
  add_slice(buffer, "v", Imf::FLOAT, match.v.data(), match.width);
  add_slice(buffer, "distance", Imf::FLOAT, match.distance.data(), match.width);
  add_slice(buffer, "status", Imf::UINT, status.data(), match.width);
  write_exr(path, [&](ExrStream& stream) {
    Imf::OutputFile output(stream, header, exr_threads(0));
    output.setFrameBuffer(buffer);
    output.writePixels(static_cast<int>(match.height));
  });
}

Match parse_match(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  // Of every failure, one remedy.
  const FailWith failure = [inner = image_failure(file, kKind)](const std::string& place,
                                                                const std::string& problem,
                                                                const std::string&) {
    inner(place, problem, "Save the match again with save_match().");
  };
  const ExrPlan plan = check_exr(source, failure, kLargestSide, limits);
  Match match;
  try {
    match = read_match(source, file, plan);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(file, error.what());
  }
  check_contents(match, file);
  return match;
}

Match load_match(const std::filesystem::path& path) {
  const std::string file = path.string();
  const FailWith failure = image_failure(file, kKind);
  const std::unique_ptr<ByteSource> source = open_file(path, failure);
  try {
    return parse_match(*source, file, {std::uint64_t{kLargestSide} * kLargestSide});
  } catch (const std::bad_alloc&) {
    failure("samples", "memory ran out", "Free some memory.");
    throw;
  }
}

}  // namespace kiln
