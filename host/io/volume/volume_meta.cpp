// MetaImage. https://itk.org/Wiki/ITK/MetaIO/Documentation
#include <array>
#include <utility>

#include "io/volume/volume_header.h"
#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

struct Header {
  HeaderFields fields;
  std::size_t end = 0;  ///< Offset of the first byte after the header
};

/// Parses the lines "Name = value" of a header up to ElementDataFile.
Header parse_header(const VolumeInput& input, std::string_view text) {
  Header header;
  HeaderLines lines(text);
  while (const auto line = lines.next()) {
    const std::string place = "line " + std::to_string(lines.number());
    if (trimmed(*line).empty()) continue;
    const std::size_t equals = line->find('=');
    if (equals == line->npos) {
      input.fail(place, "\"" + printable(*line) + "\" is not of the form \"Name = value\"",
                 "Check that it is a MetaImage; export the volume again.");
    }
    const std::string_view name = trimmed(line->substr(0, equals));
    HeaderField field{lines.number(), lower_case(name), printable(name),
                      std::string(trimmed(line->substr(equals + 1)))};
    add_field(input, std::move(field), header.fields);
    if (header.fields.all.back().key == "elementdatafile") {
      header.end = lines.offset();
      return header;
    }
  }
  input.fail("header", "there is no field \"ElementDataFile\"",
             "The header is truncated; copy or export the volume again.");
}

/// The first field that exists, of several with the same meaning.
const HeaderField* first_of(const HeaderFields& fields, std::initializer_list<const char*> keys) {
  for (const char* key : keys) {
    if (const HeaderField* field = fields.find(key)) return field;
  }
  return nullptr;
}

bool flag(const VolumeInput& input, const HeaderField* field) {
  if (field == nullptr) return false;
  const std::string value = lower_case(field->value);
  if (value == "true" || value == "t" || value == "1") return true;
  if (value == "false" || value == "f" || value == "0") return false;
  input.fail(field->place(), "\"" + printable(field->value) + "\" is neither True nor False",
             kCorrectHeader);
}

VoxelType voxel_type(const VolumeInput& input, const HeaderField& field) {
  static constexpr std::pair<std::string_view, VoxelType> kTypes[] = {
      {"met_char", VoxelType::i8},    {"met_uchar", VoxelType::u8},  {"met_short", VoxelType::i16},
      {"met_ushort", VoxelType::u16}, {"met_int", VoxelType::i32},   {"met_uint", VoxelType::u32},
      {"met_long", VoxelType::i32},   {"met_ulong", VoxelType::u32},  // A MetaIO "long" has 4 bytes
      {"met_float", VoxelType::f32},  {"met_double", VoxelType::f64}};
  if (lower_case(field.value).ends_with("_array")) {
    input.fail(field.place(), "\"" + printable(field.value) + "\" has several values a voxel",
               "Save one component as a separate volume.");
  }
  return voxel_type_in(input, field, kTypes);
}

std::vector<double> numbers(const VolumeInput& input, const HeaderField& field,
                            std::size_t expected) {
  const auto list = to_doubles(field.value);
  if (!list || list->size() != expected) {
    input.fail(field.place(),
               "\"" + printable(field.value) + "\" is not " + std::to_string(expected) + " numbers",
               kCorrectHeader);
  }
  return *list;
}

/// Parses DimSize. Dimensions after the third must have the size 1.
std::size_t parse_size(const VolumeInput& input, const HeaderFields& fields, Volume& volume) {
  const HeaderField& dims = require_field(input, fields, "ndims", "NDims = 3");
  const auto count = to_integer(dims.value);
  if (!count || *count < 3 || *count > 10) {
    input.fail(dims.place(), "it has \"" + printable(dims.value) + "\" dimensions",
               "Kiln reads volumes of three dimensions; further dimensions must have the size 1.");
  }
  const HeaderField& field = require_field(input, fields, "dimsize", "DimSize = 256 256 128");
  const auto list = words(field.value);
  const auto n = static_cast<std::size_t>(*count);
  check_count(input, field, list.size(), n);
  std::array<std::uint64_t, 3> size{};
  for (std::size_t a = 0; a < n; ++a) {
    const std::uint64_t value = integer(input, field, list[a]);
    if (a < 3) {
      size[a] = value;
    } else if (value != 1) {
      input.fail(field.place(),
                 "dimension " + std::to_string(a) + " has size " + std::to_string(value) +
                     ", as in a series over time",
                 "Save one time step as a volume of three dimensions.");
    }
  }
  check_size(input, field.place(), size, volume.type);
  for (std::size_t a = 0; a < 3; ++a) volume.size[a] = static_cast<std::uint32_t>(size[a]);
  return n;
}

void place_in_space(const VolumeInput& input, const HeaderFields& fields, std::size_t dims,
                    Volume& volume) {
  std::vector<double> spacing(dims, 1.0);
  const HeaderField* lengths = first_of(fields, {"elementspacing", "elementsize"});
  if (lengths != nullptr) {
    spacing = numbers(input, *lengths, dims);
  } else {
    input.warn("missing-spacing", "3 axes have no spacing; it was taken as 1", 3);
  }
  // The file lists the matrix row by row; row i is the direction of axis i.
  const HeaderField* matrix = first_of(fields, {"transformmatrix", "rotation", "orientation"});
  if (matrix != nullptr) {
    const auto m = numbers(input, *matrix, dims * dims);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t c = 0; c < 3; ++c) volume.axes[a][c] = m[a * dims + c];
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    for (double& c : volume.axes[a]) c *= spacing[a];
  }
  if (const HeaderField* origin = first_of(fields, {"offset", "position", "origin"})) {
    const auto position = numbers(input, *origin, dims);
    for (std::size_t c = 0; c < 3; ++c) volume.origin[c] = position[c];
  }
  const HeaderField* faulty_field = lengths != nullptr ? lengths : matrix;
  check_geometry(input, faulty_field == nullptr ? "header" : faulty_field->place(), volume);
}

void warn_of_scale(const VolumeInput& input, const HeaderFields& fields) {
  const auto differs = [&](const char* key, double identity) {
    const HeaderField* field = fields.find(key);
    return field != nullptr && to_double(field->value) != identity;
  };
  if (differs("elementtointensityfunctionslope", 1) ||
      differs("elementtointensityfunctionoffset", 0)) {
    input.warn("ignored-scale",
               "ElementToIntensityFunction was not applied; values are as they are stored", 1);
  }
}

VoxelPlace voxel_place(const VolumeInput& input, const HeaderFields& fields) {
  VoxelPlace place;
  const HeaderField* binary = fields.find("binarydata");
  const bool text = binary != nullptr && !flag(input, binary);
  const HeaderField* compressed = fields.find("compresseddata");
  const bool packed = flag(input, compressed);
  if (text && packed) {
    input.fail(compressed->place(), "text cannot be compressed", "Set BinaryData to True.");
  }
  place.encoding = text     ? VoxelEncoding::text
                   : packed ? VoxelEncoding::packed
                            : VoxelEncoding::plain;
  const HeaderField* order = first_of(fields, {"elementbyteordermsb", "binarydatabyteordermsb"});
  place.order = flag(input, order) ? ByteOrder::big : ByteOrder::little;
  return place;
}

/// Applies HeaderSize: the number of bytes to skip, counted from place.offset.
void skip_header(const VolumeInput& input, const HeaderFields& fields, const ByteSource& data,
                 VoxelPlace& place) {
  const HeaderField* field = fields.find("headersize");
  if (field == nullptr) return;
  const auto bytes = to_integer(field->value);
  if (!bytes || *bytes < -1) {
    input.fail(field->place(),
               "\"" + printable(field->value) + "\" is neither a number of bytes nor -1",
               kCorrectHeader);
  }
  if (*bytes == -1) {
    if (place.encoding != VoxelEncoding::plain) {
      input.fail(field->place(), "-1 is only valid for uncompressed data",
                 "Give the number of bytes before the voxels.");
    }
    place.at_end = true;
    return;
  }
  if (static_cast<std::uint64_t>(*bytes) > data.size() - place.offset) {
    input.fail(field->place(),
               "a header of " + std::to_string(*bytes) +
                   " bytes is to be skipped, but the data have " +
                   std::to_string(data.size() - place.offset),
               kCorrectHeader);
  }
  place.offset += static_cast<std::uint64_t>(*bytes);
}

}  // namespace

Volume read_meta_image(const VolumeInput& input) {
  const std::string text = input.source->head(kHeaderLimit);
  const Header header = parse_header(input, text);
  const HeaderFields& fields = header.fields;
  if (const HeaderField* object = fields.find("objecttype")) {
    if (lower_case(object->value) != "image") {
      input.fail(object->place(), "it is a \"" + printable(object->value) + "\", not an Image",
                 "Name a MetaImage file.");
    }
  }
  Volume volume;
  volume.type =
      voxel_type(input, require_field(input, fields, "elementtype", "ElementType = MET_USHORT"));
  if (const HeaderField* channels = fields.find("elementnumberofchannels")) {
    if (to_integer(channels->value) != 1) {
      input.fail(channels->place(), "there are " + printable(channels->value) + " values a voxel",
                 "Save one component as a separate volume.");
    }
  }
  const std::size_t dims = parse_size(input, fields, volume);
  place_in_space(input, fields, dims, volume);
  warn_of_scale(input, fields);
  VoxelPlace place = voxel_place(input, fields);

  const HeaderField& file = *fields.find("elementdatafile");
  const std::string name = lower_case(file.value);
  if (name == "local") {
    place.offset = header.end;
    skip_header(input, fields, *input.source, place);
    read_voxels(input, *input.source, place, volume);
    return volume;
  }
  if (name.empty()) {
    input.fail(file.place(), "it names no file", "Name the file of the voxels, or LOCAL.");
  }
  if (name.starts_with("list") || name.find('%') != std::string::npos) {
    input.fail(file.place(), "the voxels are spread over several files",
               "Save the volume as one file (.mha).");
  }
  if (!input.open_beside) {
    input.fail(file.place(), "the voxels are in a file of their own", "Save them in one file.");
  }
  const auto data = input.open_beside(file.value);
  place.remedy = "Check that the data file belongs to the header, or export the volume again.";
  skip_header(input, fields, *data, place);
  read_voxels(input, *data, place, volume);
  return volume;
}

}  // namespace kiln
