#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kiln/error.h"
#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Types of voxels, in the machine's byte order.
enum class VoxelType : std::uint8_t { u8, i8, u16, i16, u32, i32, f32, f64 };

/// Bytes of one voxel.
constexpr std::size_t size_of(VoxelType type) {
  switch (type) {
    case VoxelType::u8:
    case VoxelType::i8:
      return 1;
    case VoxelType::u16:
    case VoxelType::i16:
      return 2;
    case VoxelType::u32:
    case VoxelType::i32:
    case VoxelType::f32:
      return 4;
    case VoxelType::f64:
      return 8;
  }
  return 0;
}

/// Returns the name of a type: "u8", "i8", "u16", "i16", "u32", "i32", "f32" or "f64".
const char* name_of(VoxelType type);

/// Returns the type with exactly this name, if there is one.
std::optional<VoxelType> voxel_type_of(std::string_view name);

/// A scalar field sampled on a regular grid. A voxel is a sample at a grid point, not a box.
struct Volume {
  std::string name = {};                ///< Stem of the file, or any name; used in messages.
  std::array<std::uint32_t, 3> size{};  ///< Number of voxels along x, y, z.
  VoxelType type = VoxelType::u8;       ///< Type of all voxels.
  std::array<double, 3> origin{};       ///< World position of voxel (0, 0, 0).
  /// World position of voxel (i, j, k) = origin + i axes[0] + j axes[1] + k axes[2]: an axis' length is
  /// the spacing. Axes are linearly independent; a left-handed set mirrors the volume.
  std::array<std::array<double, 3>, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::vector<std::byte> voxels = {};  ///< size[0] * size[1] * size[2] values, x fastest.
};

/// Reads a volume in the format of the name's extension (case ignored):
///
///   .nrrd, .nhdr  NRRD 1 to 5, attached or detached data, also in several files (LIST, or a pattern
///                 such as slice%03d.raw 1 100 1); raw, gzip, text. `space directions` and `space
///                 origin`, else `spacings`, else `axis mins` and `axis maxs`, else spacing 1. Left-handed spaces
///                 (left-anterior-superior, 3D-left-handed) get x negated, so that no picture is
///                 mirrored.
///   .mha, .mhd    MetaImage, data LOCAL or in a file of its own; raw, compressed (zlib), text.
///                 TransformMatrix, ElementSpacing (else ElementSize), Offset.
///   .nii, .nii.gz NIfTI 1 and 2, in one file, or in two: NAME.hdr with the voxels in NAME.img beside it
///   .hdr, .hdr.gz (either may be compressed). Axes come from the sform if its code is positive, else from
///                 the qform, else from the pixel sizes. If scl_slope and scl_inter change values, they are
///                 applied, and the volume is f32.
///   .vdb          OpenVDB, in builds with it (reads_openvdb()): the first float or double grid as f32. It covers
///                 the bounding box of its active voxels and 2 voxels more on each side; these hold the
///                 value of the background (in a level set, of the inside).
///
/// Positions are in the file's own world and units: left-posterior-superior in most NRRD and MetaImage files,
/// right-anterior-superior in NIfTI (the same body, rotated by 180 degrees about z). Both byte orders are read.
/// Limits: one value a voxel; three axes (others must have size 1); a header of a MiB; axes with lengths from
/// 1e-30 to 1e30, at least a 1e-4th part of a right angle apart. 64-bit integers, bzip2, and MetaImages over
/// several files are refused with a message that names them.
///
/// Imperfect data that can be handled is counted in `warnings`:
///
///   non-finite-voxels  voxels that are NaN or infinite: kept; see contour()
///   trailing-bytes     bytes after the last voxel: ignored
///   assumed-cells      NRRD axes with an extent but no centering: taken as cells
///   missing-spacing    an axis without a usable spacing: the spacing is 1
///   bad-transform      a NIfTI form without three independent axes: the next form of the rule above is used
///   ignored-scale      a mapping of values that is not applied: NIfTI's where it is not finite,
///                      MetaImage's ElementToIntensityFunction always
///   ignored-grids      further grids of an OpenVDB file: ignored
///
/// \param path      the file
/// \param warnings  receives warnings of imperfect data that was handled; may be null
/// \throws Error(input) names the file, the place (line, field or byte) and the remedy: no file; unknown format,
///         or one that contradicts the name; truncated (expected and found bytes); a size of 0 or beyond 2^32 - 1
///         on an axis; an encoding or type that Kiln does not read; more than one value a voxel; several time
///         steps; axes that are not independent.
/// Thread safety: may be called from several threads. Memory is the volume's, plus a few MiB: a header
/// that claims more than its file could hold is refused before anything is allocated for it.
/// \see http://teem.sourceforge.net/nrrd/format.html,
///      https://itk.org/Wiki/ITK/MetaIO/Documentation, https://nifti.nimh.nih.gov/nifti-1
Volume load_volume(const std::filesystem::path& path, std::vector<Warning>* warnings = nullptr);

/// True if this build reads .vdb. Any thread may call this function and is_volume_name().
bool reads_openvdb();

/// True if load_volume() knows the name's extension, .vdb included. Does not open the file.
bool is_volume_name(const std::filesystem::path& path);

enum class ByteOrder : std::uint8_t { little, big };

/// Layout of a file without a header.
struct RawVolumeLayout {
  /// Number of voxels along x (fastest in the file), y and z.
  std::array<std::uint64_t, 3> size{};
  VoxelType type = VoxelType::u8;  ///< Type of all voxels.
  /// Distance of neighbouring voxels along each axis, world units, positive.
  std::array<double, 3> spacing{1, 1, 1};
  ByteOrder byte_order = ByteOrder::little;  ///< Byte order of values of more than one byte.
  /// Number of bytes to skip before the voxels; -1: the voxels are the last bytes of the file.
  std::int64_t header_bytes = 0;
};

/// Reads a volume without header. The file's size must match the layout exactly: otherwise the layout
/// is wrong. Warnings, thread safety and guarantees are those of load_volume().
/// \throws Error(usage) for a size, spacing or number of header bytes out of range
/// \throws Error(input) if the file is missing, or its size does not match the layout; the message
///         names both numbers of bytes
Volume load_raw_volume(const std::filesystem::path& path, const RawVolumeLayout& layout,
                       std::vector<Warning>* warnings = nullptr);

/// Writes a volume as NRRD: raw, little-endian, with exact `space directions` and `space origin`;
/// load_volume() restores the same volume. The file is written completely or not at all. Threads may
/// save at the same time to different names.
/// \throws Error(usage) if the number of voxels does not match `size`, or the axes are not usable
/// \throws Error(output)
void save_nrrd(const Volume& volume, const std::filesystem::path& path);

}  // namespace kiln
