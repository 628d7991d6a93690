// NIfTI 1 and 2, in one file or two. https://nifti.nimh.nih.gov/nifti-1, https://nifti.nimh.nih.gov/nifti-2
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <type_traits>

#include "base/formatted.h"
#include "base/lower_case.h"
#include "base/voxel_type.h"
#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

constexpr const char* kExportAgain = "Export the volume again as one NIfTI file (.nii or .nii.gz).";
constexpr const char* kExportAgainBoth = "Copy or export both files again.";

constexpr std::size_t kNifti1HeaderBytes = 348,
                      kNifti2HeaderBytes = 540;  // Sizes of the headers of both versions

/// Codes of the header field `datatype`.
enum : std::int64_t {
  kUint8 = 2,
  kInt16 = 4,
  kInt32 = 8,
  kFloat32 = 16,
  kComplex64 = 32,
  kFloat64 = 64,
  kRgb24 = 128,
  kInt8 = 256,
  kUint16 = 512,
  kUint32 = 768,
  kComplex128 = 1792,
  kComplex256 = 2048,
  kRgba32 = 2304
};

/// The fields of the header that Kiln needs, in the machine's byte order.
struct NiftiFields {
  bool is_nifti2 = false;    ///< True for NIfTI-2
  bool is_detached = false;  ///< True if the voxels are in a separate file
  ByteOrder order = ByteOrder::little;
  std::array<std::int64_t, 8> dim{};
  std::int64_t type = 0;
  double offset = 0, slope = 0, intercept = 0;
  std::array<double, 8>
      /// The header's `pixdim`. Entry 0 is the sign of the third axis; entries 1 to 3 are the
      /// spacings
      pixdim{};
  std::int64_t qform_code = 0, sform_code = 0;
  /// Components b, c and d of the rotation's quaternion; the position of the first voxel
  std::array<double, 3> quaternion{}, qoffset{};
  std::array<std::array<double, 4>, 3> srow{};
};

class HeaderBytes {
 public:
  explicit HeaderBytes(const std::array<std::byte, kNifti2HeaderBytes>& bytes) : bytes_(bytes) {}
  void set_order(ByteOrder order) {
    swap_ = (order == ByteOrder::little) != (std::endian::native == std::endian::little);
  }
  template <typename T>
  T get(std::size_t offset) const {
    std::array<std::byte, sizeof(T)> raw{};
    std::memcpy(raw.data(), bytes_.data() + offset, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }

 private:
  const std::array<std::byte, kNifti2HeaderBytes>& bytes_;
  bool swap_ = false;
};

/// Reads the fields for the position of voxels in space.
/// \param pixdim  offset of the 8 numbers of `pixdim` in the header
/// \param forms   offset of the quaternion in the header; the offsets and the three rows of the
///   sform follow
template <typename T>
void read_places(const HeaderBytes& header, std::size_t pixdim, std::size_t forms,
                 NiftiFields& fields) {
  const auto number = [&](std::size_t first, std::size_t i) {
    return static_cast<double>(header.get<T>(first + i * sizeof(T)));
  };
  for (std::size_t i = 0; i < 8; ++i) fields.pixdim[i] = number(pixdim, i);
  for (std::size_t i = 0; i < 3; ++i) fields.quaternion[i] = number(forms, i);
  for (std::size_t i = 0; i < 3; ++i) fields.qoffset[i] = number(forms, 3 + i);
  for (std::size_t i = 0; i < 12; ++i) fields.srow[i / 4][i % 4] = number(forms, 6 + i);
}

NiftiFields parse_fields(const VolumeInput& input,
                         const std::array<std::byte, kNifti2HeaderBytes>& raw, std::size_t have) {
  NiftiFields fields;
  HeaderBytes header(raw);
  bool is_known = false;
  for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
    header.set_order(order);
    const auto size = header.get<std::int32_t>(0);
    if (size != std::int32_t{kNifti1HeaderBytes} && size != std::int32_t{kNifti2HeaderBytes})
      continue;
    fields.order = order;
    fields.is_nifti2 = size == std::int32_t{kNifti2HeaderBytes};
    is_known = true;
    break;
  }
  if (!is_known) {
    input.fail("byte 0", "the header's size is neither 348 nor 540, so this is not NIfTI",
               kExportAgain);
  }
  header.set_order(fields.order);
  const std::size_t size = fields.is_nifti2 ? kNifti2HeaderBytes : kNifti1HeaderBytes;
  if (have < size) {
    input.fail("header",
               "it should have " + std::to_string(size) + " bytes, but the file has " +
                   std::to_string(have) + " (truncated)",
               "Copy or export the file again.");
  }
  char magic[4] = {};
  std::memcpy(magic, raw.data() + (fields.is_nifti2 ? 4 : 344), 3);
  const std::string found_magic = magic;
  fields.is_detached = found_magic == (fields.is_nifti2 ? "ni2" : "ni1");
  if (!fields.is_detached && found_magic != (fields.is_nifti2 ? "n+2" : "n+1")) {
    input.fail(
        "magic",
        "it is none of \"n+1\", \"ni1\", \"n+2\" and \"ni2\"; the file may be of Analyze 7.5",
        kExportAgain);
  }
  for (std::size_t i = 0; i < 8; ++i) {
    fields.dim[i] = fields.is_nifti2 ? header.get<std::int64_t>(16 + 8 * i)
                                     : std::int64_t{header.get<std::int16_t>(40 + 2 * i)};
  }
  fields.type = header.get<std::int16_t>(fields.is_nifti2 ? 12 : 70);
  if (fields.is_nifti2) {
    fields.offset = static_cast<double>(header.get<std::int64_t>(168));
    fields.slope = header.get<double>(176);
    fields.intercept = header.get<double>(184);
    fields.qform_code = header.get<std::int32_t>(344);
    fields.sform_code = header.get<std::int32_t>(348);
    read_places<double>(header, 104, 352, fields);
  } else {
    fields.offset = header.get<float>(108);
    fields.slope = header.get<float>(112);
    fields.intercept = header.get<float>(116);
    fields.qform_code = header.get<std::int16_t>(252);
    fields.sform_code = header.get<std::int16_t>(254);
    read_places<float>(header, 76, 256, fields);
  }
  return fields;
}

VoxelType voxel_type(const VolumeInput& input, std::int64_t type) {
  switch (type) {
    case kUint8:
      return VoxelType::u8;
    case kInt8:
      return VoxelType::i8;
    case kUint16:
      return VoxelType::u16;
    case kInt16:
      return VoxelType::i16;
    case kUint32:
      return VoxelType::u32;
    case kInt32:
      return VoxelType::i32;
    case kFloat32:
      return VoxelType::f32;
    case kFloat64:
      return VoxelType::f64;
    case kRgb24:
    case kRgba32:
    case kComplex64:
    case kComplex128:
    case kComplex256:
      input.fail("datatype", "code " + std::to_string(type) + " has several values a voxel",
                 "Save one component as a separate volume.");
    default:
      break;
  }
  input.fail("datatype", "Kiln does not read voxels of code " + std::to_string(type),
             "Save the volume with 8, 16 or 32-bit integers, float or double.");
}

/// Checks sizes and the offset of the voxels.
void check_fields(const VolumeInput& input, const NiftiFields& fields, Volume& volume) {
  if (fields.dim[0] < 3 || fields.dim[0] > 7) {
    input.fail("dim[0]", "it has " + std::to_string(fields.dim[0]) + " dimensions",
               "Kiln reads volumes of three dimensions; further dimensions must have the size 1.");
  }
  std::array<std::uint64_t, 3> size{};
  for (std::size_t i = 1; i <= static_cast<std::size_t>(fields.dim[0]); ++i) {
    const std::string place = "dim[" + std::to_string(i) + "]";
    if (fields.dim[i] < 0) {
      input.fail(place, "a size is " + std::to_string(fields.dim[i]), kExportAgain);
    }
    if (i <= 3) {
      size[i - 1] = static_cast<std::uint64_t>(fields.dim[i]);
    } else if (fields.dim[i] > 1) {
      input.fail(place,
                 std::to_string(fields.dim[i]) + (i == 4 ? " time steps" : " values a voxel"),
                 i == 4 ? "Save one time step as a volume of three dimensions."
                        : "Save one component as a separate volume.");
    }
  }
  check_size(input, "dim", size, volume.type);
  for (std::size_t a = 0; a < 3; ++a) volume.size[a] = static_cast<std::uint32_t>(size[a]);
  if (!(fields.offset >= 0 && fields.offset <= 2147483520.0)) {
    input.fail("vox_offset",
               "the voxels are said to begin at byte " + formatted("%.0f", fields.offset),
               kExportAgain);
  }
}

using Matrix = std::array<std::array<double, 4>, 3>;

/// Method 2 of the standard: a rotation, given as a quaternion without its first component, the
/// spacings, and the sign of the third axis.
Matrix qform_axes(const NiftiFields& fields) {
  auto [b, c, d] = fields.quaternion;
  const double squared = b * b + c * c + d * d;
  double a = 1 - squared;
  if (a < 1e-7) {
    // For a rotation by 180 degrees, rounding may make the quaternion longer than 1.
    const double scale = 1 / std::sqrt(squared);
    b *= scale;
    c *= scale;
    d *= scale;
    a = 0;
  } else {
    a = std::sqrt(a);
  }
  const double rotation[3][3] = {
      {a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
      {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
      {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c}};
  Matrix matrix{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double spacing = fields.pixdim[axis + 1] > 0 ? fields.pixdim[axis + 1] : 1;
      const double sign = axis == 2 && fields.pixdim[0] < 0 ? -1 : 1;
      matrix[row][axis] = rotation[row][axis] * spacing * sign;
    }
    matrix[row][3] = fields.qoffset[row];
  }
  return matrix;
}

void place_in_space(const VolumeInput& input, const NiftiFields& fields, Volume& volume) {
  const auto set = [&volume](const Matrix& m) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t a = 0; a < 3; ++a) volume.axes[a][c] = m[c][a];
      volume.origin[c] = m[c][3];
    }
    return geometry_fault(volume).empty();
  };
  const auto unusable = [&input](const char* form) {
    input.warn(
        "bad-transform",
        std::string("the ") + form + " has no three independent, finite axes; it was ignored", 1);
  };
  if (fields.sform_code > 0) {
    if (set(fields.srow)) return;
    unusable("sform");
  }
  if (fields.qform_code > 0) {
    if (set(qform_axes(fields))) return;
    unusable("qform");
  }
  volume.origin = {};
  volume.axes = {};
  for (std::size_t a = 0; a < 3; ++a) {
    const double spacing = std::abs(fields.pixdim[a + 1]);
    volume.axes[a][a] = spacing > 0 && std::isfinite(spacing) ? spacing : 1;
  }
  check_geometry(input, "pixdim", volume);
}

void apply_scale(const VolumeInput& input, const NiftiFields& fields, Volume& volume) {
  if (fields.slope == 0 || (fields.slope == 1 && fields.intercept == 0)) return;
  if (!std::isfinite(fields.slope) || !std::isfinite(fields.intercept)) {
    input.warn("ignored-scale",
               "scl_slope or scl_inter is not finite; values are as they are stored", 1);
    return;
  }
  with_voxel_type(volume.type, [&](auto value) {
    const std::size_t count = volume.voxels.size() / sizeof value;
    std::vector<std::byte> scaled_values(count * sizeof(float));
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(&value, volume.voxels.data() + i * sizeof value, sizeof value);
      const auto result =
          static_cast<float>(static_cast<double>(value) * fields.slope + fields.intercept);
      std::memcpy(scaled_values.data() + i * sizeof(float), &result, sizeof(float));
    }
    volume.voxels = std::move(scaled_values);
  });
  volume.type = VoxelType::f32;
}

std::unique_ptr<ByteStream> open_stream(const VolumeInput& input, const ByteSource& source) {
  return source.head(2) == "\x1f\x8b" ? inflating_stream(source, 0, input.fail_with())
                                      : plain_stream(source, 0);
}

/// Opens the file of voxels that belongs to a header: it has the same name with another extension.
std::unique_ptr<ByteSource> open_image(const VolumeInput& input) {
  std::string stem = std::filesystem::path(input.file).filename().string();
  const std::string header = lower_case(stem);
  const bool packed = header.ends_with(".hdr.gz");
  if (!input.open_beside || !(packed || header.ends_with(".hdr"))) {
    input.fail("magic", "the header and the voxels are in two files",
               "Name the header NAME.hdr, beside the voxels in NAME.img.");
  }
  stem.resize(stem.size() - (packed ? 7 : 4));
  // Either both files are compressed or neither is, as nibabel and FSL write them.
  const auto path_beside_header = [&](const char* extension) {
    return std::filesystem::path(input.file).parent_path() / (stem + extension);
  };
  for (const char* extension : {".img", ".IMG", ".img.gz"}) {
    std::error_code ignored_error;
    if (std::filesystem::exists(path_beside_header(extension), ignored_error)) {
      return input.open_beside(stem + extension);
    }
  }
  return input.open_beside(stem + ".img");  // Throws the error for a missing file
}

/// Skips the bytes before the voxels.
/// \param at  current offset of the stream
void skip_to(ByteStream& stream, std::uint64_t at, std::uint64_t begin) {
  std::array<std::byte, 4096> skip_buffer{};
  while (at < begin) {
    const std::size_t got = stream.read(
        skip_buffer.data(), static_cast<std::size_t>(std::min<std::uint64_t>(begin - at, 4096)));
    if (got == 0) break;  // At the end of the file; the caller reports that voxels are missing
    at += got;
  }
}

}  // namespace

Volume read_nifti(const VolumeInput& input) {
  const auto stream = open_stream(input, *input.source);
  std::array<std::byte, kNifti2HeaderBytes> raw{};
  std::size_t have = stream->read(raw.data(), kNifti1HeaderBytes);
  if (have < 4) {
    input.fail("header", "the file has only " + std::to_string(have) + " bytes (truncated)",
               "Copy or export the file again.");
  }
  // The longer header of version 2 is only read if the file has that version: in version 1, the
  // bytes after the header may be voxels.
  const bool longer = static_cast<int>(raw[0]) == 0x1c || static_cast<int>(raw[3]) == 0x1c;
  if (longer && have == kNifti1HeaderBytes)
    have += stream->read(raw.data() + kNifti1HeaderBytes, kNifti2HeaderBytes - kNifti1HeaderBytes);
  const NiftiFields fields = parse_fields(input, raw, have);

  Volume volume;
  volume.type = voxel_type(input, fields.type);
  check_fields(input, fields, volume);
  place_in_space(input, fields, volume);

  const auto begin = static_cast<std::uint64_t>(fields.offset);
  if (fields.is_detached) {
    const auto image = open_image(input);
    const auto voxels = open_stream(input, *image);
    skip_to(*voxels, 0, begin);
    read_voxels(input, *voxels, fields.order, kExportAgainBoth, volume);
  } else {
    skip_to(*stream, have, begin);
    read_voxels(input, *stream, fields.order, "Copy or export the file again.", volume);
  }
  apply_scale(input, fields, volume);
  count_non_finite(input, volume);
  return volume;
}

}  // namespace kiln
