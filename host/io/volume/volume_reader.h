// Shared by the volume readers: errors, voxel offsets, and reading of voxels.
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

/// A volume file, and the destination of warnings.
struct VolumeInput {
  std::string file;                          ///< Path as the caller gave it; used in messages.
  const ByteSource* source = nullptr;        ///< The file's bytes.
  std::vector<Warning>* warnings = nullptr;  ///< Receives warnings; may be null.
  /// Opens the file that a header names for its voxels; relative names start at the header's folder. Throws
  /// Error(input). Null if the volume comes from memory.
  std::function<std::unique_ptr<ByteSource>(const std::string& name)> open_beside;

  /// Throws Error(input): "<file>: <place>: <problem>. <remedy>." The place may be empty.
  [[noreturn]] void fail(const std::string& place, const std::string& problem,
                         const Message& remedy) const;
  void warn(std::string code, const Message& message, std::uint64_t count) const;
  FailWith fail_with() const;
};

/// Reads a volume; `name` is left empty. Memory is linear in the size of the file and the volume. The
/// volume is allocated only after the file's size was checked to suffice (compressed files: to
/// possibly suffice).
/// \throws Error(input)
Volume parse_volume(const VolumeInput& input, VolumeFormat format);

/// Readers of the formats. Each throws Error(input) for unusable files, and appends other faults to
/// input.warnings.
Volume read_nrrd(const VolumeInput& input);
Volume read_meta_image(const VolumeInput& input);
Volume read_nifti(const VolumeInput& input);
/// Reads OpenVDB from a path, since the library opens files itself. May be called only if reads_openvdb() is true.
Volume read_openvdb(const VolumeInput& input, const std::filesystem::path& path);

/// Checks that an OpenVDB file's header, metadata, descriptors and root nodes fit within its size:
/// without such checks, OpenVDB would allocate memory by damaged lengths and counts, or read beyond the end.
/// \throws Error(input) "damaged", with the byte
void check_openvdb_frame(const VolumeInput& input);

/// Largest size of a text header, bytes.
constexpr std::size_t kHeaderLimit = std::size_t{1} << 20;

enum class VoxelEncoding { plain, packed, text };

/// Offset and encoding of voxels.
struct VoxelPlace {
  VoxelEncoding encoding = VoxelEncoding::plain;
  ByteOrder order = ByteOrder::little;
  std::uint64_t offset = 0;  ///< Offset of the encoded voxels in their file, bytes.
  bool at_end = false;       ///< They are the file's last bytes (uncompressed only); `offset` is a
                             ///< lower bound.
  std::uint64_t skip_unpacked = 0;  ///< Bytes before the first voxel after decompression
                                    ///< (compressed only).
  std::string remedy = "Copy or export the file again.";  ///< Remedy if voxels are missing.
};

/// Bytes of all voxels. Checks each size, and that the total can be addressed.
/// \param place  place of the sizes in the header, for messages
/// \throws Error(input)
std::uint64_t check_size(const VolumeInput& input, const std::string& place,
                         const std::array<std::uint64_t, 3>& size, VoxelType type);

/// Checks that origin and axes are usable: finite, lengths in range, independent.
/// \returns the fault, or an empty text
std::string geometry_fault(const Volume& volume);
/// \throws Error(input) if geometry_fault() finds a fault
void check_geometry(const VolumeInput& input, const std::string& place, const Volume& volume);

/// Fills volume.voxels by volume.size and volume.type. Warns of trailing bytes and of non-finite
/// voxels.
/// \param source  the file that holds the voxels: input.source or another one
/// \throws Error(input) too few bytes (expected and found are named), damaged, or not numbers (text)
void read_voxels(const VolumeInput& input, const ByteSource& source, const VoxelPlace& place,
                 Volume& volume);
/// Reads voxels from a stream that is at the first voxel. Does not warn of non-finite voxels.
void read_voxels(const VolumeInput& input, ByteStream& stream, ByteOrder order,
                 const Message& remedy, Volume& volume);

/// Warns of voxels that are NaN or infinite.
void count_non_finite(const VolumeInput& input, const Volume& volume);

}  // namespace kiln
