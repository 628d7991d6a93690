// NRRD, versions 1 to 5. http://teem.sourceforge.net/nrrd/format.html
#include <array>
#include <limits>
#include <utility>

#include "io/volume/volume_header.h"
#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

constexpr const char* export_again = "Correct the header, or export the volume again.";

struct Header {
  HeaderFields fields;
  std::size_t end = 0;  ///< Where what follows the blank line begins.
};

/// One axis of the file, of any number.
struct Axis {
  std::uint64_t size = 0;
  std::string kind;  ///< Empty: not said
  std::optional<double> spacing;
  std::optional<double> minimum;  ///< Position of its start
  bool cell_centered = false;
  bool has_direction = false;  ///< `space directions` is given, and not "none" here
  std::array<double, 3> direction{};
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
  static constexpr std::string_view known[] = {"dimension",   "type",       "sizes",
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
  for (const std::string_view name : known) {
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
                 export_again);
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
  if (!closed && text.size() == header_limit) {
    input.fail("header", "it has no blank line at its end within its first MiB", export_again);
  }
  if (!closed && header.fields.find("datafile") == nullptr) {
    input.fail("header", "it has neither a blank line at its end nor a field \"data file\"",
               "The file is truncated; copy or export it again.");
  }
  header.end = lines.offset();
  return header;
}

const HeaderField& required(const VolumeInput& input, const HeaderFields& fields,
                            std::string_view key, const char* example) {
  const HeaderField* field = fields.find(key);
  if (field == nullptr) {
    input.fail("header", "there is no field \"" + std::string(key) + "\"",
               std::string("Add a line such as \"") + example + "\", or export the volume again.");
  }
  return *field;
}

VoxelType voxel_type(const VolumeInput& input, const HeaderField& field) {
  static constexpr std::pair<std::string_view, VoxelType> types[] = {
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
  for (const auto& [known, type] : types) {
    if (name == known) return type;
  }
  input.fail(field.place(), "Kiln does not read voxels of type \"" + printable(field.value) + "\"",
             "Save the volume with 8, 16 or 32-bit integers, float or double.");
}

std::uint64_t integer(const VolumeInput& input, const HeaderField& field, std::string_view word) {
  const auto value = to_integer(word);
  if (!value || *value < 0) {
    input.fail(field.place(), "\"" + printable(word) + "\" is not a whole number of 0 or more",
               export_again);
  }
  return static_cast<std::uint64_t>(*value);
}

void check_count(const VolumeInput& input, const HeaderField& field, std::size_t found,
                 std::size_t expected) {
  if (found == expected) return;
  input.fail(field.place(),
             "there are " + std::to_string(found) + " entries for " + std::to_string(expected) +
                 " dimensions",
             export_again);
}

/// Vectors "(x,y,z)" and words, blanks allowed within the parentheses.
std::vector<std::string> vector_words(std::string_view text) {
  std::vector<std::string> result;
  for (std::size_t at = 0; at < text.size();) {
    if (text[at] == ' ' || text[at] == '\t') {
      ++at;
      continue;
    }
    const bool vector = text[at] == '(';
    std::size_t end = vector ? text.find(')', at) : text.find_first_of(" \t(", at);
    if (end == text.npos) {
      end = text.size();
    } else if (vector) {
      ++end;
    }
    result.emplace_back(text.substr(at, end - at));
    at = end;
  }
  return result;
}

std::array<double, 3> vector_of(const VolumeInput& input, const HeaderField& field,
                                const std::string& word) {
  std::array<double, 3> result{};
  std::string inner = word;
  bool good = inner.size() >= 2 && inner.front() == '(' && inner.back() == ')';
  if (good) {
    inner = inner.substr(1, inner.size() - 2);
    for (char& c : inner) c = c == ',' ? ' ' : c;
    const auto numbers = to_doubles(inner);
    good = numbers && numbers->size() == 3;
    for (std::size_t c = 0; good && c < 3; ++c) result[c] = (*numbers)[c];
  }
  if (!good) {
    input.fail(field.place(), "\"" + printable(word) + "\" is not a vector of three numbers",
               "Write it as (x,y,z): Kiln takes spaces of three dimensions.");
  }
  return result;
}

std::vector<Axis> parse_axes(const VolumeInput& input, const HeaderFields& fields) {
  const HeaderField& dimension = required(input, fields, "dimension", "dimension: 3");
  const std::uint64_t count = integer(input, dimension, dimension.value);
  if (count < 3 || count > 16) {
    input.fail(dimension.place(), "it has " + std::to_string(count) + " dimensions",
               "Kiln takes volumes of three dimensions, and others where they have size 1.");
  }
  std::vector<Axis> axes(count);
  const HeaderField& sizes = required(input, fields, "sizes", "sizes: 256 256 128");
  const auto size_words = words(sizes.value);
  check_count(input, sizes, size_words.size(), axes.size());
  for (std::size_t a = 0; a < axes.size(); ++a) axes[a].size = integer(input, sizes, size_words[a]);

  if (const HeaderField* kinds = fields.find("kinds")) {
    const auto list = words(kinds->value);
    check_count(input, *kinds, list.size(), axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a) axes[a].kind = lower_case(list[a]);
  }
  const auto numbers = [&](std::string_view key, auto member) {
    const HeaderField* field = fields.find(key);
    if (field == nullptr) return;
    const auto list = to_doubles(field->value);
    if (!list) input.fail(field->place(), "not all entries are numbers", export_again);
    check_count(input, *field, list->size(), axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (std::isfinite((*list)[a])) axes[a].*member = (*list)[a];
    }
  };
  numbers("spacings", &Axis::spacing);
  numbers("axismins", &Axis::minimum);
  const HeaderField* centers = fields.find("centers");
  if (centers == nullptr) centers = fields.find("centerings");
  if (centers != nullptr) {
    const auto list = words(centers->value);
    check_count(input, *centers, list.size(), axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a) {
      axes[a].cell_centered = lower_case(list[a]) == "cell";
    }
  }
  if (const HeaderField* directions = fields.find("spacedirections")) {
    const auto list = vector_words(directions->value);
    check_count(input, *directions, list.size(), axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (lower_case(list[a]) == "none") continue;
      axes[a].direction = vector_of(input, *directions, list[a]);
      axes[a].has_direction = true;
    }
  }
  return axes;
}

/// Which of the axes are the volume's three.
std::array<std::size_t, 3> choose_axes(const VolumeInput& input, const HeaderFields& fields,
                                       const std::vector<Axis>& axes) {
  const bool directed = fields.find("spacedirections") != nullptr;
  const std::string place = fields.find("sizes")->place();
  std::vector<std::size_t> kept;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const std::string& kind = axes[a].kind;
    const bool within = kind.empty() || kind == "domain" || kind == "space" || kind == "time" ||
                        kind == "???" || kind == "none";
    if (kind == "time" && axes[a].size > 1) {
      input.fail(place, "there are " + std::to_string(axes[a].size) + " time steps",
                 "Save one time step as a volume of three dimensions.");
    }
    if (within && (!directed || axes[a].has_direction || kind == "time")) {
      kept.push_back(a);
    } else if (axes[a].size > 1) {
      input.fail(place,
                 "there are " + std::to_string(axes[a].size) + " values a voxel (dimension " +
                     std::to_string(a) + (kind.empty() ? "" : ", kind " + printable(kind)) + ")",
                 "Save one component as a volume of its own.");
    }
  }
  const auto drop = [&](bool time_only) {
    for (std::size_t i = kept.size(); i-- > 0 && kept.size() > 3;) {
      const Axis& axis = axes[kept[i]];
      if (axis.size == 1 && (!time_only || axis.kind == "time")) {
        kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
  };
  drop(true);
  drop(false);
  if (kept.size() > 3) {
    input.fail(place,
               std::to_string(kept.size()) +
                   " dimensions have more than one sample, as in a series " + "over time",
               "Save one time step or component as a volume of three dimensions.");
  }
  if (kept.size() < 3) {
    input.fail(
        place, "only " + std::to_string(kept.size()) + " dimensions are of space",
        "Kiln takes volumes of three dimensions; correct \"kinds\" or \"space directions\".");
  }
  return {kept[0], kept[1], kept[2]};
}

/// True for the spaces whose basis is left-handed.
bool left_handed(const VolumeInput& input, const HeaderFields& fields) {
  static constexpr std::pair<std::string_view, bool> spaces[] = {{"right-anterior-superior", false},
                                                                 {"ras", false},
                                                                 {"left-anterior-superior", true},
                                                                 {"las", true},
                                                                 {"left-posterior-superior", false},
                                                                 {"lps", false},
                                                                 {"scanner-xyz", false},
                                                                 {"3d-right-handed", false},
                                                                 {"3d-left-handed", true}};
  if (const HeaderField* dimension = fields.find("spacedimension")) {
    if (integer(input, *dimension, dimension->value) != 3) {
      input.fail(dimension->place(), "the space has " + printable(dimension->value) + " dimensions",
                 "Kiln takes spaces of three dimensions; save one time step.");
    }
  }
  const HeaderField* space = fields.find("space");
  if (space == nullptr) return false;
  const std::string name = lower_case(space->value);
  for (const auto& [known, left] : spaces) {
    if (name == known) return left;
  }
  input.fail(space->place(), "Kiln does not know the space \"" + printable(space->value) + "\"",
             "It knows right-anterior-superior, left-anterior-superior, left-posterior-superior, "
             "scanner-xyz, 3D-right-handed and 3D-left-handed.");
}

void place_in_space(const VolumeInput& input, const HeaderFields& fields,
                    const std::vector<Axis>& axes, const std::array<std::size_t, 3>& chosen,
                    Volume& volume) {
  std::uint64_t missing = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const Axis& axis = axes[chosen[a]];
    if (axis.has_direction) {
      volume.axes[a] = axis.direction;
      continue;
    }
    volume.axes[a] = {};
    volume.axes[a][a] = axis.spacing.value_or(1);
    missing += !axis.spacing;
    volume.origin[a] =
        axis.minimum.value_or(0) + (axis.minimum && axis.cell_centered ? volume.axes[a][a] / 2 : 0);
  }
  if (missing != 0) {
    input.warn("missing-spacing",
               std::to_string(missing) + " axes have no usable spacing; it was taken as 1",
               missing);
  }
  if (const HeaderField* origin = fields.find("spaceorigin")) {
    const auto list = vector_words(origin->value);
    volume.origin = vector_of(input, *origin, list.size() == 1 ? list[0] : origin->value);
  }
  if (left_handed(input, fields)) {
    volume.origin[0] = -volume.origin[0];
    for (auto& axis : volume.axes) axis[0] = -axis[0];
  }
  const HeaderField* field = fields.find("spacedirections");
  if (field == nullptr) field = fields.find("spacings");
  check_geometry(input, field == nullptr ? "header" : field->place(), volume);
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
                 export_again);
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
                   export_again);
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
               export_again);
  } else {
    place.offset += count;
  }
}

}  // namespace

Volume read_nrrd(const VolumeInput& input) {
  const std::string text = input.source->head(header_limit);
  const Header header = parse_header(input, text);
  const HeaderFields& fields = header.fields;
  Volume volume;
  volume.type = voxel_type(input, required(input, fields, "type", "type: uint8"));
  const std::vector<Axis> axes = parse_axes(input, fields);
  // Sizes first: a dimension of size 0 is that, whatever else it may be.
  for (const Axis& axis : axes) {
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
