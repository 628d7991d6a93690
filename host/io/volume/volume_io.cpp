// Reads a volume: chooses the reader for a path.
#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include "base/formatted.h"
#include "base/lower_case.h"
#include "base/option.h"
#include "io/volume/volume_reader.h"
#include "kiln/volume.h"

namespace kiln {
namespace {

constexpr const char* kFormatNames[] = {"NRRD", "MetaImage", "NIfTI"};

/// A file's name, split into its stem and the extensions of its format.
struct Name {
  std::string stem, extension;
};

Name split_name(const std::filesystem::path& path) {
  Name name{path.stem().string(), lower_extension(path)};
  if (name.extension == ".gz") {
    const std::filesystem::path inner = name.stem;
    const std::string extension = lower_extension(inner);
    for (const char* packed : {".nii", ".hdr", ".img"}) {
      if (extension == packed) name = {inner.stem().string(), extension + ".gz"};
    }
  }
  return name;
}

std::optional<VolumeFormat> format_of(const std::string& extension) {
  if (extension == ".nrrd" || extension == ".nhdr") return VolumeFormat::nrrd;
  if (extension == ".mha" || extension == ".mhd") return VolumeFormat::meta_image;
  for (const char* known : {".nii", ".nii.gz", ".hdr", ".hdr.gz"}) {
    if (extension == known) return VolumeFormat::nifti;
  }
  return std::nullopt;
}

/// Name of the format that a file's first bytes indicate; empty if none is known.
std::string looks_like(std::string_view head) {
  const auto at = [head](std::size_t offset, std::string_view magic) {
    return head.size() >= offset && head.substr(offset).starts_with(magic);
  };
  if (at(0, "NRRD")) return "NRRD";
  if (at(344, "n+1") || at(344, "ni1") || at(4, "n+2") || at(4, "ni2")) return "NIfTI";
  if (at(0, "\x20\x42\x44\x56")) return "OpenVDB";
  if (at(128, "DICM")) return "DICOM";
  if (at(0, "\x89HDF")) return "HDF5";
  if (at(0, "II*") || at(0, std::string_view("MM\0*", 4))) return "a TIFF image";
  if (at(0, "\x89PNG")) return "a PNG image";
  if (at(0, "PK\x03\x04")) return "a ZIP archive";
  if (at(0, "\x1f\x8b")) return "a gzip archive";
  if (head.substr(0, 4096).find("ElementDataFile") != head.npos ||
      head.substr(0, 4096).find("DimSize") != head.npos) {
    return "MetaImage";
  }
  if (at(0, "# vtk DataFile")) return "legacy VTK";
  if (at(0, "<")) return "XML or HTML";
  return {};
}

VolumeInput make_input(const std::filesystem::path& path, std::vector<Warning>* warnings) {
  VolumeInput input;
  input.file = path.string();
  input.warnings = warnings;
  const FailWith fail = input.fail_with();
  input.open_beside = [path, fail](const std::string& name) {
    const std::filesystem::path path_beside_header = path.parent_path() / name;
    return open_file(path_beside_header, [fail, name, path_beside_header](
                                             const std::string& place, const std::string& problem,
                                             const Message& remedy) {
      const std::string file = path_beside_header.string();
      fail("data file " + file + (place.empty() ? "" : ", " + place), problem,
           place.empty() ? "Put the file beside the header, or correct its name there." : remedy);
    });
  };
  return input;
}

}  // namespace

void VolumeInput::fail(const std::string& place, const std::string& problem,
                       const Message& remedy) const {
  throw Error(ErrorCode::input,
              file + ": " + (place.empty() ? "" : place + ": ") + problem + ". " + remedy);
}

FailWith VolumeInput::fail_with() const {
  return
      [name = file](const std::string& place, const std::string& problem, const Message& remedy) {
        VolumeInput named;
        named.file = name;
        named.fail(place, problem, remedy);
      };
}

void VolumeInput::warn(std::string code, const Message& message, std::uint64_t count) const {
  if (warnings != nullptr) warnings->push_back({std::move(code), file + ": " + message, count});
}

Volume parse_volume(const VolumeInput& input, VolumeFormat format) {
  if (input.source->size() == 0) input.fail("", "the file is empty", "Export the volume again.");
  const std::string content = looks_like(input.source->head(4096));
  const std::string wanted = kFormatNames[static_cast<int>(format)];
  const bool packed_nifti = format == VolumeFormat::nifti && content == "a gzip archive";
  if (!content.empty() && content != wanted && !packed_nifti) {
    input.fail("", "it is named as " + wanted + " but its content looks like " + content,
               "Give it the extension of its format, or export the volume as " + wanted + ".");
  }
  switch (format) {
    case VolumeFormat::nrrd:
      return read_nrrd(input);
    case VolumeFormat::meta_image:
      return read_meta_image(input);
    case VolumeFormat::nifti:
      return read_nifti(input);
  }
  throw Error(ErrorCode::internal, "parse_volume: unknown format");
}

bool is_volume_name(const std::filesystem::path& path) {
  const Name name = split_name(path);
  return format_of(name.extension).has_value() || name.extension == ".vdb";
}

namespace {

Volume load(VolumeInput input, const std::filesystem::path& path) {
  const auto source = open_file(path, input.fail_with());
  input.source = source.get();
  const Name name = split_name(path);
  const auto format = format_of(name.extension);
  Volume volume;
  if (format) {
    volume = parse_volume(input, *format);
  } else if (name.extension == ".vdb") {
    if (!reads_openvdb()) {
      input.fail(
          "", "this build of Kiln does not read OpenVDB",
          "Install OpenVDB's library and headers and build Kiln again, or export the grid as "
          "NRRD.");
    }
    volume = read_openvdb(input, path);
  } else if (name.extension == ".img" || name.extension == ".img.gz") {
    input.fail("", "it is the data file of a NIfTI volume in two files",
               "Give its header, " + name.stem + ".hdr, instead.");
  } else {
    const std::string content = looks_like(source->head(4096));
    input.fail("",
               (name.extension.empty()
                    ? "it has no extension"
                    : "\"" + name.extension + "\" is not a volume format that Kiln knows") +
                   (content.empty() ? "" : "; its content looks like " + content),
               std::string("Kiln reads .nrrd, .nhdr, .mhd, .mha, .nii, .nii.gz and .hdr") +
                   (reads_openvdb() ? ", .vdb" : "") +
                   "; a file without header needs its dimensions and type.");
  }
  volume.name = name.stem;
  return volume;
}

}  // namespace

Volume load_volume(const std::filesystem::path& path, std::vector<Warning>* warnings) {
  const VolumeInput input = make_input(path, warnings);
  try {
    return load(input, path);
  } catch (const std::bad_alloc&) {
    input.fail(
        "voxels", "memory ran out",
        "Free some memory, raise the " + option("memory_limit") + ", or use a smaller volume.");
  }
}

Volume load_raw_volume(const std::filesystem::path& path, const RawVolumeLayout& layout,
                       std::vector<Warning>* warnings) {
  const auto usage = [&path](const std::string& message) {
    throw Error(ErrorCode::usage, path.string() + ": " + message);
  };
  for (std::size_t a = 0; a < 3; ++a) {
    if (layout.size[a] == 0 || layout.size[a] > 0xffffffffu) {
      usage("the dimensions are " + std::to_string(layout.size[0]) + " x " +
            std::to_string(layout.size[1]) + " x " + std::to_string(layout.size[2]) +
            "; give three from 1 to 4294967295.");
    }
    if (!(layout.spacing[a] >= 1e-30 && layout.spacing[a] <= 1e30)) {
      usage("the spacing along axis " + std::to_string(a) + " is " + decimal(layout.spacing[a]) +
            "; give a length from 1e-30 to 1e30.");
    }
  }
  if (layout.header_bytes < -1) {
    usage("the header to skip has " + std::to_string(layout.header_bytes) +
          " bytes; give 0 or more, or -1 for all that precedes the last voxels.");
  }
  VolumeInput input = make_input(path, warnings);
  const auto source = open_file(path, input.fail_with());
  input.source = source.get();
  const std::uint64_t voxels = check_size(input, "dimensions", layout.size, layout.type);
  const std::uint64_t header = layout.header_bytes >= 0
                                   ? static_cast<std::uint64_t>(layout.header_bytes)
                               : source->size() >= voxels ? source->size() - voxels
                                                          : 0;
  if (source->size() < header || source->size() - header != voxels) {
    const std::string sizes = std::to_string(layout.size[0]) + " x " +
                              std::to_string(layout.size[1]) + " x " +
                              std::to_string(layout.size[2]);
    input.fail("",
               "the dimensions " + sizes + " of " + name_of(layout.type) + " need " +
                   std::to_string(voxels) + " bytes" +
                   (header != 0 ? " after a header of " + std::to_string(header) : "") +
                   ", but the file has " + std::to_string(source->size()),
               "Correct the dimensions or the type, or give the number of header bytes to skip.");
  }
  Volume volume;
  volume.name = path.stem().string();
  volume.type = layout.type;
  for (std::size_t a = 0; a < 3; ++a) {
    volume.size[a] = static_cast<std::uint32_t>(layout.size[a]);
    volume.axes[a][a] = layout.spacing[a];
  }
  read_voxels(input, *source, {.order = layout.byte_order, .offset = header}, volume);
  return volume;
}

}  // namespace kiln
