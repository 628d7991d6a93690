#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <string>

#include "io/file/atomic_file.h"
#include "io/file/text_scanner.h"
#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

/// The shortest decimal text that reads as exactly the same number.
std::string text_of(double value) {
  std::array<char, 32> buffer{};
  const auto [end, status] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  static_cast<void>(status);  // 24 characters suffice for any double
  return {buffer.data(), end};
}

std::string text_of(const std::array<double, 3>& v) {
  return "(" + text_of(v[0]) + "," + text_of(v[1]) + "," + text_of(v[2]) + ")";
}

const char* nrrd_type(VoxelType type) {
  static constexpr const char* kNames[] = {"uint8",  "int8",  "uint16", "int16",
                                           "uint32", "int32", "float",  "double"};
  return kNames[static_cast<int>(type)];
}

}  // namespace

void save_nrrd(const Volume& volume, const std::filesystem::path& path) {
  std::uint64_t bytes = size_of(volume.type);
  bool fits = true;
  for (const std::uint32_t n : volume.size) {
    fits = fits && n != 0 && bytes <= volume.voxels.size() / n;
    if (fits) bytes *= n;
  }
  if (!fits || bytes != volume.voxels.size()) {
    throw Error(ErrorCode::usage, path.string() + ": the volume has " +
                                      std::to_string(volume.voxels.size()) +
                                      " bytes of voxels, which does not match its size and type.");
  }
  if (const std::string fault = geometry_fault(volume); !fault.empty()) {
    throw Error(ErrorCode::usage, path.string() + ": " + fault + ".");
  }
  std::string header = "NRRD0004\n";
  if (!volume.name.empty()) header += "content: " + printable(volume.name) + "\n";
  header += std::string("type: ") + nrrd_type(volume.type) + "\ndimension: 3\nspace dimension: 3\n";
  header += "sizes: " + std::to_string(volume.size[0]) + " " + std::to_string(volume.size[1]) +
            " " + std::to_string(volume.size[2]) + "\n";
  header += "space directions: " + text_of(volume.axes[0]) + " " + text_of(volume.axes[1]) + " " +
            text_of(volume.axes[2]) + "\n";
  header += "kinds: domain domain domain\nendian: little\nencoding: raw\n";
  header += "space origin: " + text_of(volume.origin) + "\n\n";

  AtomicFile file(path);
  file.write(header);
  const std::size_t each = size_of(volume.type);
  if (std::endian::native == std::endian::little || each == 1) {
    file.write(volume.voxels.data(), volume.voxels.size());
  } else {
    std::vector<std::byte> part;
    constexpr std::size_t kStep = std::size_t{1} << 20;
    for (std::size_t at = 0; at < volume.voxels.size(); at += kStep) {
      const auto begin = volume.voxels.begin() + static_cast<std::ptrdiff_t>(at);
      part.assign(begin,
                  begin + static_cast<std::ptrdiff_t>(std::min(kStep, volume.voxels.size() - at)));
      for (auto value = part.begin(); value != part.end();
           value += static_cast<std::ptrdiff_t>(each)) {
        std::reverse(value, value + static_cast<std::ptrdiff_t>(each));
      }
      file.write(part.data(), part.size());
    }
  }
  file.commit();
}

}  // namespace kiln
