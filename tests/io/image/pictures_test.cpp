// JPEG, WebP, TIFF, TGA, BMP and Radiance HDR against known pixels, each cut short at every length.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "hostile.h"
#include "io/image/image_samples.h"
#include "io/image/picture.h"
#include "kiln/image.h"
#include "support/environment.h"
#include "support/read_file.h"

#ifdef KILN_HAS_JPEG
#include <jpeglib.h>
#endif
#ifdef KILN_HAS_WEBP
#include <webp/encode.h>
#endif
#ifdef KILN_HAS_TIFF
#include <tiffio.h>
#endif

namespace kiln {
namespace {

using test::expect_words;
using test::little_endian;

Image read(const std::string& bytes, const std::string& name = "hostile.tga") {
  return parse_image(*bytes_in_memory(bytes), name);
}

std::string refusal(const std::string& bytes, const std::string& name = "hostile.tga",
                    const ImageLimits& limits = {}) {
  const test::AddressLimit limited;
  return test::refusal(bytes, [&](const ByteSource& source) { parse_image(source, name, limits); });
}

/// Refused wherever it is cut, with the whole's pixels never given for less.
void expect_no_shorter(const std::string& whole, std::size_t step = 1) {
  read(whole);
  for (std::size_t length = 0; length < whole.size(); length += step) {
    SCOPED_TRACE(length);
    refusal(whole.substr(0, length));
  }
}

/// Bytes without order, the same in every run.
std::vector<std::uint8_t> noise_bytes(std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::uint32_t state = 1;
  for (std::uint8_t& byte : bytes)
    byte = static_cast<std::uint8_t>((state = state * 1664525 + 1013904223) >> 24);
  return bytes;
}

void expect_bytes(const Image& image, const std::vector<std::uint8_t>& bytes) {
  ASSERT_EQ(image.pixels.size(), bytes.size());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    ASSERT_EQ(image.pixels[i], static_cast<float>(bytes[i]) / 255.0F) << i;
  }
}

#ifdef KILN_HAS_JPEG

/// \param scans  progressive: several
std::string jpeg(int width, int height, J_COLOR_SPACE colours, int channels,
                 const std::vector<std::uint8_t>& pixels, bool progressive = false) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &data, &size);
  info.image_width = static_cast<JDIMENSION>(width);
  info.image_height = static_cast<JDIMENSION>(height);
  info.input_components = channels;
  info.in_color_space = colours;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, 100, TRUE);
  for (int i = 0; i < info.num_components; ++i) {
    info.comp_info[i].h_samp_factor = info.comp_info[i].v_samp_factor = 1;
  }
  if (progressive) jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  // EXIF that says "turned by a quarter".
  const std::string exif =
      std::string("Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0", 32);
  jpeg_write_marker(&info, JPEG_APP0 + 1, reinterpret_cast<const JOCTET*>(exif.data()),
                    static_cast<unsigned>(exif.size()));
  std::vector<std::uint8_t> row(static_cast<std::size_t>(width * channels));
  while (info.next_scanline < info.image_height) {
    std::copy_n(pixels.begin() + static_cast<std::ptrdiff_t>(info.next_scanline * row.size()),
                row.size(), row.begin());
    JSAMPROW rows = row.data();
    jpeg_write_scanlines(&info, &rows, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  std::string bytes(reinterpret_cast<const char*>(data), size);
  std::free(data);
  return bytes;
}

/// Values change slowly: at quality 100 each is within 2 of 255 (a rounding of the colours' turn and one of the
/// cosines').
std::vector<std::uint8_t> slope(int width, int height, int channels) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < channels; ++c) {
        pixels.push_back(static_cast<std::uint8_t>(c == 0 ? 5 * x : c == 1 ? 5 * y : 100));
      }
    }
  }
  return pixels;
}

TEST(Jpeg, ValuesAndKinds) {
  for (const bool progressive : {false, true}) {
    for (const int channels : {1, 3}) {
      const auto pixels = slope(40, 24, channels);
      const Image image = read(
          jpeg(40, 24, channels == 1 ? JCS_GRAYSCALE : JCS_RGB, channels, pixels, progressive));
      // As they are stored, whatever EXIF says.
      ASSERT_EQ(image.width, 40u);
      ASSERT_EQ(image.height, 24u);
      ASSERT_EQ(image.channels, static_cast<std::uint32_t>(channels));
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        ASSERT_NEAR(image.pixels[i] * 255, pixels[i], 2.01) << i;
      }
    }
  }
  EXPECT_FALSE(holds_linear_light([] {
    const auto path = test::scratch_folder() / "a.jpg";
    std::ofstream(path, std::ios::binary) << jpeg(8, 8, JCS_GRAYSCALE, 1, slope(8, 8, 1));
    return path;
  }()));
}

TEST(Jpeg, NothingIsMadeUp) {
  for (const bool progressive : {false, true}) {
    expect_no_shorter(jpeg(40, 24, JCS_RGB, 3, noise_bytes(40 * 24 * 3), progressive), 7);
  }
  // Damaged in its middle: a code that does not exist, or too few data before the next marker.
  std::string bytes = jpeg(64, 64, JCS_RGB, 3, noise_bytes(64 * 64 * 3));
  bytes[bytes.size() / 2] = '\xff';
  bytes[bytes.size() / 2 + 1] = '\xd9';
  expect_words(refusal(bytes), {"JPEG", "Export"});
}

TEST(Jpeg, RefusesForPrintingAndHugeHeaders) {
  expect_words(refusal(jpeg(8, 8, JCS_CMYK, 4, noise_bytes(8 * 8 * 4))), {"CMYK", "RGB"});
  std::string bytes = jpeg(8, 8, JCS_GRAYSCALE, 1, noise_bytes(64));
  const std::size_t frame = bytes.find(std::string("\xff\xc0", 2));
  ASSERT_NE(frame, std::string::npos);
  bytes.replace(frame + 5, 4, "\x75\x30\x75\x30");  // 30000 x 30000
  expect_words(refusal(bytes), {"30000 x 30000", "cannot hold"});
  expect_words(refusal(jpeg(8, 8, JCS_GRAYSCALE, 1, noise_bytes(64)), "hostile.jpg", {63}),
               {"8 x 8", "at most 63", "Scale"});
}
#endif

#ifdef KILN_HAS_WEBP

std::string webp(int width, int height, int channels, const std::vector<std::uint8_t>& pixels) {
  std::uint8_t* data = nullptr;
  const std::size_t size =
      channels == 4 ? WebPEncodeLosslessRGBA(pixels.data(), width, height, width * 4, &data)
                    : WebPEncodeLosslessRGB(pixels.data(), width, height, width * 3, &data);
  std::string bytes(reinterpret_cast<const char*>(data), size);
  WebPFree(data);
  return bytes;
}

TEST(WebP, ValuesAndKinds) {
  std::vector<std::uint8_t> pixels = noise_bytes(13 * 7 * 3);
  expect_bytes(read(webp(13, 7, 3, pixels)), pixels);
  pixels = noise_bytes(13 * 7 * 4);
  // Colours where nothing is seen are not kept by the encoder.
  for (std::size_t i = 3; i < pixels.size(); i += 4)
    pixels[i] = std::max<std::uint8_t>(1, pixels[i]);
  expect_bytes(read(webp(13, 7, 4, pixels)), pixels);
}

TEST(WebP, LossyIsReadToo) {
  const auto pixels = std::vector<std::uint8_t>(32 * 32 * 3, 100);
  std::uint8_t* data = nullptr;
  const std::size_t size = WebPEncodeRGB(pixels.data(), 32, 32, 96, 90, &data);
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  WebPFree(data);
  const Image image = read(bytes);
  // Pictures of one colour: rounded in its turn to YUV and back.
  for (const float value : image.pixels) ASSERT_NEAR(value * 255, 100, 3);
  expect_no_shorter(bytes);
}

TEST(WebP, CutShortAndHuge) {
  const std::string whole = webp(13, 7, 4, noise_bytes(13 * 7 * 4));
  expect_no_shorter(whole);
  // The same with a length that agrees: its pixels end before.
  std::string shorter = whole.substr(0, whole.size() - 40);
  shorter.replace(4, 4, little_endian(shorter.size() - 8, 4));
  refusal(shorter);
  expect_words(refusal(whole, "hostile.webp", {90}), {"13 x 7", "at most 90"});
}
#endif

#ifdef KILN_HAS_TIFF

struct TiffKind {
  std::uint32_t width = 5, height = 4;
  int samples = 1, bits = 8;
  int format = SAMPLEFORMAT_UINT, colours = PHOTOMETRIC_MINISBLACK, packing = COMPRESSION_NONE;
  int orientation = ORIENTATION_TOPLEFT, planes = PLANARCONFIG_CONTIG;
  bool tiled = false;
  int alpha = EXTRASAMPLE_UNASSALPHA;
};

/// \param pixels  rows as they are stored; of planes, one after the other
std::string tiff(const TiffKind& kind, std::string pixels) {
  const std::string path = test::scratch_folder() / "made.tif";
  TIFF* const file = TIFFOpen(path.c_str(), "w");
  TIFFSetField(file, TIFFTAG_IMAGEWIDTH, kind.width);
  TIFFSetField(file, TIFFTAG_IMAGELENGTH, kind.height);
  TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
  TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(file, TIFFTAG_SAMPLEFORMAT, kind.format);
  TIFFSetField(file, TIFFTAG_PHOTOMETRIC, kind.colours);
  TIFFSetField(file, TIFFTAG_COMPRESSION, kind.packing);
  TIFFSetField(file, TIFFTAG_ORIENTATION, kind.orientation);
  TIFFSetField(file, TIFFTAG_PLANARCONFIG, kind.planes);
  if (kind.samples % 2 == 0 && kind.colours != PHOTOMETRIC_SEPARATED) {
    const auto alpha = static_cast<std::uint16_t>(kind.alpha);
    TIFFSetField(file, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  }
  if (kind.colours == PHOTOMETRIC_PALETTE) {
    std::vector<std::uint16_t> reds(256), greens(256), blues(256);
    for (std::uint16_t i = 0; i < 256; ++i) {
      reds[i] = static_cast<std::uint16_t>(257 * i);
      greens[i] = 7;
      blues[i] = static_cast<std::uint16_t>(65535 - i);
    }
    TIFFSetField(file, TIFFTAG_COLORMAP, reds.data(), greens.data(), blues.data());
  }
  const std::uint32_t planes =
      kind.planes == PLANARCONFIG_SEPARATE ? static_cast<std::uint32_t>(kind.samples) : 1;
  if (kind.tiled) {
    TIFFSetField(file, TIFFTAG_TILEWIDTH, 16);
    TIFFSetField(file, TIFFTAG_TILELENGTH, 16);
    const std::size_t pixel = static_cast<std::size_t>(kind.samples * kind.bits / 8);
    for (std::uint32_t y = 0; y < kind.height; y += 16) {
      for (std::uint32_t x = 0; x < kind.width; x += 16) {
        std::string tile(16 * 16 * pixel, '\x55');
        for (std::uint32_t r = 0; r < std::min(16U, kind.height - y); ++r) {
          const std::size_t count = std::min(16U, kind.width - x) * pixel;
          tile.replace(r * 16 * pixel, count,
                       pixels.substr(((y + r) * kind.width + x) * pixel, count));
        }
        TIFFWriteTile(file, tile.data(), x, y, 0, 0);
      }
    }
  } else {
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, 3);
    const auto row = static_cast<std::size_t>(TIFFScanlineSize(file));
    for (std::uint32_t p = 0; p < planes; ++p) {
      for (std::uint32_t y = 0; y < kind.height; ++y) {
        TIFFWriteScanline(file, pixels.data() + (p * kind.height + y) * row, y,
                          static_cast<std::uint16_t>(p));
      }
    }
  }
  TIFFClose(file);
  return test::read_file(path);
}

template <typename T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

TEST(Tiff, BytesOfEveryLayout) {
  for (const int packing :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
    for (const int samples : {1, 2, 3, 4}) {
      for (const bool tiled : {false, true}) {
        TiffKind kind{
            .width = 37, .height = 21, .samples = samples, .packing = packing, .tiled = tiled};
        if (samples > 2) kind.colours = PHOTOMETRIC_RGB;
        const auto pixels = noise_bytes(static_cast<std::size_t>(37 * 21 * samples));
        const Image image = read(tiff(kind, bytes_of(pixels)));
        EXPECT_EQ(image.width, 37u);
        EXPECT_EQ(image.channels, static_cast<std::uint32_t>(samples));
        expect_bytes(image, pixels);
      }
    }
  }
}

TEST(Tiff, KindsOfNumbers) {
  std::vector<std::uint16_t> shorts;
  std::vector<std::uint32_t> words;
  std::vector<float> floats;
  std::vector<double> doubles;
  for (std::uint32_t i = 0; i < 20; ++i) {
    shorts.push_back(static_cast<std::uint16_t>(i * 3449));
    words.push_back(i * 226050910);
    floats.push_back(static_cast<float>(i) * 0.37F - 2);
    doubles.push_back(i * 0.37 - 2);
  }
  const Image from_shorts = read(tiff({.bits = 16}, bytes_of(shorts)));
  const Image from_words = read(tiff({.bits = 32}, bytes_of(words)));
  const std::string of_floats = tiff({.bits = 32, .format = SAMPLEFORMAT_IEEEFP}, bytes_of(floats));
  const Image from_floats = read(of_floats);
  const Image from_doubles =
      read(tiff({.bits = 64, .format = SAMPLEFORMAT_IEEEFP}, bytes_of(doubles)));
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(from_shorts.pixels[i], static_cast<float>(shorts[i] / 65535.0));
    EXPECT_EQ(from_words.pixels[i], static_cast<float>(words[i] / 4294967295.0));
    EXPECT_EQ(from_floats.pixels[i], floats[i]);
    EXPECT_EQ(from_doubles.pixels[i], static_cast<float>(doubles[i]));
  }
  // 0, 1, 2, -0.5 in halves.
  const Image halves =
      read(tiff({.width = 2, .height = 2, .bits = 16, .format = SAMPLEFORMAT_IEEEFP},
                bytes_of(std::vector<std::uint16_t>{0, 0x3c00, 0x4000, 0xb800})));
  EXPECT_EQ(halves.pixels, (std::vector<float>{0, 1, 2, -0.5F}));
  // Of a format that the writer did not define, numbers are unsigned (TIFF 6.0, page 80).
  const Image of_no_format =
      read(tiff({.bits = 16, .format = SAMPLEFORMAT_VOID}, bytes_of(shorts)));
  EXPECT_EQ(of_no_format.pixels, from_shorts.pixels);
  const std::string bytes("\x03\xC8\x80\xFF", 4);
  expect_bytes(read(tiff({.width = 4, .height = 1, .format = SAMPLEFORMAT_VOID}, bytes)),
               {3, 200, 128, 255});
  EXPECT_TRUE(tiff_holds_floats(*bytes_in_memory(of_floats)));
  EXPECT_FALSE(tiff_holds_floats(*bytes_in_memory(tiff({.bits = 32}, bytes_of(words)))));
  EXPECT_FALSE(tiff_holds_floats(*bytes_in_memory("II*")));
}

TEST(Tiff, FewBitsPalettesAndWhiteIsZero) {
  // Rows end at whole bytes.
  const Image bits = read(tiff({.width = 3, .height = 2, .bits = 1}, "\xa0\x40"));
  EXPECT_EQ(bits.pixels, (std::vector<float>{1, 0, 1, 0, 1, 0}));
  const Image white = read(tiff(
      {.width = 3, .height = 2, .bits = 4, .colours = PHOTOMETRIC_MINISWHITE}, "\x0f\x30\x12\xf0"));
  EXPECT_EQ(white.pixels, (std::vector<float>{1, 0, 12 / 15.0F, 14 / 15.0F, 13 / 15.0F, 0}));
  const Image palette = read(
      tiff({.width = 2, .height = 1, .colours = PHOTOMETRIC_PALETTE}, std::string("\x03\xff", 2)));
  EXPECT_EQ(palette.channels, 3u);
  EXPECT_EQ(palette.pixels,
            (std::vector<float>{
                3 / 255.0F, static_cast<float>(7 / 65535.0), static_cast<float>(65532 / 65535.0), 1,
                static_cast<float>(7 / 65535.0), static_cast<float>(65280 / 65535.0)}));
}

TEST(Tiff, PlanesApart) {
  const std::string planes = {1, 2, 3, 4, 5, 6, 11, 12, 13, 14, 15, 16, 21, 22, 23, 24, 25, 26};
  const Image image = read(tiff({.width = 3,
                                 .height = 2,
                                 .samples = 3,
                                 .colours = PHOTOMETRIC_RGB,
                                 .planes = PLANARCONFIG_SEPARATE},
                                planes));
  expect_bytes(image, {1, 11, 21, 2, 12, 22, 3, 13, 23, 4, 14, 24, 5, 15, 25, 6, 16, 26});
}

TEST(Tiff, EveryOrientation) {
  // The upright image is 1 2 3 / 4 5 6; what is stored for each, by the meaning of the tag: TIFF 6.0, page 36.
  const std::vector<std::pair<std::uint32_t, std::string>> stored = {
      {3, {1, 2, 3, 4, 5, 6}}, {3, {3, 2, 1, 6, 5, 4}}, {3, {6, 5, 4, 3, 2, 1}},
      {3, {4, 5, 6, 1, 2, 3}}, {2, {1, 4, 2, 5, 3, 6}}, {2, {3, 6, 2, 5, 1, 4}},
      {2, {6, 3, 5, 2, 4, 1}}, {2, {4, 1, 5, 2, 6, 3}}};
  for (int tag = 1; tag <= 8; ++tag) {
    SCOPED_TRACE(tag);
    const auto& [width, bytes] = stored[static_cast<std::size_t>(tag - 1)];
    const Image image =
        read(tiff({.width = width, .height = 6 / width, .orientation = tag}, bytes));
    EXPECT_EQ(image.width, 3u);
    expect_bytes(image, {1, 2, 3, 4, 5, 6});
  }
}

TEST(Tiff, AlphaThatIsMultipliedIsDividedOut) {
  const Image image = read(tiff({.width = 2,
                                 .height = 1,
                                 .samples = 4,
                                 .colours = PHOTOMETRIC_RGB,
                                 .alpha = EXTRASAMPLE_ASSOCALPHA},
                                std::string("\x10\x20\x30\x40\0\0\0\0", 8)));
  EXPECT_FLOAT_EQ(image.pixels[0], 0.25F);
  EXPECT_FLOAT_EQ(image.pixels[2], 0.75F);
  EXPECT_EQ(image.pixels[3], 64 / 255.0F);
  EXPECT_EQ(image.pixels[4], 0.0F);
}

TEST(Tiff, RefusalsNameTheTag) {
  expect_words(refusal(tiff({.samples = 4, .colours = PHOTOMETRIC_SEPARATED}, std::string(80, 1))),
               {"CMYK", "RGB"});
  expect_words(refusal(tiff({.format = SAMPLEFORMAT_INT}, std::string(20, 1))),
               {"signed numbers of 8 bits", "Save"});
  expect_words(refusal(tiff({.samples = 5, .colours = PHOTOMETRIC_RGB}, std::string(100, 1))),
               {"SamplesPerPixel", "5"});
  expect_words(refusal(tiff({}, std::string(20, 1)), "hostile.tif", {19}), {"5 x 4", "at most 19"});
}

TEST(Tiff, CutShortAnywhereAndLittleDataForAHugeHeader) {
  for (const int packing :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
    expect_no_shorter(tiff({.width = 20,
                            .height = 20,
                            .samples = 3,
                            .colours = PHOTOMETRIC_RGB,
                            .packing = packing},
                           bytes_of(noise_bytes(1200))),
                      13);
    std::string bytes = tiff({.width = 20, .height = 20, .packing = packing}, std::string(400, 1));
    // Tag 256, a short or long of one value; tag 257.
    for (const char tag : {'\0', '\1'}) {
      for (const char type : {'\3', '\4'}) {
        const std::size_t at =
            bytes.find(std::string{tag, '\1', type, '\0', '\1', '\0', '\0', '\0'});
        if (at == std::string::npos) continue;
        bytes[at + 2] = '\4';
        bytes.replace(at + 8, 4, little_endian(30000, 4));
        break;
      }
    }
    expect_words(refusal(bytes), {"30000 x 30000"});
  }
}
#endif

#ifdef KILN_HAS_STB

/// 24 bits, from below upwards unless `flags` (the byte "descriptor") say otherwise.
std::string tga(int width, int height, int bits, int flags, const std::string& data, int kind = 2) {
  std::string bytes(18, '\0');
  bytes[2] = static_cast<char>(kind);
  bytes[12] = static_cast<char>(width);
  bytes[14] = static_cast<char>(height);
  bytes[16] = static_cast<char>(bits);
  bytes[17] = static_cast<char>(flags);
  return bytes + data;
}

TEST(Tga, ValuesAndDirections) {
  const std::string grey = {1, 2, 3, 4, 5, 6};
  expect_bytes(read(tga(3, 2, 8, 0x20, grey, 3)), {1, 2, 3, 4, 5, 6});
  expect_bytes(read(tga(3, 2, 8, 0, grey, 3)), {4, 5, 6, 1, 2, 3});
  expect_bytes(read(tga(3, 2, 8, 0x30, grey, 3)), {3, 2, 1, 6, 5, 4});
  expect_bytes(read(tga(3, 2, 8, 0x10, grey, 3)), {6, 5, 4, 3, 2, 1});
  // Blue first.
  expect_bytes(read(tga(1, 1, 24, 0x20, {1, 2, 3})), {3, 2, 1});
  expect_bytes(read(tga(1, 1, 32, 0x28, {1, 2, 3, 4})), {3, 2, 1, 4});
  // A run of three, and three as they are.
  expect_bytes(read(tga(3, 2, 8, 0x20, {'\x82', 9, 2, 1, 2, 3}, 11)), {9, 9, 9, 1, 2, 3});
}

/// Other programs read the number of alpha bits, and that the bottom row comes first.
TEST(Tga, HeadersStateBitsOfAlpha) {
  for (const std::uint32_t channels : {1U, 3U, 4U}) {
    const std::vector<std::byte> file =
        encode(Image{1, 1, channels, std::vector<float>(channels, 0.5F)}, {ImageFormat::tga});
    EXPECT_EQ(std::to_integer<unsigned>(file.at(16)), 8 * channels);
    EXPECT_EQ(std::to_integer<unsigned>(file.at(17)), channels == 4 ? 8U : 0U);
  }
}

TEST(Tga, CutShortHugeAndByAnotherName) {
  expect_no_shorter(tga(10, 10, 24, 0x20, std::string(300, 7)));
  expect_no_shorter(tga(3, 2, 8, 0x20, {'\x82', 9, 2, 1, 2, 3}, 11));
  std::string huge = tga(1, 1, 24, 0x20, {1, 2, 3});
  huge.replace(12, 4, "\x30\x75\x30\x75");
  expect_words(refusal(huge), {"TGA", "30000 x 30000"});
  expect_words(refusal(tga(3, 2, 8, 0x20, "123456", 3), "hostile.bin"),
               {"none of the kinds", "PNG"});
}

std::string bmp(int width, int height, int bits, const std::string& data) {
  return "BM" + little_endian(54 + data.size(), 4) + little_endian(0, 4) + little_endian(54, 4) +
         little_endian(40, 4) + little_endian(static_cast<std::uint64_t>(width), 4) +
         little_endian(static_cast<std::uint64_t>(height), 4) + little_endian(1, 2) +
         little_endian(static_cast<std::uint64_t>(bits), 2) + std::string(24, '\0') + data;
}

TEST(Bmp, Values) {
  // Rows from below, each of a whole number of 4 bytes.
  const std::string rows = std::string({1, 2, 3, 4, 5, 6, 0, 0, 7, 8, 9, 10, 11, 12, 0, 0});
  expect_bytes(read(bmp(2, 2, 24, rows)), {9, 8, 7, 12, 11, 10, 3, 2, 1, 6, 5, 4});
  expect_bytes(read(bmp(2, -2, 24, rows)), {3, 2, 1, 6, 5, 4, 9, 8, 7, 12, 11, 10});
}

TEST(Bmp, CutShortAndHuge) {
  // The last row's filling may be missing.
  const std::string whole = bmp(3, 3, 24, std::string(33, 5));
  expect_no_shorter(whole);
  expect_words(refusal(bmp(30000, 30000, 24, "abc")), {"BMP", "30000 x 30000"});
}

TEST(Hdr, ValuesAreLinear) {
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 1\n";
  const std::string whole = head + std::string("\x80\x40\x20\x81\x10\x20\x40\x8a", 8);
  const Image image = read(whole);
  ASSERT_EQ(image.channels, 3u);
  ASSERT_EQ(image.height, 2u);
  // m / 256 x 2^(e - 128).
  EXPECT_EQ(image.pixels, (std::vector<float>{1, 0.5F, 0.25F, 64, 128, 256}));
  const auto path = test::scratch_folder() / "a.hdr";
  std::ofstream(path, std::ios::binary) << whole;
  EXPECT_TRUE(holds_linear_light(path));
  expect_no_shorter(whole);
  // Runs: 8 pixels of each of four channels.
  const std::string runs = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n" +
                           std::string("\x02\x02\x00\x08\x88\x80\x88\x40\x88\x20\x88\x81", 12);
  EXPECT_EQ(read(runs).pixels[23], 0.25F);
  expect_no_shorter(runs);
  // A header without a format that does not end.
  refusal("#?RADIANCE\nFO1MA2\n" + std::string(200, '\0') + "#?RADIANCE\nFO1MA2");
  expect_words(
      refusal("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n" + std::string(8, 1)),
      {"Radiance HDR", "30000 x 30000"});
}
#endif

/// Written pictures come back: to half a step, or to the bit; the same as PNG and EXR give.
TEST(Pictures, TiffComesBack) {
  const std::vector<std::string> formats = picture_formats();
  if (std::find(formats.begin(), formats.end(), "TIFF") == formats.end()) {
    GTEST_SKIP() << "built without libtiff";
  }
  for (std::uint32_t channels = 1; channels <= 4; ++channels) {
    Image image{7, 130, channels, {}};  // more than two strips of rows
    for (std::uint32_t i = 0; i < 7 * 130 * channels; ++i) {
      image.pixels.push_back(static_cast<float>(i % 1009) / 1008);
    }
    for (const auto& [format, step] :
         {std::pair(ImageFormat::tiff8, 255.0), std::pair(ImageFormat::tiff16, 65535.0),
          std::pair(ImageFormat::tiff_float, 1e9)}) {
      const Image back = load_image(encode(image, {format}), "a.tif");
      ASSERT_EQ(back.channels, channels);
      ASSERT_EQ(back.pixels.size(), image.pixels.size());
      for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        // Half a step, and what a float near 1 is off.
        ASSERT_NEAR(back.pixels[i], image.pixels[i],
                    format == ImageFormat::tiff_float ? 0 : 0.5 / step + 1e-7);
      }
    }
  }
  EXPECT_THROW(
      save_image(Image{1, 1, 1, {0}}, test::scratch_folder() / "a.png", {ImageFormat::tiff8}),
      Error);
}

}  // namespace
}  // namespace kiln
