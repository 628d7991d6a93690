// Shared by the volume readers: errors, places of voxels, and reading of them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "io/file/byte_source.h"
#include "kiln/error.h"
#include "kiln/volume.h"

namespace kiln {

enum class VolumeFormat { nrrd, meta_image, nifti };

/// A volume file and what to do with its faults.
struct VolumeInput {
  std::string file;                          ///< Path as the caller gave it; used in messages.
  const ByteSource* source = nullptr;        ///< The file's bytes.
  std::vector<Warning>* warnings = nullptr;  ///< Gets a warning for each imperfection; may be null.
  /// Opens the file that a header names for its voxels, beside the header where the name is relative.
  /// Throws Error(input). Null: there are no other files.
  std::function<std::unique_ptr<ByteSource>(const std::string& name)> open_beside;

  /// Throws Error(input): "<file>: <place>: <problem>. <remedy>." The place may be empty.
  [[noreturn]] void fail(const std::string& place, const std::string& problem,
                         const Message& remedy) const;
  void warn(std::string code, const Message& message, std::uint64_t count) const;
  FailWith fail_with() const;
};

/// Reads a volume; `name` is left empty. Memory is linear in the size of the file and the volume. The
/// volume is allocated once the file is known to be long enough for it (packed: to be possibly so).
/// \throws Error(input)
Volume parse_volume(const VolumeInput& input, VolumeFormat format);

/// Each throws Error(input) for what it cannot use, and appends to input.warnings for the rest.
Volume read_nrrd(const VolumeInput& input);
Volume read_meta_image(const VolumeInput& input);
Volume read_nifti(const VolumeInput& input);
/// By path, since OpenVDB opens files itself; only where reads_openvdb().
Volume read_openvdb(const VolumeInput& input, const std::filesystem::path& path);

/// True if an OpenVDB file's header, metadata, descriptors and root nodes fit within its size: OpenVDB
/// allocates what lengths and counts there say, or reads on for as long, before it knows.
/// \throws Error(input) "damaged", with the byte
void check_openvdb_frame(const VolumeInput& input);

/// Headers as text are at most this long.
constexpr std::size_t kHeaderLimit = std::size_t{1} << 20;

enum class VoxelEncoding { plain, packed, text };

/// Offset and storage of voxels.
struct VoxelPlace {
  VoxelEncoding encoding = VoxelEncoding::plain;
  ByteOrder order = ByteOrder::little;
  std::uint64_t offset = 0;  ///< Offset of the encoded voxels in their file, bytes.
  bool at_end = false;       ///< They are the file's last bytes (plain only); `offset` is a least.
  std::uint64_t skip_unpacked = 0;  ///< Bytes before the first voxel once unpacked (packed only).
  std::string remedy = "Copy or export the file again.";  ///< Advice where voxels are missing.
};

/// Bytes of all voxels. Checks each size, and that the product can be addressed.
/// \param place  of the sizes in the header, for messages
/// \throws Error(input)
std::uint64_t check_size(const VolumeInput& input, const std::string& place,
                         const std::array<std::uint64_t, 3>& size, VoxelType type);

/// Origin and axes are usable: finite, lengths in range, independent. Empty, or what is wrong.
std::string geometry_fault(const Volume& volume);
/// \throws Error(input) where there is a fault
void check_geometry(const VolumeInput& input, const std::string& place, const Volume& volume);

/// Fills volume.voxels; volume.size and volume.type say how many and what. Warns of trailing bytes and
/// of voxels that are not finite.
/// \param source  the file that holds them: input.source or another
/// \throws Error(input) too few bytes (expected and found are named), damaged, or not numbers (text)
void read_voxels(const VolumeInput& input, const ByteSource& source, const VoxelPlace& place,
                 Volume& volume);
/// The same from a stream that stands at the first voxel, but for voxels that are not finite.
void read_voxels(const VolumeInput& input, ByteStream& stream, ByteOrder order,
                 const Message& remedy, Volume& volume);

/// Warns of voxels that are NaN or infinite.
void count_non_finite(const VolumeInput& input, const Volume& volume);

}  // namespace kiln
