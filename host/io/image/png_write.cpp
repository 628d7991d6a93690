#include <zlib.h>

#ifdef KILN_HAS_DEFLATE
#include <libdeflate.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "io/file/atomic_file.h"
#include "io/image/png.h"
#include "io/image/run_deflate.h"

// libpng's writer is not used, since it deflates on one thread, which takes nearly all of the time.
// A PNG consists of a signature and a few chunks (PNG specification, 3rd edition, section 5). Its
// compressed stream may be the concatenation of pieces that are deflated separately, as pigz does.
// Tests read every written file with libpng.
//
// All rows have the filter "up", and zlib's run-length strategy compresses them. Measured at 4096^2
// RGB on two Zen 3 cores, writing included, with detail in every texel:
//
//                       16 bits            8 bits
//   up + RLE            0.47 s  89.6 MB    0.40 s  31.2 MB
//   sub + RLE           0.75 s  89.6 MB
//   Paeth + RLE         0.74 s  89.9 MB
//   up + zlib level 1   2.2 s   90.7 MB    0.96 s  34.4 MB
//
// Searching for matches takes most of the time, and there are none in the texture of a normal map;
// empty background consists of runs. For large images, run_deflate() searches runs alone, in half
// of zlib's time or less.
namespace kiln {
namespace {

constexpr std::uint8_t kFilterUp = 2;

using Bytes = std::vector<std::uint8_t>;

// Number of bytes in a band of rows. It is small enough to keep all threads busy, and large enough
// that the five bytes between two bands are negligible. The row above a band has to be quantised
// twice, so bands of wide images have at least kMinBandRows rows.
constexpr std::size_t kBandBytes = std::size_t{1} << 18;
constexpr std::size_t kMinBandRows = 8;
// Below this number of bytes of pixels, the file's size matters more than time.
constexpr std::size_t kSmallImageBytes = std::size_t{1} << 21;

#ifdef KILN_HAS_DEFLATE
// libdeflate computes checksums with vector instructions; zlib in Debian 12 does not.
std::uint32_t crc_of(std::span<const std::uint8_t> bytes) {
  return libdeflate_crc32(0, bytes.data(), bytes.size());
}
std::uint32_t adler_of(std::span<const std::uint8_t> bytes) {
  return libdeflate_adler32(1, bytes.data(), bytes.size());
}
#else
std::uint32_t crc_of(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, bytes.data(), bytes.size()));
}
std::uint32_t adler_of(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(adler32_z(1, bytes.data(), bytes.size()));
}
#endif

void put_big_endian(Bytes& to, std::uint32_t value) {
  for (const int shift : {24, 16, 8, 0}) to.push_back(static_cast<std::uint8_t>(value >> shift));
}

// Starts a chunk: reserves space for the length and writes the type; the caller appends the data.
Bytes open_chunk(const char* type) {
  Bytes bytes(4);
  bytes.insert(bytes.end(), type, type + 4);
  return bytes;
}

// Writes a chunk's length to the space at its start, and appends its checksum.
void close_chunk(Bytes& bytes) {
  const auto length = static_cast<std::uint32_t>(bytes.size() - 8);
  for (int i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>(length >> (24 - 8 * i));
  put_big_endian(bytes, crc_of(std::span(bytes).subspan(4)));
}

Bytes chunk(const char* type, const Bytes& data) {
  Bytes bytes = open_chunk(type);
  bytes.insert(bytes.end(), data.begin(), data.end());
  close_chunk(bytes);
  return bytes;
}

// Adding 1.5 * 2^52 rounds to an integer, ties to even, since no bits below 1 are left; the low
// bits of the sum are that integer. std::lrint gives the same but is not vectorised.
std::uint32_t round_to_integer(double value) {
  const double sum = value + 6755399441055744.0;
  std::uint64_t bits = 0;
  std::memcpy(&bits, &sum, sizeof(bits));
  return static_cast<std::uint32_t>(bits);
}

// All comparisons with NaN are false, so NaN becomes 0.
double clamp_unit(float value) {
  const float positive = value > 0.0F ? value : 0.0F;
  return static_cast<double>(positive < 1.0F ? positive : 1.0F);
}

// Threshold of Bayer's matrix at (x, y), in (0, 1), by interleaving the bits of x ^ y and y.
double bayer_threshold(std::size_t x, std::size_t y) {
  unsigned rank = 0;
  for (unsigned bit = 0; bit < 3; ++bit) {
    const auto a = static_cast<unsigned>(((x ^ y) >> bit) & 1U);
    const auto b = static_cast<unsigned>((y >> bit) & 1U);
    rank |= (a << 1U | b) << (2 * (2 - bit));
  }
  return (rank + 0.5) / 64.0;
}

}  // namespace

void quantise_row(const Image& image, int bits, const DitherBlocks& dither, std::size_t y,
                  std::uint8_t* to, std::size_t first_row) {
  const float* from = image.at(0, y - first_row);
  const std::size_t count = std::size_t{image.width} * image.channels;
  if (bits == 16) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t q = round_to_integer(clamp_unit(from[i]) * 65535.0);
      to[2 * i] = static_cast<std::uint8_t>(q >> 8);
      to[2 * i + 1] = static_cast<std::uint8_t>(q);
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = static_cast<std::uint8_t>(round_to_integer(clamp_unit(from[i]) * 255.0));
    }
    if (!dither.dithers_any()) return;
    std::array<double, 8> threshold{};
    for (std::size_t x = 0; x < 8; ++x) threshold[x] = bayer_threshold(x, y % 8);
    for (std::size_t first = 0; first < image.width; first += DitherBlocks::kSide) {
      const std::uint8_t channels = dither.channels_at(first, y);
      if (channels == 0) continue;
      const std::size_t end = std::min<std::size_t>(first + DitherBlocks::kSide, image.width);
      for (std::size_t x = first; x < end; ++x) {
        for (std::size_t c = 0; c < image.channels; ++c) {
          if ((channels >> c & 1U) == 0) continue;
          const std::size_t i = x * image.channels + c;
          to[i] = static_cast<std::uint8_t>(
              static_cast<int>(clamp_unit(from[i]) * 255.0 + threshold[x % 8]));
        }
      }
    }
  }
}

DitherBlocks::DitherBlocks(const Image& image, Dither dither, TextureUse use)
    : dithers_everywhere_(dither == Dither::on) {
  if (dither != Dither::automatic) return;
  // Rounding is visible where a value changes so slowly that bands of equal texels are at least
  // kSide wide. Constant values have no edges between bands, and noise of one step has the effect
  // of dithering.
  constexpr double kStep = 1.0 / 255, kMinChange = kStep / 16;
  const bool is_normal = use == TextureUse::normal || use == TextureUse::tangent_normal;
  const std::size_t channels =
      is_normal ? std::min<std::size_t>(image.channels, 2) : image.channels;
  columns_ = (image.width + kSide - 1) / kSide;
  const std::size_t rows = (image.height + kSide - 1) / kSide;
  std::vector<std::uint8_t> blocks(columns_ * rows, 0);
  parallel_for(rows, 1, [&](std::size_t begin, std::size_t end) {
    std::vector<std::pair<double, double>> ranges;
    for (std::size_t row = begin; row < end; ++row) {
      ranges.assign(columns_ * channels, {2.0, -1.0});
      const std::size_t last = std::min<std::size_t>((row + 1) * kSide, image.height);
      for (std::size_t y = row * kSide; y < last; ++y) {
        for (std::size_t x = 0; x < image.width; ++x) {
          const float* const texel = image.at(x, y);
          for (std::size_t c = 0; c < channels; ++c) {
            auto& [low, high] = ranges[x / kSide * channels + c];
            const double value = clamp_unit(texel[c]);
            low = std::min(low, value);
            high = std::max(high, value);
          }
        }
      }
      for (std::size_t i = 0; i < ranges.size(); ++i) {
        const double range = ranges[i].second - ranges[i].first;
        if (range > kMinChange && range < kStep) {
          blocks[row * columns_ + i / channels] |= static_cast<std::uint8_t>(1U << (i % channels));
        }
      }
    }
  });
  const bool any = std::any_of(blocks.begin(), blocks.end(), [](std::uint8_t b) { return b != 0; });
  if (any) blocks_ = std::move(blocks);
}

namespace {

struct Layout {
  const Image& image;
  int bits;
  const DitherBlocks& dither;
  std::size_t row_values() const { return std::size_t{image.width} * image.channels; }
  std::size_t row_bytes() const { return row_values() * static_cast<std::size_t>(bits / 8); }
};

/// Deflates by zlib, whose block headers are shorter.
void deflate_small(std::span<const std::uint8_t> raw, bool last, const std::string& name,
                   Bytes& to) {
  z_stream stream{};
  if (deflateInit2(&stream, 1, Z_DEFLATED, -15, 9, Z_RLE) != Z_OK) throw std::bad_alloc();
  const std::size_t before = to.size();
  to.resize(before + deflateBound(&stream, static_cast<uLong>(raw.size())) + 16);
  stream.next_in = const_cast<Bytef*>(raw.data());
  stream.avail_in = static_cast<uInt>(raw.size());
  stream.next_out = to.data() + before;
  stream.avail_out = static_cast<uInt>(to.size() - before);
  const int status = deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
  const bool complete =
      status == (last ? Z_STREAM_END : Z_OK) && stream.avail_in == 0 && stream.avail_out != 0;
  to.resize(before + stream.total_out);
  deflateEnd(&stream);
  if (!complete) throw Error(ErrorCode::internal, "zlib could not deflate '" + name + "'.");
}

// ---- Small files: one stream, whose matches extend over all rows. ------------------------------------
//
// One filter is chosen for the whole picture: the one for which a sample of the rows is smallest at
// libdeflate's fastest level. The candidates are up, Paeth, and for each row the filter with the
// least entropy. Smooth maps benefit most from long matches, which only high levels find, so small
// pictures are compressed at higher levels. Sizes of a normal map of 2048 x 2048:
//
//   level   libdeflate          zlib
//   1       2.05 MB
//   6       1.79 MB
//   7       1.73 MB   0.8 s
//   8       1.66 MB   2.3 s
//   9                           1.58 MB  14 s
//   10      1.43 MB   5 s

constexpr std::size_t kMaxSingleStreamBytes = std::size_t{1} << 29;
constexpr std::size_t kSampleRows = 16, kSampleRowInterval = 64;

/// Filters of PNG's specification, section 9.2; kLeastEntropy chooses one of them for each row.
constexpr int kPaeth = 4, kFilters = 5, kLeastEntropy = 5;

void filter_row(int filter, const std::uint8_t* values, const std::uint8_t* above,
                std::size_t pixel, std::size_t size, std::uint8_t* to) {
  for (std::size_t i = 0; i < size; ++i) {
    const int a = i >= pixel ? values[i - pixel] : 0, b = above[i],
              c = i >= pixel ? above[i - pixel] : 0;
    int prediction = 0;
    if (filter == 1) {
      prediction = a;
    } else if (filter == kFilterUp) {
      prediction = b;
    } else if (filter == 3) {
      prediction = (a + b) / 2;
    } else if (filter == kPaeth) {
      const int sum = a + b - c, distance_to_a = std::abs(sum - a),
                distance_to_b = std::abs(sum - b), distance_to_c = std::abs(sum - c);
      prediction = distance_to_a <= distance_to_b && distance_to_a <= distance_to_c ? a
                   : distance_to_b <= distance_to_c                                 ? b
                                                                                    : c;
    }
    to[i] = static_cast<std::uint8_t>(values[i] - prediction);
  }
}

/// n log2(n) as a fixed-point integer, so that sums are the same on every machine.
std::uint64_t entropy_term(std::uint32_t n) {
  return n == 0 ? 0 : n * static_cast<std::uint64_t>(std::lround(std::log2(n) * 4096));
}

/// Filters one row; the filter's number precedes the row's bytes.
/// \param scratch  buffer with as many bytes as the row
void filter_by(int filter, const std::uint8_t* values, const std::uint8_t* above, std::size_t pixel,
               std::size_t size, std::uint8_t* to, Bytes& scratch) {
  to[0] = static_cast<std::uint8_t>(filter);
  if (filter != kLeastEntropy) return filter_row(filter, values, above, pixel, size, to + 1);
  std::uint64_t best = 0;
  for (int candidate = 0; candidate < kFilters; ++candidate) {
    filter_row(candidate, values, above, pixel, size, scratch.data());
    std::array<std::uint32_t, 256> counts{};
    for (const std::uint8_t byte : scratch) ++counts[byte];
    std::uint64_t sum = 0;  // Sum of n log2(n); the larger, the lower the entropy
    for (const std::uint32_t count : counts) sum += entropy_term(count);
    if (candidate != 0 && sum <= best) continue;
    best = sum;
    to[0] = static_cast<std::uint8_t>(candidate);
    std::copy(scratch.begin(), scratch.end(), to + 1);
  }
}

/// Filters as many rows as fit in `to`, beginning with row `first`.
void filter_rows(const Layout& layout, int filter, std::size_t first, std::span<std::uint8_t> to) {
  const std::size_t size = layout.row_bytes();
  const std::size_t pixel = size / layout.image.width;
  Bytes above(size, 0), values(size), scratch(size);
  if (first != 0) quantise_row(layout.image, layout.bits, layout.dither, first - 1, above.data());
  for (std::size_t k = 0; k < to.size() / (size + 1); ++k) {
    quantise_row(layout.image, layout.bits, layout.dither, first + k, values.data());
    filter_by(filter, values.data(), above.data(), pixel, size, &to[k * (size + 1)], scratch);
    std::swap(values, above);
  }
}

#ifdef KILN_HAS_DEFLATE
/// Deflates with libdeflate, and appends the zlib stream to `to`.
void deflate_whole(std::span<const std::uint8_t> raw, int level, Bytes& to) {
  const std::unique_ptr<libdeflate_compressor, void (*)(libdeflate_compressor*)> compressor(
      libdeflate_alloc_compressor(level), libdeflate_free_compressor);
  if (compressor == nullptr) throw std::bad_alloc();
  const std::size_t before = to.size();
  to.resize(before + libdeflate_zlib_compress_bound(compressor.get(), raw.size()));
  const std::size_t size = libdeflate_zlib_compress(compressor.get(), raw.data(), raw.size(),
                                                    to.data() + before, to.size() - before);
  to.resize(before + size);
}
constexpr int kFastLevel = 1, kHighestLevel = 12;
int choose_level(std::size_t bytes) {
  return bytes <= std::size_t{1} << 20 ? 10 : bytes <= std::size_t{1} << 22 ? 8 : 7;
}
#else
/// Deflates with zlib, and appends the zlib stream to `to`.
void deflate_whole(std::span<const std::uint8_t> raw, int level, Bytes& to) {
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, 15, 9, Z_FILTERED) != Z_OK) throw std::bad_alloc();
  const std::size_t before = to.size();
  to.resize(before + deflateBound(&stream, static_cast<uLong>(raw.size())));
  stream.next_in = const_cast<Bytef*>(raw.data());
  stream.avail_in = static_cast<uInt>(raw.size());
  stream.next_out = to.data() + before;
  stream.avail_out = static_cast<uInt>(to.size() - before);
  deflate(&stream, Z_FINISH);
  to.resize(before + stream.total_out);
  deflateEnd(&stream);
}
constexpr int kFastLevel = 1, kHighestLevel = 9;
int choose_level(std::size_t /*bytes*/) { return 6; }
#endif

int choose_filter(const Layout& layout) {
  constexpr std::array<int, 3> kCandidateFilters = {kFilterUp, kPaeth, kLeastEntropy};
  const std::size_t row = layout.row_bytes() + 1, height = layout.image.height;
  const std::size_t samples = (height + kSampleRowInterval - 1) / kSampleRowInterval;
  std::vector<std::size_t> sizes(kCandidateFilters.size() * samples);
  parallel_for(sizes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t first = i / kCandidateFilters.size() * kSampleRowInterval;
      Bytes rows(row * std::min(kSampleRows, height - first)), packed;
      filter_rows(layout, kCandidateFilters[i % kCandidateFilters.size()], first, rows);
      deflate_whole(rows, kFastLevel, packed);
      sizes[i] = packed.size();
    }
  });
  std::array<std::size_t, kCandidateFilters.size()> sums{};
  for (std::size_t i = 0; i < sizes.size(); ++i) sums[i % kCandidateFilters.size()] += sizes[i];
  return kCandidateFilters[static_cast<std::size_t>(std::min_element(sums.begin(), sums.end()) -
                                                    sums.begin())];
}

template <typename Put>
void write_small(const Layout& layout, bool smallest, const std::string& /*name*/, const Put& put) {
  const std::size_t row = layout.row_bytes() + 1, height = layout.image.height;
  const int filter = choose_filter(layout);
  Bytes raw(row * height);
  parallel_for(height, kSampleRowInterval, [&](std::size_t begin, std::size_t end) {
    filter_rows(layout, filter, begin, std::span(raw).subspan(begin * row, (end - begin) * row));
  });
  Bytes data = open_chunk("IDAT");
  deflate_whole(raw, smallest ? kHighestLevel : choose_level(raw.size()), data);
  close_chunk(data);
  put(data);
}

void put_chunk(const Bytes& bytes, const PutBytes& put) {
  put({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// Writes the signature, the header and the texts.
void put_head(const ImageShape& shape, const PngOptions& options, const PutBytes& put) {
  put("\x89PNG\r\n\x1a\n");
  Bytes header;
  put_big_endian(header, shape.width);
  put_big_endian(header, shape.height);
  constexpr std::array<std::uint8_t, 5> kColourType = {0, 0, 4, 2, 6};
  for (const int value : {options.bits, int{kColourType[shape.channels]}, 0, 0, 0}) {
    header.push_back(static_cast<std::uint8_t>(value));
  }
  put_chunk(chunk("IHDR", header), put);
  for (const ImageText& text : options.texts) {
    const std::string keyword_and_text = text.keyword + '\0' + text.text;
    put_chunk(chunk("tEXt", Bytes(keyword_and_text.begin(), keyword_and_text.end())), put);
  }
}

}  // namespace

// ---- Files that are written row by row --------------------------------------------------------------
//
// A band of rows is one IDAT chunk. Rows of a band that is not yet complete are kept as quantised bytes, with the row
// above the band, from which "up" predicts its first row.

struct PngRows::Band {
  Bytes chunk;  // The finished IDAT chunk
  uLong adler = 0;
  std::size_t raw_bytes = 0;
};

PngRows::PngRows(const ImageShape& shape, const PngOptions& options, DitherBlocks dither,
                 std::string name, PutBytes put)
    : shape_(shape),
      bits_(options.bits),
      threads_(options.threads),
      dither_(std::move(dither)),
      name_(std::move(name)),
      put_(std::move(put)),
      row_bytes_(std::size_t{shape.width} * shape.channels *
                 static_cast<std::size_t>(options.bits / 8)),
      band_rows_(std::max(kMinBandRows, kBandBytes / (row_bytes_ + 1))),
      adler_(adler32(0, nullptr, 0)) {
  put_head(shape, options, put_);
  put_chunk(chunk("IDAT", {0x78, 0x01}), put_);  // zlib: deflate, 32 KiB window, fastest
}

PngRows::~PngRows() = default;

/// Returns a quantised row, either from kept_ or made from `rows`; in the second case, the returned
/// bytes are in `scratch`.
const std::uint8_t* PngRows::row(const Image& rows, std::size_t y, Bytes& scratch) const {
  if (y < next_row_) return &kept_[(y - first_kept_) * row_bytes_];
  quantise_row(rows, bits_, dither_, y, scratch.data(), next_row_);
  return scratch.data();
}

PngRows::Band PngRows::encode_band(const Image& rows, std::size_t first, std::size_t last) const {
  const std::size_t size = (row_bytes_ + 1) * (last - first);
  const auto memory = std::make_unique_for_overwrite<std::uint8_t[]>(size);
  const std::span<const std::uint8_t> raw(memory.get(), size);
  Bytes values(row_bytes_), next_values(row_bytes_);
  // By the specification, the row above the first is zero.
  const std::uint8_t* above = first == 0 ? values.data() : row(rows, first - 1, values);
  for (std::size_t y = first; y < last; ++y) {
    const std::uint8_t* const at = row(rows, y, next_values);
    std::uint8_t* to = memory.get() + (y - first) * (row_bytes_ + 1);
    *to++ = kFilterUp;
    for (std::size_t i = 0; i < row_bytes_; ++i)
      to[i] = static_cast<std::uint8_t>(at[i] - above[i]);
    std::swap(values, next_values);
    above = at;
  }
  const bool is_last = last == shape_.height;
  Band band;
  band.chunk = open_chunk("IDAT");
  if (row_bytes_ * shape_.height < kSmallImageBytes) {
    deflate_small(raw, is_last, name_, band.chunk);
  } else {
    run_deflate(raw, is_last, band.chunk);
  }
  close_chunk(band.chunk);
  band.adler = adler_of(raw);
  band.raw_bytes = raw.size();
  return band;
}

void PngRows::put(const Image& rows) {
  const std::size_t end = next_row_ + rows.height;
  const std::size_t first_band = next_row_ / band_rows_;
  const std::size_t end_band =
      end == shape_.height ? (end + band_rows_ - 1) / band_rows_ : end / band_rows_;
  // Bands are written in order, although they are produced in any order: one thread writes while others compress.
  std::vector<Band> bands(end_band - first_band);
  std::size_t next_band = 0;
  std::mutex mutex;
  parallel_for(
      bands.size(), 1,
      [&](std::size_t begin, std::size_t stop) {
        for (std::size_t i = begin; i < stop; ++i) {
          const std::size_t y = (first_band + i) * band_rows_;
          Band band = encode_band(rows, y, std::min<std::size_t>(y + band_rows_, shape_.height));
          // Never blocks for long: the thread that puts the next band in order also writes all
          // later bands that are ready.
          const std::lock_guard lock(mutex);
          bands[i] = std::move(band);
          for (; next_band < bands.size() && bands[next_band].raw_bytes != 0; ++next_band) {
            Band& ready = bands[next_band];
            adler_ = adler32_combine(adler_, ready.adler, static_cast<z_off_t>(ready.raw_bytes));
            put_chunk(ready.chunk, put_);
            ready.chunk = {};
          }
        }
      },
      threads_);
  // The rows of the next band, and the row above it
  const std::size_t first_row = std::max<std::size_t>(end_band * band_rows_, 1) - 1;
  Bytes kept((end - std::min(first_row, end)) * row_bytes_);
  for (std::size_t y = first_row; y < end; ++y) {
    Bytes scratch(row_bytes_);
    const std::uint8_t* const from = row(rows, y, scratch);
    std::copy_n(from, row_bytes_, &kept[(y - first_row) * row_bytes_]);
  }
  kept_ = std::move(kept);
  first_kept_ = first_row;
  next_row_ = end;
}

void PngRows::finish() {
  if (next_row_ != shape_.height) {
    throw Error(ErrorCode::internal, "'" + name_ + "' was finished before its last row.");
  }
  Bytes trailer;
  put_big_endian(trailer, static_cast<std::uint32_t>(adler_));
  put_chunk(chunk("IDAT", trailer), put_);
  put_chunk(chunk("IEND", {}), put_);
}

void write_png(const Image& image, const PngOptions& options, const std::string& name,
               const PutBytes& send) {
  const ImageShape shape{image.width, image.height, image.channels};
  DitherBlocks blocks =
      options.bits == 8 ? DitherBlocks(image, options.dither, options.use) : DitherBlocks();
  const Layout layout{image, options.bits, blocks};
  if (options.deflate != Deflate::fast &&
      (layout.row_bytes() + 1) * image.height <= kMaxSingleStreamBytes) {
    put_head(shape, options, send);
    write_small(layout, options.deflate == Deflate::smallest, name,
                [&](const Bytes& bytes) { put_chunk(bytes, send); });
    put_chunk(chunk("IEND", {}), send);
    return;
  }
  PngRows rows(shape, options, std::move(blocks), name, send);
  rows.put(image);
  rows.finish();
}

void save_png(const Image& image, const std::filesystem::path& path, const PngOptions& options) {
  AtomicFile file(path);
  write_png(image, options, path.string(), [&](std::string_view bytes) { file.write(bytes); });
  file.commit();
}

}  // namespace kiln
