#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <system_error>

#include "io/exr.h"
#include "io/png.h"
#include "kiln/image.h"

namespace kiln {
namespace {

constexpr std::uint32_t kLargestSide = 65536;

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
  throw Error(ErrorCode::input, "Could not read the image '" + path.string() + "': " + what + ".");
}

void check_image(const Image& image) {
  if (image.width == 0 || image.height == 0 || image.width > kLargestSide ||
      image.height > kLargestSide) {
    throw Error(ErrorCode::usage, "An image of " + std::to_string(image.width) + " x " +
                                      std::to_string(image.height) +
                                      " pixels cannot be saved; each side must be 1 to " +
                                      std::to_string(kLargestSide) + ".");
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

}  // namespace

Image load_image(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) fail(path, "it is a folder; name a file");
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    fail(path, "it is not a regular file; copy the image to a file first");
  }
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rbe"),
                                                             &std::fclose);
  if (file == nullptr) fail(path, std::generic_category().message(errno) + "; check the path");
  unsigned char magic[8] = {};
  const std::size_t count = std::fread(magic, 1, sizeof(magic), file.get());
  if (count == 0) fail(path, "it is empty; export it again");
  if (std::memcmp(magic, "\x89PNG\r\n\x1a\n", 8) == 0) return load_png(path);
  if (std::memcmp(magic, "\x76\x2f\x31\x01", 4) == 0) return load_exr(path);
  fail(path, "it is neither PNG nor OpenEXR; convert it to one of them");
}

void save_image(const Image& image, const std::filesystem::path& path,
                const SaveImageOptions& options) {
  check_image(image);
  if (options.threads < 0) {
    throw Error(ErrorCode::usage, "SaveImageOptions::threads is " +
                                      std::to_string(options.threads) +
                                      "; use 0 for all cores, or their number.");
  }
  switch (options.format) {
    case ImageFormat::exr_half:
      return save_exr(image, path, true, options.threads);
    case ImageFormat::exr_float:
      return save_exr(image, path, false, options.threads);
    case ImageFormat::png16:
      return save_png(image, path, 16, false, options.threads);
    case ImageFormat::png8:
      return save_png(image, path, 8, options.dither, options.threads);
  }
  throw Error(ErrorCode::usage, "SaveImageOptions::format is none of ImageFormat.");
}

}  // namespace kiln
