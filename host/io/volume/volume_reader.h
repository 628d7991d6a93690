// Shared by the readers of volumes: errors, places of voxels, and reading voxels.
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

/// A volume file to read, and where warnings go.
struct VolumeInput {
  std::string file;                          ///< Path as the caller gave it, for messages
  const ByteSource* source = nullptr;        ///< The file's bytes.
  std::vector<Warning>* warnings = nullptr;  ///< Receives warnings; may be null.
  /// Opens the file of voxels that a header names. A relative name starts at the header's folder.
  /// Throws Error(input). Null if the volume was given in memory.
  std::function<std::unique_ptr<ByteSource>(const std::string& name)> open_beside;

  /// Throws Error(input): "<file>: <place>: <problem>. <remedy>." The place may be empty.
  [[noreturn]] void fail(const std::string& place, const std::string& problem,
                         const Message& remedy) const;
  void warn(std::string code, const Message& message, std::uint64_t count) const;
  FailWith fail_with() const;
};

/// Reads a volume; its `name` stays empty. Memory is linear in the sizes of the file and the
/// volume. The volume is only allocated after a check that the file has enough bytes, or, if it is
/// compressed, may have.
/// \throws Error(input)
Volume parse_volume(const VolumeInput& input, VolumeFormat format);

/// The readers of the formats. Each throws Error(input) if a file cannot be used, and adds other
/// problems to input.warnings.
Volume read_nrrd(const VolumeInput& input);
Volume read_meta_image(const VolumeInput& input);
Volume read_nifti(const VolumeInput& input);
/// Reads OpenVDB from a path, since the library opens files itself. May be called only if reads_openvdb() is true.
Volume read_openvdb(const VolumeInput& input, const std::filesystem::path& path);

/// Checks that the header of an OpenVDB file, its metadata, descriptors and root nodes fit in the
/// file's size. Without these checks, OpenVDB would trust damaged lengths and counts: it would
/// allocate too much memory, or read beyond the end.
/// \throws Error(input) "damaged", with the byte's offset
void check_openvdb_frame(const VolumeInput& input);

/// Maximum size of a text header in bytes.
constexpr std::size_t kHeaderLimit = std::size_t{1} << 20;

enum class VoxelEncoding { plain, packed, text };

/// Where and how voxels are stored in a file.
struct VoxelPlace {
  VoxelEncoding encoding = VoxelEncoding::plain;
  ByteOrder order = ByteOrder::little;
  std::uint64_t offset = 0;  ///< Offset of the encoded voxels in their file, bytes.
  /// True if the voxels are the last bytes of the file (only allowed without compression); `offset`
  /// is then a lower bound of their position
  bool at_end = false;
  /// Number of bytes before the first voxel after decompression; for compressed data only
  std::uint64_t skip_unpacked = 0;
  std::string remedy = "Copy or export the file again.";  ///< Remedy if voxels are missing.
};

/// Number of bytes of all voxels. Checks each size, and that so many bytes can be addressed.
/// \param place  place of the sizes in the header, for messages
/// \throws Error(input)
std::uint64_t check_size(const VolumeInput& input, const std::string& place,
                         const std::array<std::uint64_t, 3>& size, VoxelType type);

/// Checks that the origin and the axes can be used: they must be finite, of a length within range,
/// and independent.
/// \returns what is wrong, or an empty text
std::string geometry_fault(const Volume& volume);
/// \throws Error(input) if geometry_fault() finds something wrong
void check_geometry(const VolumeInput& input, const std::string& place, const Volume& volume);

/// Reads volume.voxels, for the given volume.size and volume.type. Warns of bytes after the last
/// voxel, and of non-finite voxels.
/// \param source  the file that contains the voxels: input.source or another one
/// \throws Error(input) if there are too few bytes (the message says how many are needed and
///   found), if they are damaged, or if text contains something other than numbers
void read_voxels(const VolumeInput& input, const ByteSource& source, const VoxelPlace& place,
                 Volume& volume);
/// Reads voxels from a stream whose position is that of the first voxel. Does not warn of
/// non-finite voxels.
void read_voxels(const VolumeInput& input, ByteStream& stream, ByteOrder order,
                 const Message& remedy, Volume& volume);

/// Warns of voxels that are NaN or infinite.
void count_non_finite(const VolumeInput& input, const Volume& volume);

}  // namespace kiln
