#include <algorithm>
#include <cctype>
#include <memory>
#include <new>
#include <string>
#include <utility>

#include "io/image/exr.h"
#include "io/image/image_reader.h"
#include "io/image/png.h"
#include "kiln/image.h"

namespace kiln {
namespace {

void check_image(const Image& image) {
  if (image.width == 0 || image.height == 0 || image.width > kLargestImageSide ||
      image.height > kLargestImageSide) {
    throw Error(ErrorCode::usage, "An image of " + std::to_string(image.width) + " x " +
                                      std::to_string(image.height) +
                                      " pixels cannot be saved; each side must be 1 to " +
                                      std::to_string(kLargestImageSide) + ".");
  }
  if (image.channels < 1 || image.channels > 4) {
    throw Error(ErrorCode::usage, "An image of " + std::to_string(image.channels) +
                                      " channels cannot be saved; use 1 to 4.");
  }
  if (image.pixels.size() != std::size_t{image.width} * image.height * image.channels) {
    throw Error(ErrorCode::usage,
                "An image's pixels hold " + std::to_string(image.pixels.size()) +
                    " values, not width x height x channels = " +
                    std::to_string(std::size_t{image.width} * image.height * image.channels) + ".");
  }
}

void check_threads(const SaveImageOptions& options) {
  if (options.threads < 0) {
    throw Error(ErrorCode::usage, "SaveImageOptions::threads is " +
                                      std::to_string(options.threads) +
                                      "; use 0 for all cores, or their number.");
  }
}

void check_mips(const Image& image, const std::vector<Image>& mips) {
  const Image* finer = &image;
  const auto last = [&] { return finer->width == 1 && finer->height == 1; };
  for (const Image& level : mips) {
    check_image(level);
    const std::uint32_t width = std::max(1U, finer->width / 2);
    const std::uint32_t height = std::max(1U, finer->height / 2);
    if (last() || level.width != width || level.height != height ||
        level.channels != image.channels) {
      throw Error(ErrorCode::usage,
                  "Mip level " + std::to_string(&level - mips.data() + 1) + " is " +
                      std::to_string(level.width) + " x " + std::to_string(level.height) +
                      " with " + std::to_string(level.channels) +
                      " channels; each level must have the image's channels and half the sides of "
                      "the last, rounded down, until 1 x 1.");
    }
    finer = &level;
  }
  if (!last()) {
    throw Error(ErrorCode::usage, "The last of " + std::to_string(mips.size()) + " mip levels is " +
                                      std::to_string(finer->width) + " x " +
                                      std::to_string(finer->height) +
                                      "; give all levels down to 1 x 1.");
  }
}

}  // namespace

FailWith image_failure(std::string file, std::string kind) {
  return [file = std::move(file), kind = std::move(kind)](
             const std::string& place, const std::string& problem, const std::string& remedy) {
    throw Error(ErrorCode::input,
                "Could not read '" + file + "'" + (kind.empty() ? "" : " as " + kind) + ": " +
                    (place.empty() ? "" : place + ": ") + problem + ". " + remedy);
  };
}

Image parse_image(const ByteSource& source, const std::string& file, const ImageLimits& limits) {
  const std::string magic = source.head(8);
  if (magic.starts_with("\x89PNG\r\n\x1a\n")) return parse_png(source, file, limits);
  if (magic.starts_with("\x76\x2f\x31\x01")) return parse_exr(source, file, limits);
  const FailWith fail = image_failure(file, "an image");
  if (magic.empty()) fail("", "it is empty", "Export it again.");
  fail("", "it is neither PNG nor OpenEXR", "Convert it to one of them.");
  return {};
}

Image load_image(const std::filesystem::path& path) {
  const std::string file = path.string();
  const FailWith fail = image_failure(file, "an image");
  const std::unique_ptr<ByteSource> source = open_file(path, fail);
  try {
    return parse_image(*source, file);
  } catch (const std::bad_alloc&) {
    fail("pixels", "memory ran out", "Free some memory, or scale the image down.");
    throw;
  }
}

namespace {

/// A name that ends in the extension of another format would mislead whoever reads the file.
void check_extension(const std::filesystem::path& path, ImageFormat format) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const bool exr = format == ImageFormat::exr_half || format == ImageFormat::exr_float;
  if (extension != (exr ? ".png" : ".exr")) return;
  throw Error(ErrorCode::usage, "'" + path.string() + "' would hold " + (exr ? "OpenEXR" : "PNG") +
                                    ": set SaveImageOptions::format to what the name says.");
}

}  // namespace

void save_image(const Image& image, const std::filesystem::path& path,
                const SaveImageOptions& options) {
  check_image(image);
  check_threads(options);
  check_extension(path, options.format);
  switch (options.format) {
    case ImageFormat::exr_half:
    case ImageFormat::exr_float:
      return save_exr(image, path, options);
    case ImageFormat::png16:
      return save_png(image, path, {16, false, options.threads, options.origin});
    case ImageFormat::png8:
      return save_png(image, path, {8, options.dither, options.threads, options.origin});
  }
  throw Error(ErrorCode::usage, "SaveImageOptions::format is none of ImageFormat.", "option-enum");
}

std::vector<std::byte> encode(const Image& image, const SaveImageOptions& options) {
  check_image(image);
  check_threads(options);
  std::vector<std::byte> bytes;
  const auto png = [&](int bits, bool dither) {
    write_png(image, {bits, dither, options.threads, options.origin}, "memory",
              [&](std::string_view piece) {
                const auto* const data = reinterpret_cast<const std::byte*>(piece.data());
                bytes.insert(bytes.end(), data, data + piece.size());
              });
    return std::move(bytes);
  };
  switch (options.format) {
    case ImageFormat::exr_half:
    case ImageFormat::exr_float:
      return encode_exr(image, options);
    case ImageFormat::png16:
      return png(16, false);
    case ImageFormat::png8:
      return png(8, options.dither);
  }
  throw Error(ErrorCode::usage, "SaveImageOptions::format is none of ImageFormat.", "option-enum");
}

Image load_image(std::span<const std::byte> bytes, std::string_view name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return parse_image(*bytes_in_memory(text), std::string(name));
}

void save_mipmapped(const Image& image, const std::vector<Image>& mips,
                    const std::filesystem::path& path, const SaveImageOptions& options) {
  check_image(image);
  check_threads(options);
  check_mips(image, mips);
  if (options.format != ImageFormat::exr_half && options.format != ImageFormat::exr_float) {
    throw Error(ErrorCode::usage,
                "PNG holds one image, not mip-maps: save each level as a file of its own, or use "
                "OpenEXR.");
  }
  std::vector<const Image*> levels = {&image};
  for (const Image& level : mips) levels.push_back(&level);
  save_exr_mips(levels, path, options);
}

}  // namespace kiln
