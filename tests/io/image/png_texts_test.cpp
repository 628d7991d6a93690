// Texts of PNGs, read by libpng.
#include <gtest/gtest.h>
#include <png.h>

#include <cstddef>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "kiln/image.h"

namespace kiln {
namespace {

std::map<std::string, std::string> texts_of(std::span<const std::byte> file) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::span<const std::byte> rest = file;
  png_set_read_fn(png, &rest, [](png_structp self, png_bytep to, std::size_t size) {
    auto& left = *static_cast<std::span<const std::byte>*>(png_get_io_ptr(self));
    if (size > left.size()) png_error(self, "cut short");
    std::memcpy(to, left.data(), size);
    left = left.subspan(size);
  });
  png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_textp list = nullptr;
  const int count = png_get_text(png, info, &list, nullptr);
  std::map<std::string, std::string> texts;
  for (int i = 0; i < count; ++i) {
    const std::size_t size = list[i].itxt_length != 0 ? list[i].itxt_length : list[i].text_length;
    texts.emplace(list[i].key, std::string(list[i].text, size));
  }
  png_destroy_read_struct(&png, &info, nullptr);
  return texts;
}

TEST(PngTexts, OriginsAndTextsComeBack) {
  const Image image{2, 2, 3, std::vector<float>(12, 0.5F)};
  for (const ImageFormat format : {ImageFormat::png8, ImageFormat::png16}) {
    SaveImageOptions options{format};
    EXPECT_TRUE(texts_of(encode(image, options)).empty());
    options.texts = {{"Software", "Kiln"}, {"Comment", "two words"}};
    std::map<std::string, std::string> wanted = {{"Software", "Kiln"}, {"Comment", "two words"}};
    EXPECT_EQ(texts_of(encode(image, options)), wanted);
    options.origin = {1.5, -2.25, 1000000.125};
    wanted["Origin"] = "1.5 -2.25 1000000.125";
    EXPECT_EQ(texts_of(encode(image, options)), wanted);
    options.origin = {0, 0, -3};
    wanted["Origin"] = "0 0 -3";
    EXPECT_EQ(texts_of(encode(image, options)), wanted);
  }
}

}  // namespace
}  // namespace kiln
