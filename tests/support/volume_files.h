// Writes volume files in any type, byte order and encoding, by code that follows the formats' specifications and shares
// none with the readers.
#pragma once

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "kiln/volume.h"

namespace kiln::test {

inline std::string packed(const std::string& bytes, bool gzip) {
  z_stream zlib{};
  deflateInit2(&zlib, 9, Z_DEFLATED, gzip ? 31 : 15, 9, Z_DEFAULT_STRATEGY);
  std::string out(deflateBound(&zlib, bytes.size()) + 64, '\0');
  std::string in = bytes;
  zlib.next_in = reinterpret_cast<Bytef*>(in.data());
  zlib.avail_in = static_cast<uInt>(in.size());
  zlib.next_out = reinterpret_cast<Bytef*>(out.data());
  zlib.avail_out = static_cast<uInt>(out.size());
  deflate(&zlib, Z_FINISH);
  out.resize(zlib.total_out);
  deflateEnd(&zlib);
  return out;
}

/// The bytes of a value in the given byte order.
template <typename T>
std::string bytes_of(T value, ByteOrder order) {
  std::string raw(sizeof value, '\0');
  std::memcpy(raw.data(), &value, sizeof value);
  if ((order == ByteOrder::little) != (std::endian::native == std::endian::little)) {
    std::reverse(raw.begin(), raw.end());
  }
  return raw;
}

/// The voxels of a volume as bytes in the given byte order.
inline std::string voxel_bytes(const Volume& volume, ByteOrder order) {
  std::string raw(reinterpret_cast<const char*>(volume.voxels.data()), volume.voxels.size());
  if ((order == ByteOrder::little) == (std::endian::native == std::endian::little)) return raw;
  const std::size_t each = size_of(volume.type);
  for (std::size_t at = 0; at < raw.size(); at += each) {
    std::reverse(raw.begin() + static_cast<std::ptrdiff_t>(at),
                 raw.begin() + static_cast<std::ptrdiff_t>(at + each));
  }
  return raw;
}

/// A NIfTI file of either version, with all fields of the header that Kiln reads.
struct NiftiFile {
  bool second = false;
  ByteOrder order = ByteOrder::little;
  std::array<std::int64_t, 8> dim{3, 1, 1, 1, 1, 1, 1, 1};
  std::int16_t datatype = 2;
  std::array<double, 8> pixdim{1, 1, 1, 1, 0, 0, 0, 0};
  double offset = -1;  ///< Offset of the data; -1: directly after the header
  double slope = 0, intercept = 0;
  int qform = 0, sform = 0;
  std::array<double, 3> quaternion{}, quaternion_offset{};
  std::array<std::array<double, 4>, 3> rows{};
  std::string magic;  ///< The magic text; empty: the correct one

  std::string text(const std::string& voxels) const {
    const std::size_t size = second ? 540 : 348;
    std::string h(size, '\0');
    const auto put = [&](std::size_t at, auto value) {
      const std::string raw = bytes_of(value, order);
      h.replace(at, raw.size(), raw);
    };
    const auto real = [&](std::size_t at_1, std::size_t at_2, double value, std::size_t i = 0) {
      if (second) {
        put(at_2 + 8 * i, value);
      } else {
        put(at_1 + 4 * i, static_cast<float>(value));
      }
    };
    const auto code = [&](std::size_t at_1, std::size_t at_2, int value) {
      if (second) {
        put(at_2, std::int32_t{value});
      } else {
        put(at_1, static_cast<std::int16_t>(value));
      }
    };
    const double begin = offset == -1 ? static_cast<double>(size + 4) : offset;
    put(0, static_cast<std::int32_t>(size));
    put(second ? 12 : 70, datatype);
    for (std::size_t i = 0; i < 8; ++i) {
      if (second) {
        put(16 + 8 * i, dim[i]);
      } else {
        put(40 + 2 * i, static_cast<std::int16_t>(dim[i]));
      }
      real(76, 104, pixdim[i], i);
    }
    if (second) {
      put(168, static_cast<std::int64_t>(begin));
    } else {
      put(108, static_cast<float>(begin));
    }
    real(112, 176, slope);
    real(116, 184, intercept);
    code(252, 344, qform);
    code(254, 348, sform);
    for (std::size_t i = 0; i < 3; ++i) {
      real(256, 352, quaternion[i], i);
      real(268, 376, quaternion_offset[i], i);
      for (std::size_t c = 0; c < 4; ++c) real(280, 400, rows[i][c], 4 * i + c);
    }
    const std::string right = second ? std::string("n+2\0\r\n\x1a\n", 8) : std::string("n+1\0", 4);
    h.replace(second ? 4 : 344, right.size(), right);
    if (!magic.empty()) h.replace(second ? 4 : 344, magic.size(), magic);
    return h + std::string(4, '\0') + voxels;
  }
};

}  // namespace kiln::test
