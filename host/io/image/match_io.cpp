#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "base/option.h"
#include "io/image/exr.h"
#include "io/image/exr_header.h"
#include "io/image/image_reader.h"
#include "io/image/match_reader.h"
#include "kiln/validate.h"
#include "shared/match.h"

namespace kiln {
namespace {

// Maximum side of a map in texel samples: the maximum side in texels times the maximum number of
// samples along a texel's side.
constexpr std::uint32_t kMaxSampleSide = 16384 * 16;
constexpr std::uint32_t kMaxSamplesPerTexelSide = 16;

constexpr const char* kMatchFileKind = "a saved match";
constexpr const char* kSamplesAttribute = "samples";
constexpr const char* kSourceTrianglesAttribute = "sourceTriangles";
constexpr const char* kSourceHashAttribute = "sourceHash";
constexpr const char* kLowHashAttribute = "lowHash";

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
                                    ". Save the match again with " + option("save_match()") + ".");
}

/// A frame buffer for reading or writing the channels of a match in memory.
Imf::FrameBuffer frame_buffer(const Match& match, const std::vector<std::uint32_t>& status_values) {
  static_assert(sizeof(float) == sizeof(std::uint32_t));
  const std::array<const void*, kChannels.size()> data = {
      match.distance.data(), status_values.data(), match.triangle.data(), match.u.data(),
      match.v.data()};
  Imf::FrameBuffer buffer;
  for (std::size_t i = 0; i < kChannels.size(); ++i) {
    buffer.insert(kChannels[i].name,
                  Imf::Slice(kChannels[i].type, static_cast<char*>(const_cast<void*>(data[i])),
                             sizeof(float), sizeof(float) * match.width));
  }
  return buffer;
}

/// Reads a 64-bit number that is stored as text; 0 if it is missing.
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
  const auto* samples = header.findTypedAttribute<Imf::IntAttribute>(kSamplesAttribute);
  const auto* triangles =
      header.findTypedAttribute<Imf::StringAttribute>(kSourceTrianglesAttribute);
  if (samples == nullptr || triangles == nullptr) {
    fail(file, "it lacks the attributes samples and sourceTriangles");
  }
  if (samples->value() < 1 || samples->value() > static_cast<int>(kMaxSamplesPerTexelSide)) {
    fail(file, "samples is " + std::to_string(samples->value()) + ", not 1 to 16");
  }
  match.samples = static_cast<std::uint32_t>(samples->value());
  const std::string& text = triangles->value();
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), match.source_triangles);
  if (error != std::errc() || end != text.data() + text.size() ||
      match.source_triangles > KILN_NO_TRIANGLE) {
    fail(file, "sourceTriangles is not a valid number of triangles");
  }
  match.source_hash = read_number(header, kSourceHashAttribute);
  match.low_hash = read_number(header, kLowHashAttribute);
  if (match.width % match.samples != 0 || match.height % match.samples != 0) {
    fail(file, "its width or height is not a multiple of its samples");
  }
}

/// Bytes per texel sample: the data of the match, and the status in the type that OpenEXR reads.
constexpr std::uint64_t kSampleBytes = 4 * sizeof(float) + 1 + sizeof(std::uint32_t);

Match read_match(const ByteSource& source, const std::string& file, const ExrPlan& plan) {
  ExrSource stream(source, file, plan);
  Imf::InputFile exr_input(stream, plan.threads);
  const Imf::Header& header = exr_input.header();
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
  require_memory("its " + std::to_string(count) + " samples", kSampleBytes * count + plan.buffers,
                 memory_failure(image_failure(file, kMatchFileKind), "dataWindow"));
  match.triangle.resize(count);
  match.u.resize(count);
  match.v.resize(count);
  match.distance.resize(count);
  match.status.resize(count);
  std::vector<std::uint32_t> status_values(count);
  exr_input.setFrameBuffer(frame_buffer(match, status_values));
  exr_input.readPixels(0, window.max.y);
  std::transform(
      status_values.begin(), status_values.end(), match.status.begin(),
      [](std::uint32_t value) { return static_cast<std::uint8_t>(std::min(value, 255U)); });
  return match;
}

}  // namespace

void save_match(const Match& match, const std::filesystem::path& path) {
  validate(match);
  Imf::Header header(static_cast<int>(match.width), static_cast<int>(match.height));
  // ZIP at its fastest level: barycentric weights and distances hardly compress at any level.
  header.compression() = Imf::ZIP_COMPRESSION;
  header.zipCompressionLevel() = 1;
  for (const ChannelType& channel : kChannels) {
    header.channels().insert(channel.name, Imf::Channel(channel.type));
  }
  header.insert(kSamplesAttribute, Imf::IntAttribute(static_cast<int>(match.samples)));
  header.insert(kSourceTrianglesAttribute,
                Imf::StringAttribute(std::to_string(match.source_triangles)));
  header.insert(kSourceHashAttribute, Imf::StringAttribute(std::to_string(match.source_hash)));
  header.insert(kLowHashAttribute, Imf::StringAttribute(std::to_string(match.low_hash)));
  const std::vector<std::uint32_t> status_values(match.status.begin(), match.status.end());
  write_exr(path, [&](ExrStream& stream) {
    Imf::OutputFile output(stream, header, exr_threads(0));
    output.setFrameBuffer(frame_buffer(match, status_values));
    output.writePixels(static_cast<int>(match.height));
  });
}

Match parse_match(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  // All failures get this remedy, which replaces that of the failed check.
  const FailWith failure = [inner = image_failure(file, kMatchFileKind)](const std::string& place,
                                                                         const std::string& problem,
                                                                         const Message&) {
    inner(place, problem, "Save the match again with " + option("save_match()") + ".");
  };
  const ExrPlan plan = check_exr(source, failure, kMaxSampleSide, limits);
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
  try {
    validate(match);
  } catch (const Error& error) {
    throw Error(ErrorCode::input,
                "Could not read '" + file + "' as a saved match. " + error.message() +
                    " Save it again with " + option("save_match()") + ".",
                error.id());
  }
  return match;
}

Match load_match(const std::filesystem::path& path) {
  const std::string file = path.string();
  const FailWith failure = image_failure(file, kMatchFileKind);
  const std::unique_ptr<ByteSource> source = open_file(path, failure);
  try {
    return parse_match(*source, file, {std::uint64_t{kMaxSampleSide} * kMaxSampleSide});
  } catch (const std::bad_alloc&) {
    failure("samples", "memory ran out",
            "Free some memory, or raise the " + option("memory_limit") + ".");
    throw;
  }
}

}  // namespace kiln
