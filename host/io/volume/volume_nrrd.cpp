// NRRD, versions 1 to 5. http://teem.sourceforge.net/nrrd/format.html
#include <array>
#include <limits>
#include <utility>

#include "io/volume/nrrd_axes.h"
#include "io/volume/volume_header.h"
#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

constexpr const char* kExportAgain = "Correct the header, or export the volume again.";

struct Header {
  HeaderFields fields;
  std::size_t end = 0;  ///< Where what follows the blank line begins.
};

/// Names of fields are compared without case and blanks: "data file" is "datafile".
std::string field_key(std::string_view name) {
  std::string key;
  for (const char c : lower_case(name)) {
    if (c != ' ' && c != '\t') key += c;
  }
  return key;
}

bool known_field(std::string_view key) {
  static constexpr std::string_view kNown[] = {"dimension",   "type",       "sizes",
                                               "spacings",    "encoding",   "endian",
                                               "content",     "datafile",   "lineskip",
                                               "byteskip",    "kinds",      "space",
                                               "spaceorigin", "units",      "spacedirections",
                                               "labels",      "spaceunits", "spacedimension",
                                               "centers",     "number",     "measurementframe",
                                               "centerings",  "axismins",   "axismaxs",
                                               "blocksize",   "min",        "max",
                                               "oldmin",      "oldmax",     "thicknesses",
                                               "sampleunits"};
  for (const std::string_view name : kNown) {
    if (key == name) return true;
  }
  return false;
}

Header parse_header(const VolumeInput& input, std::string_view text) {
  Header header;
  bool closed = false;  // by a blank line
  HeaderLines lines(text);
  const auto place = [&lines] { return "line " + std::to_string(lines.number()); };
  const auto first = lines.next().value_or("");
  if (!first.starts_with("NRRD000") || first.size() != 8 || first[7] < '1' || first[7] > '5') {
    input.fail("line 1", "the file does not start with \"NRRD0001\" to \"NRRD0005\"",
               "Check that it is a NRRD file; export the volume again.");
  }
  while (const auto line = lines.next()) {
    if (line->empty()) {
      closed = true;
      break;
    }
    if (line->front() == '#') continue;
    const std::size_t colon = line->find(':');
    if (colon == line->npos) {
      input.fail(place(), "\"" + printable(*line) + "\" is neither a field nor a comment",
                 kExportAgain);
    }
    if (line->substr(colon).starts_with(":=")) continue;  // a key of somebody's own
    HeaderField field{lines.number(), field_key(line->substr(0, colon)),
                      printable(line->substr(0, colon)),
                      std::string(trimmed(line->substr(colon + 1)))};
    if (!known_field(field.key)) {
      input.fail(place(), "\"" + field.shown + "\" is not a field of NRRD",
                 "Correct it, or remove the line.");
    }
    if (header.fields.find(field.key) != nullptr) {
      input.fail(place(), "field \"" + field.shown + "\" comes twice", "Remove one of the lines.");
    }
    header.fields.all.push_back(std::move(field));
  }
  if (!closed && text.size() == kHeaderLimit) {
    input.fail("header", "it has no blank line at its end within its first MiB", kExportAgain);
  }
  if (!closed && header.fields.find("datafile") == nullptr) {
    input.fail("header", "it has neither a blank line at its end nor a field \"data file\"",
               "The file is truncated; copy or export it again.");
  }
  header.end = lines.offset();
  return header;
}

VoxelType voxel_type(const VolumeInput& input, const HeaderField& field) {
  static constexpr std::pair<std::string_view, VoxelType> kTypes[] = {
      {"signed char", VoxelType::i8},
      {"int8", VoxelType::i8},
      {"int8_t", VoxelType::i8},
      {"uchar", VoxelType::u8},
      {"unsigned char", VoxelType::u8},
      {"uint8", VoxelType::u8},
      {"uint8_t", VoxelType::u8},
      {"short", VoxelType::i16},
      {"short int", VoxelType::i16},
      {"signed short", VoxelType::i16},
      {"signed short int", VoxelType::i16},
      {"int16", VoxelType::i16},
      {"int16_t", VoxelType::i16},
      {"ushort", VoxelType::u16},
      {"unsigned short", VoxelType::u16},
      {"unsigned short int", VoxelType::u16},
      {"uint16", VoxelType::u16},
      {"uint16_t", VoxelType::u16},
      {"int", VoxelType::i32},
      {"signed int", VoxelType::i32},
      {"int32", VoxelType::i32},
      {"int32_t", VoxelType::i32},
      {"uint", VoxelType::u32},
      {"unsigned int", VoxelType::u32},
      {"uint32", VoxelType::u32},
      {"uint32_t", VoxelType::u32},
      {"float", VoxelType::f32},
      {"double", VoxelType::f64}};
  const std::string name = lower_case(field.value);
  for (const auto& [known, type] : kTypes) {
    if (name == known) return type;
  }
  input.fail(field.place(), "Kiln does not read voxels of type \"" + printable(field.value) + "\"",
             "Save the volume with 8, 16 or 32-bit integers, float or double.");
}

VoxelPlace voxel_place(const VolumeInput& input, const HeaderFields& fields, VoxelType type) {
  VoxelPlace place;
  const HeaderField& encoding = required(input, fields, "encoding", "encoding: raw");
  const std::string name = lower_case(encoding.value);
  if (name == "raw") {
    place.encoding = VoxelEncoding::plain;
  } else if (name == "gzip" || name == "gz") {
    place.encoding = VoxelEncoding::packed;
  } else if (name == "text" || name == "txt" || name == "ascii") {
    place.encoding = VoxelEncoding::text;
  } else {
    input.fail(encoding.place(),
               "Kiln does not read the encoding \"" + printable(encoding.value) + "\"",
               "Save the volume with raw, gzip or text encoding.");
  }
  if (const HeaderField* endian = fields.find("endian")) {
    const std::string order = lower_case(endian->value);
    if (order != "little" && order != "big") {
      input.fail(endian->place(), "\"" + printable(endian->value) + "\" is not little or big",
                 kExportAgain);
    }
    place.order = order == "big" ? ByteOrder::big : ByteOrder::little;
  } else if (size_of(type) > 1 && place.encoding != VoxelEncoding::text) {
    required(input, fields, "endian", "endian: little");
  }
  return place;
}

/// Applies `line skip` and `byte skip`, from place.offset on.
void skip(const VolumeInput& input, const HeaderFields& fields, const ByteSource& data,
          VoxelPlace& place) {
  if (const HeaderField* lines = fields.find("lineskip")) {
    std::array<char, 4096> buffer{};
    std::uint64_t left = integer(input, *lines, lines->value);
    while (left != 0) {
      const std::size_t got = data.read_at(place.offset, buffer.data(), buffer.size());
      if (got == 0) {
        input.fail(lines->place(), "the data have fewer lines than are to be skipped",
                   kExportAgain);
      }
      std::size_t used = 0;
      while (used < got && left != 0) left -= buffer[used++] == '\n';
      place.offset += used;
    }
  }
  const HeaderField* bytes = fields.find("byteskip");
  if (bytes == nullptr) return;
  if (bytes->value == "-1") {
    if (place.encoding != VoxelEncoding::plain) {
      input.fail(bytes->place(), "-1 has a meaning for raw encoding only",
                 "Say the number of bytes to skip.");
    }
    place.at_end = true;
    return;
  }
  const std::uint64_t count = integer(input, *bytes, bytes->value);
  if (place.encoding == VoxelEncoding::packed) {
    place.skip_unpacked = count;
  } else if (count > data.size() || place.offset > data.size() - count) {
    input.fail(bytes->place(),
               std::to_string(count) + " bytes are to be skipped, but the data have " +
                   std::to_string(data.size() - std::min(place.offset, data.size())),
               kExportAgain);
  } else {
    place.offset += count;
  }
}

}  // namespace

Volume read_nrrd(const VolumeInput& input) {
  const std::string text = input.source->head(kHeaderLimit);
  const Header header = parse_header(input, text);
  const HeaderFields& fields = header.fields;
  Volume volume;
  volume.type = voxel_type(input, required(input, fields, "type", "type: uint8"));
  const std::vector<NrrdAxis> axes = parse_axes(input, fields);
  // Sizes first: a dimension of size 0 is that, whatever else it may be.
  for (const NrrdAxis& axis : axes) {
    check_size(input, fields.find("sizes")->place(), {axis.size, 1, 1}, volume.type);
  }
  const auto chosen = choose_axes(input, fields, axes);
  std::array<std::uint64_t, 3> size{};
  for (std::size_t a = 0; a < 3; ++a) size[a] = axes[chosen[a]].size;
  check_size(input, fields.find("sizes")->place(), size, volume.type);
  for (std::size_t a = 0; a < 3; ++a) volume.size[a] = static_cast<std::uint32_t>(size[a]);
  place_in_space(input, fields, axes, chosen, volume);

  VoxelPlace place = voxel_place(input, fields, volume.type);
  const HeaderField* file = fields.find("datafile");
  if (file == nullptr) {
    place.offset = header.end;
    skip(input, fields, *input.source, place);
    read_voxels(input, *input.source, place, volume);
    return volume;
  }
  if (lower_case(file->value).starts_with("list") || file->value.find('%') != std::string::npos) {
    input.fail(file->place(), "the voxels are spread over several files",
               "Join them into one file (\"unu save -f nrrd\" does).");
  }
  if (!input.open_beside) {
    input.fail(file->place(), "the voxels are in a file of their own", "Save them in one file.");
  }
  const auto data = input.open_beside(file->value);
  place.remedy = "Check that the data file belongs to the header, or export the volume again.";
  skip(input, fields, *data, place);
  read_voxels(input, *data, place, volume);
  return volume;
}

}  // namespace kiln
