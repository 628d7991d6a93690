// Reads voxels: checks sizes before allocation, and converts byte order and text.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "base/counted.h"
#include "base/voxel_type.h"
#include "io/file/bounds.h"
#include "io/file/text_scanner.h"
#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

void swap_bytes(std::vector<std::byte>& voxels, std::size_t each) {
  for (std::size_t at = 0; at + each <= voxels.size(); at += each) {
    std::reverse(voxels.begin() + static_cast<std::ptrdiff_t>(at),
                 voxels.begin() + static_cast<std::ptrdiff_t>(at + each));
  }
}

std::string sizes_text(const Volume& volume) {
  return std::to_string(volume.size[0]) + " x " + std::to_string(volume.size[1]) + " x " +
         std::to_string(volume.size[2]) + " " + name_of(volume.type);
}

std::uint64_t voxel_count(const Volume& volume) {
  return std::uint64_t{volume.size[0]} * volume.size[1] * volume.size[2];
}

[[noreturn]] void fail_for_missing_voxels(const VolumeInput& input, const Volume& volume,
                                          std::uint64_t expected, const std::string& found,
                                          const Message& remedy) {
  input.fail("voxels",
             "the header declares " + sizes_text(volume) + " = " + std::to_string(expected) +
                 " bytes, but the file has " + found + " (truncated, or wrong dimensions)",
             remedy);
}

/// Parses a value of the voxel type from a token. Returns false if the token is invalid.
template <typename T>
bool parse_value(std::string_view token, T& value) {
  if constexpr (std::is_floating_point_v<T>) {
    const auto number = to_double(token);
    if (!number) return false;
    // A number beyond the range of float becomes infinite, and is counted as non-finite
    value = static_cast<T>(*number);
    return true;
  } else {
    const auto number = to_integer(token);
    if (!number || *number < std::int64_t{std::numeric_limits<T>::min()} ||
        *number > std::int64_t{std::numeric_limits<T>::max()}) {
      return false;
    }
    value = static_cast<T>(*number);
    return true;
  }
}

void read_text(const VolumeInput& input, const ByteSource& source, const VoxelPlace& place,
               Volume& volume) {
  const std::uint64_t count = voxel_count(volume);
  const std::uint64_t begin = std::min(place.offset, source.size());
  const std::uint64_t length = source.size() - begin;
  // Each value needs at least a digit and, except for the last, a blank.
  if (length < 2 * count - 1) {
    fail_for_missing_voxels(input, volume, 2 * count - 1, std::to_string(length) + " bytes of text",
                            place.remedy);
  }
  require_memory("its " + sizes_text(volume), length + count * size_of(volume.type),
                 memory_failure(input.fail_with(), "voxels"));
  std::string text(static_cast<std::size_t>(length), '\0');
  text.resize(source.read_at(begin, text.data(), text.size()));
  std::replace(text.begin(), text.end(), ',', ' ');
  volume.voxels.resize(static_cast<std::size_t>(count) * size_of(volume.type));
  TextScanner scan(text);
  with_voxel_type(volume.type, [&](auto value) {
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::string_view token = scan.token();
      if (token.empty()) {
        input.fail("voxels",
                   "the header declares " + std::to_string(count) +
                       " values as text, but there are " + std::to_string(i) +
                       " (truncated, or wrong dimensions)",
                   place.remedy);
      }
      if (!parse_value(token, value)) {
        input.fail("voxel " + std::to_string(i),
                   "\"" + printable(token) + "\" is not a value of type " + name_of(volume.type),
                   "Correct it, or export the volume with raw encoding.");
      }
      std::memcpy(volume.voxels.data() + i * sizeof value, &value, sizeof value);
    }
  });
  std::uint64_t left = 0;
  while (!scan.token().empty()) ++left;
  if (left != 0) {
    input.warn("trailing-bytes",
               counted(left, "value") + " after the last voxel " +
                   (left == 1 ? "was ignored" : "were ignored"),
               left);
  }
  count_non_finite(input, volume);
}

}  // namespace

std::uint64_t check_size(const VolumeInput& input, const std::string& place,
                         const std::array<std::uint64_t, 3>& size, VoxelType type) {
  constexpr std::uint64_t kMaxVoxelBytes = std::numeric_limits<std::ptrdiff_t>::max();
  std::uint64_t bytes = size_of(type);
  bool fits = true;
  for (const std::uint64_t n : size) {
    if (n == 0) {
      input.fail(place, "a size is 0", "A volume needs at least one voxel along each axis.");
    }
    fits = fits && n <= std::numeric_limits<std::uint32_t>::max() && bytes <= kMaxVoxelBytes / n;
    if (fits) bytes *= n;
  }
  if (!fits) {
    input.fail(place,
               std::to_string(size[0]) + " x " + std::to_string(size[1]) + " x " +
                   std::to_string(size[2]) + " voxels are more than can be addressed",
               "Check the header; Kiln reads sizes up to 4294967295.");
  }
  return bytes;
}

std::string geometry_fault(const Volume& volume) {
  constexpr double kMinSpacing = 1e-30, kMaxSpacing = 1e30;
  std::array<std::array<double, 3>, 3> unit{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(std::abs(volume.origin[a]) <= kMaxSpacing)) {
      return "the origin is not finite, or beyond 1e30";
    }
    const auto& axis = volume.axes[a];
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    if (!(length >= kMinSpacing && length <= kMaxSpacing)) {
      return "axis " + std::to_string(a) + " has a spacing that is zero, not finite, or not from " +
             "1e-30 to 1e30";
    }
    for (std::size_t c = 0; c < 3; ++c) unit[a][c] = axis[c] / length;
  }
  const auto& [u, v, w] = unit;
  const double volume_of_cell = u[0] * (v[1] * w[2] - v[2] * w[1]) +
                                u[1] * (v[2] * w[0] - v[0] * w[2]) +
                                u[2] * (v[0] * w[1] - v[1] * w[0]);
  if (!(std::abs(volume_of_cell) >= 1e-4)) return "the three axes lie in a plane, or nearly";
  return {};
}

void check_geometry(const VolumeInput& input, const std::string& place, const Volume& volume) {
  const std::string fault = geometry_fault(volume);
  if (!fault.empty()) input.fail(place, fault, "Correct the header, or export the volume again.");
}

void count_non_finite(const VolumeInput& input, const Volume& volume) {
  if (volume.type != VoxelType::f32 && volume.type != VoxelType::f64) return;
  with_voxel_type(volume.type, [&](auto value) {
    if constexpr (std::is_floating_point_v<decltype(value)>) {
      std::uint64_t count = 0, first = 0;
      const std::size_t n = volume.voxels.size() / sizeof value;
      for (std::size_t i = 0; i < n; ++i) {
        std::memcpy(&value, volume.voxels.data() + i * sizeof value, sizeof value);
        if (std::isfinite(value)) continue;
        if (count++ == 0) first = i;
      }
      if (count == 0) return;
      const std::uint64_t nx = volume.size[0], ny = volume.size[1];
      input.warn("non-finite-voxels",
                 std::to_string(count) + " voxels are NaN or infinite (the first: " +
                     std::to_string(first % nx) + ", " + std::to_string(first / nx % ny) + ", " +
                     std::to_string(first / nx / ny) + "); they were kept",
                 count);
    }
  });
}

void read_voxels(const VolumeInput& input, ByteStream& stream, ByteOrder order,
                 const Message& remedy, Volume& volume) {
  const std::uint64_t expected_bytes = voxel_count(volume) * size_of(volume.type);
  if (stream.max_remaining() < expected_bytes) {
    fail_for_missing_voxels(
        input, volume, expected_bytes,
        (stream.is_exact() ? "" : "at most ") + std::to_string(stream.max_remaining()), remedy);
  }
  require_memory("its " + sizes_text(volume), expected_bytes,
                 memory_failure(input.fail_with(), "voxels"));
  // Compressed data may be shorter than declared, so memory for voxels is only allocated as data
  // arrives.
  std::vector<std::byte>& voxels = volume.voxels;
  std::size_t have_bytes = 0;
  while (have_bytes < expected_bytes) {
    const std::uint64_t first_step = std::max<std::uint64_t>(1 << 22, stream.max_remaining() / 128);
    const std::uint64_t step =
        stream.is_exact() ? expected_bytes : std::max<std::uint64_t>(have_bytes, first_step);
    const auto next =
        static_cast<std::size_t>(std::min<std::uint64_t>(expected_bytes, have_bytes + step));
    voxels.reserve(next);
    voxels.resize(next);
    const std::size_t got = stream.read(voxels.data() + have_bytes, next - have_bytes);
    have_bytes += got;
    if (have_bytes < next)
      fail_for_missing_voxels(input, volume, expected_bytes, std::to_string(have_bytes), remedy);
  }
  std::uint64_t trailing = stream.is_exact() ? stream.max_remaining() : 0;
  if (!stream.is_exact()) {
    std::vector<std::byte> skipped_bytes(1 << 16);
    while (const std::size_t got = stream.read(skipped_bytes.data(), skipped_bytes.size()))
      trailing += got;
  }
  if (trailing != 0) {
    input.warn("trailing-bytes",
               std::to_string(trailing) + " bytes after the last voxel were ignored (" +
                   sizes_text(volume) + " were read)",
               trailing);
  }
  const bool is_little_endian = std::endian::native == std::endian::little;
  if (is_little_endian != (order == ByteOrder::little) && size_of(volume.type) > 1) {
    swap_bytes(voxels, size_of(volume.type));
  }
}

void read_voxels(const VolumeInput& input, const ByteSource& source, const VoxelPlace& place,
                 Volume& volume) {
  if (place.encoding == VoxelEncoding::text) {
    read_text(input, source, place, volume);
    return;
  }
  if (place.encoding == VoxelEncoding::packed) {
    const auto stream = inflating_stream(source, place.offset, input.fail_with());
    std::vector<std::byte> skip_buffer(1 << 16);
    for (std::uint64_t left = place.skip_unpacked; left != 0;) {
      const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(left, skip_buffer.size()));
      const std::size_t got = stream->read(skip_buffer.data(), part);
      if (got == 0) break;  // At the end of the data; read_voxels() reports that voxels are missing
      left -= got;
    }
    read_voxels(input, *stream, place.order, place.remedy, volume);
    count_non_finite(input, volume);
    return;
  }
  std::uint64_t offset = place.offset;
  if (place.at_end) {
    const std::uint64_t expected = voxel_count(volume) * size_of(volume.type);
    if (source.size() >= expected) offset = std::max(offset, source.size() - expected);
  }
  const auto stream = plain_stream(source, offset);
  read_voxels(input, *stream, place.order, place.remedy, volume);
  count_non_finite(input, volume);
}

}  // namespace kiln
