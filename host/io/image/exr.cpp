#include "io/image/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <ImfTileDescription.h>
#include <ImfTiledOutputFile.h>
#include <ImfVecAttribute.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/image/exr_header.h"
#include "io/image/image_reader.h"

namespace kiln {
namespace {

// Default compression. PIZ (wavelet and Huffman coding, lossless) is part of every OpenEXR.
//
// Measured at 4096^2 RGB half on two Zen 3 cores:
//
//                     detail in every texel   smooth, empty background
//   PIZ               0.38 s    51 MB         0.21 s   19 MB
//   ZIP, level 1      0.72 s    59 MB         0.30 s   17 MB
//   ZIP, level 4      0.92 s    57 MB         0.43 s   15 MB   (the default level)
//   ZIPS              0.86 s    60 MB         0.49 s   16 MB
//   RLE               0.28 s    81 MB         0.31 s   33 MB
//   none              0.10 s   101 MB
//   float: PIZ        2.1 s    158 MB         1.9 s   107 MB
//   float: ZIP 4      4.9 s    194 MB         2.9 s   131 MB
constexpr Imf::Compression kCompression = Imf::PIZ_COMPRESSION;

// Side of the tiles of a mip-map; bands are complete rows of tiles. PIZ initialises tables of
// 65,536 entries for every tile, so small tiles are slow.
//
// Measured with the bunny's map at 4096^2 RGB and its levels, on two cores of a loaded AMD EPYC
// with AVX-512:
//
//   side    half               float
//   64      1.6 s    24 MB     5.6 s   127 MB
//   128     0.6 s    22 MB     3.0 s   114 MB
//   256     0.35 s   22 MB     2.3 s   109 MB
constexpr std::uint32_t kTileSize = 256;

constexpr std::array<std::array<const char*, 4>, 5> kNames = {
    {{}, {"Y"}, {"R", "G"}, {"R", "G", "B"}, {"R", "G", "B", "A"}}};

// Makes a slice in which pixel (x, y) lies at base + (y * width + x) * stride.
template <typename T>
Imf::Slice make_slice(Imf::PixelType type, T* base, std::int64_t x0, std::int64_t y0,
                      std::size_t stride, std::size_t row) {
  const auto origin =
      reinterpret_cast<std::intptr_t>(base) -
      static_cast<std::intptr_t>(sizeof(T)) *
          (x0 * static_cast<std::intptr_t>(stride) + y0 * static_cast<std::intptr_t>(row));
  return {type, reinterpret_cast<char*>(origin), stride * sizeof(T), row * sizeof(T)};
}

// Names of the channels to read, in order; empty if they do not form an image.
std::vector<std::string> choose_channels(const Imf::ChannelList& list) {
  std::vector<std::string> layer_prefixes = {""};
  for (auto it = list.begin(); it != list.end(); ++it) {
    const std::string name = it.name();
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) continue;
    const std::string prefix = name.substr(0, dot + 1);
    if (std::find(layer_prefixes.begin(), layer_prefixes.end(), prefix) == layer_prefixes.end()) {
      layer_prefixes.push_back(prefix);
    }
  }
  const std::array<std::vector<const char*>, 7> sets = {{{"R", "G", "B", "A"},
                                                         {"R", "G", "B"},
                                                         {"R", "G"},
                                                         {"R"},
                                                         {"X", "Y", "Z"},
                                                         {"Y", "A"},
                                                         {"Y"}}};
  for (const std::string& prefix : layer_prefixes) {
    for (const auto& set : sets) {
      std::vector<std::string> names;
      for (const char* name : set) {
        if (list.findChannel(prefix + name) != nullptr) names.push_back(prefix + name);
      }
      if (names.size() == set.size()) return names;
    }
  }
  return {};
}

std::string list_channels(const Imf::ChannelList& list) {
  std::string text;
  for (auto it = list.begin(); it != list.end(); ++it) {
    text += (text.empty() ? "" : ", ") + std::string(it.name());
  }
  return text;
}

bool lies_inside(const Imath::Box2i& inner, const Imath::Box2i& outer) {
  return inner.min.x >= outer.min.x && inner.min.y >= outer.min.y && inner.max.x <= outer.max.x &&
         inner.max.y <= outer.max.y;
}

std::vector<std::string> checked_channels(const Imf::ChannelList& list, const FailWith& fail) {
  std::vector<std::string> names = choose_channels(list);
  if (names.empty()) {
    fail("channels", "it holds " + list_channels(list) + ", but R, G, B, A or Y are needed",
         "Save it with these channels.");
  }
  for (const std::string& name : names) {
    const Imf::Channel& channel = list[name];
    if (channel.xSampling != 1 || channel.ySampling != 1) {
      fail("channels", name + " is subsampled", "Save it at full resolution.");
    }
  }
  if (list.findChannel("RY") != nullptr || list.findChannel("BY") != nullptr) {
    fail("channels", "it holds luminance and chroma", "Save it as RGB.");
  }
  return names;
}

Image read_exr(const ByteSource& source, const std::string& name, const FailWith& fail,
               const ExrPlan& plan) {
  ExrSource stream(source, name, plan);
  Imf::InputFile file(stream, plan.threads);
  const std::vector<std::string> names = checked_channels(file.header().channels(), fail);
  const Imath::Box2i data = file.header().dataWindow();
  const Imath::Box2i display = file.header().displayWindow();
  const Imath::Box2i window = lies_inside(data, display) ? display : data;
  Image image;
  image.width = static_cast<std::uint32_t>(window.max.x - window.min.x + 1);
  image.height = static_cast<std::uint32_t>(window.max.y - window.min.y + 1);
  image.channels = static_cast<std::uint32_t>(names.size());
  const std::size_t count = std::size_t{image.width} * image.height * image.channels;
  require_memory(
      "its " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels",
      count * sizeof(float) + plan.buffers, memory_failure(fail, "dataWindow"));
  image.pixels.resize(count);
  Imf::FrameBuffer buffer;
  for (std::size_t i = 0; i < names.size(); ++i) {
    buffer.insert(names[i],
                  make_slice(Imf::FLOAT, image.pixels.data() + i, window.min.x, window.min.y,
                             image.channels, std::size_t{image.width} * image.channels));
  }
  file.setFrameBuffer(buffer);
  file.readPixels(data.min.y, data.max.y);
  return image;
}

// Calls write(buffer, first row, number of rows) for each band of an image in turn. The buffer
// holds the band's pixels, converted to T. The image begins at row `top` of the file.
template <typename T, typename Write>
void for_each_band(const Image& image, std::size_t top, Imf::PixelType type, int threads,
                   const Write& write) {
  const std::size_t row = std::size_t{image.width} * image.channels;
  std::vector<T> band;
  for (std::size_t first = 0; first < image.height; first += kExrBandRows) {
    const std::size_t count = std::min<std::size_t>(kExrBandRows, image.height - first);
    convert_rows(image, first, count, band, threads);
    Imf::FrameBuffer buffer;
    for (std::size_t i = 0; i < image.channels; ++i) {
      buffer.insert(kNames[image.channels][i],
                    make_slice(type, band.data() + i, 0, static_cast<std::int64_t>(top + first),
                               image.channels, row));
    }
    write(buffer, static_cast<int>(top + first), static_cast<int>(count));
  }
}

template <typename T>
void write_rows(const Image& image, std::size_t top, Imf::OutputFile& output, Imf::PixelType type,
                int threads) {
  for_each_band<T>(image, top, type, threads,
                   [&](const Imf::FrameBuffer& buffer, int /*first*/, int count) {
                     output.setFrameBuffer(buffer);
                     output.writePixels(count);
                   });
}

template <typename T>
void write_tiles(const Image& image, int level, Imf::TiledOutputFile& output, Imf::PixelType type,
                 int threads) {
  static_assert(kExrBandRows % kTileSize == 0);
  constexpr int kTile = kTileSize;
  for_each_band<T>(image, 0, type, threads,
                   [&](const Imf::FrameBuffer& buffer, int first, int count) {
                     output.setFrameBuffer(buffer);
                     output.writeTiles(0, output.numXTiles(level) - 1, first / kTile,
                                       (first + count - 1) / kTile, level);
                   });
}

Imf::PixelType pixel_type(const SaveImageOptions& options) {
  return options.format == ImageFormat::exr_half ? Imf::HALF : Imf::FLOAT;
}

Imf::Header make_header(const ImageShape& shape, const SaveImageOptions& options) {
  Imf::Header header(static_cast<int>(shape.width), static_cast<int>(shape.height));
  header.compression() = kCompression;
  for (std::size_t i = 0; i < shape.channels; ++i) {
    header.channels().insert(kNames[shape.channels][i], Imf::Channel(pixel_type(options)));
  }
  put_texts(header, "", options.origin, options.texts);
  return header;
}

}  // namespace

void put_texts(Imf::Header& header, const std::string& prefix, const std::array<double, 3>& origin,
               const std::vector<ImageText>& texts) {
  if (origin != std::array<double, 3>{}) {
    header.insert(prefix + "origin",
                  Imf::V3dAttribute(Imath::V3d(origin[0], origin[1], origin[2])));
  }
  for (const ImageText& text : texts) {
    const std::string name = prefix + text.keyword;
    if (header.find(name.c_str()) != header.end()) {
      throw Error(
          ErrorCode::usage,
          "The text '" + name + "' cannot be written: OpenEXR has an attribute of that name.");
    }
    header.insert(name, Imf::StringAttribute(text.text));
  }
}

void check_texts(const std::vector<ImageText>& texts) {
  constexpr std::size_t kMaxKeywordLength = 79;  // Maximum length of a PNG keyword
  const auto printable = [](const std::string& text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
  };
  for (const ImageText& text : texts) {
    const std::string& word = text.keyword;
    if (word.empty() || word.size() > kMaxKeywordLength || word.front() == ' ' ||
        word.back() == ' ' || !printable(word) || !printable(text.text)) {
      throw Error(ErrorCode::usage,
                  "The text '" + word + "' = '" + text.text +
                      "' cannot be written into a picture: give a keyword of 1 to "
                      "79 characters without a blank at an end, all printable ASCII.");
    }
  }
}

bool ExrSource::read(char bytes[], int count) {
  const auto wanted = static_cast<std::size_t>(std::max(count, 0));
  if (source_.read_at(position_, bytes, wanted) != wanted) {
    throw std::runtime_error("the file ends at byte " + std::to_string(source_.size()) +
                             " (truncated)");
  }
  for (const std::uint64_t place : plan_.manifests) {
    if (place >= position_ && place - position_ < wanted) bytes[place - position_] = 'I';
  }
  position_ += wanted;
  return position_ < source_.size();
}

ExrStream::ExrStream(AtomicFile& file)
    : Imf::OStream(file.destination().string().c_str()), file_(file) {}

void ExrStream::write(const char bytes[], int count) {
  try {
    file_.write(bytes, static_cast<std::size_t>(count));
  } catch (...) {
    if (!error_) error_ = std::current_exception();
    throw;
  }
  position_ += static_cast<std::uint64_t>(count);
}

void ExrStream::seekp(std::uint64_t position) {
  if (fseeko(file_.stream(), static_cast<off_t>(position), SEEK_SET) != 0) {
    const int number = errno;
    try {
      file_.fail("OpenEXR files cannot be written to a pipe or device", number);
    } catch (...) {
      if (!error_) error_ = std::current_exception();
      throw;
    }
  }
  position_ = position;
}

void ExrStream::check() const {
  if (error_) std::rethrow_exception(error_);
}

int exr_threads(int threads) {
  static std::once_flag once;
  std::call_once(once, [] {
    if (Imf::globalThreadCount() == 0) Imf::setGlobalThreadCount(thread_count());
  });
  return threads > 0 ? threads : thread_count();
}

namespace {

ImageShape shape_of(const Image& image) { return {image.width, image.height, image.channels}; }

/// Writes the rows of an image, which begins at row `top` of the file.
void write_rows(const Image& image, std::size_t top, const SaveImageOptions& options,
                Imf::OutputFile& output) {
  if (options.format == ImageFormat::exr_half) {
    write_rows<Imath::half>(image, top, output, Imf::HALF, options.threads);
  } else {
    write_rows<float>(image, top, output, Imf::FLOAT, options.threads);
  }
}

void write_image(const Image& image, const SaveImageOptions& options, Imf::OStream& stream) {
  Imf::OutputFile output(stream, make_header(shape_of(image), options),
                         exr_threads(options.threads));
  write_rows(image, 0, options, output);
}

/// An OpenEXR file that is written row by row. OpenEXR keeps the rows of an incomplete block.
class ExrRows : public ImageRows {
 public:
  ExrRows(const ImageShape& shape, const std::filesystem::path& path,
          const SaveImageOptions& options)
      : height_(shape.height), options_(options), file_(path), stream_(file_) {
    name_exr_errors(file_, stream_, [&] {
      output_.emplace(stream_, make_header(shape, options), exr_threads(options.threads));
    });
  }

  void put(const Image& rows) override {
    name_exr_errors(file_, stream_, [&] { write_rows(rows, next_row_, options_, *output_); });
    stream_.check();
    next_row_ += rows.height;
  }

  void commit() override {
    if (next_row_ != height_) {
      throw Error(ErrorCode::internal,
                  "'" + file_.destination().string() + "' was finished before its last row.");
    }
    output_.reset();
    stream_.check();
    file_.commit();
  }

 private:
  std::size_t height_;
  SaveImageOptions options_;
  AtomicFile file_;
  ExrStream stream_;
  std::optional<Imf::OutputFile> output_;
  std::size_t next_row_ = 0;
};

/// OpenEXR's output to memory.
class ExrMemory : public Imf::OStream {
 public:
  explicit ExrMemory(std::vector<std::byte>& bytes) : Imf::OStream("memory"), bytes_(bytes) {}
  void write(const char bytes[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (bytes_.size() < position_ + size) bytes_.resize(position_ + size);
    std::memcpy(bytes_.data() + position_, bytes, size);
    position_ += size;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }

 private:
  std::vector<std::byte>& bytes_;
  std::uint64_t position_ = 0;
};

}  // namespace

void save_exr(const Image& image, const std::filesystem::path& path,
              const SaveImageOptions& options) {
  write_exr(path, [&](ExrStream& stream) { write_image(image, options, stream); });
}

std::unique_ptr<ImageRows> save_exr_rows(const ImageShape& shape, const std::filesystem::path& path,
                                         const SaveImageOptions& options) {
  return std::make_unique<ExrRows>(shape, path, options);
}

std::vector<std::byte> encode_exr(const Image& image, const SaveImageOptions& options) {
  std::vector<std::byte> bytes;
  ExrMemory stream(bytes);
  write_image(image, options, stream);
  return bytes;
}

void save_exr_mips(const std::vector<const Image*>& levels, const std::filesystem::path& path,
                   const SaveImageOptions& options) {
  const bool half = options.format == ImageFormat::exr_half;
  const int threads = options.threads;
  write_exr(path, [&](ExrStream& stream) {
    const Imf::PixelType type = pixel_type(options);
    Imf::Header header = make_header(shape_of(*levels.front()), options);
    header.setTileDescription({kTileSize, kTileSize, Imf::MIPMAP_LEVELS, Imf::ROUND_DOWN});
    Imf::TiledOutputFile output(stream, header, exr_threads(threads));
    for (std::size_t level = 0; level < levels.size(); ++level) {
      if (half) {
        write_tiles<Imath::half>(*levels[level], static_cast<int>(level), output, type, threads);
      } else {
        write_tiles<float>(*levels[level], static_cast<int>(level), output, type, threads);
      }
    }
  });
}

Image parse_exr(const ByteSource& source, const std::string& name, const ImageLimits& limits) {
  const FailWith fail = image_failure(name, "OpenEXR");
  const ExrPlan plan = check_exr(source, fail, kLargestImageSide, limits);
  try {
    return read_exr(source, name, fail, plan);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail("", error.what(), "Export or copy the file again.");
    throw;
  }
}

}  // namespace kiln
