// NRRD, versions 1 to 5. http://teem.sourceforge.net/nrrd/format.html
#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <memory>
#include <utility>

#include "io/volume/nrrd_axes.h"
#include "io/volume/volume_header.h"
#include "io/volume/volume_reader.h"

namespace kiln {
namespace {

struct Header {
  HeaderFields fields;
  std::vector<std::string> files;  ///< File names listed after "data file: LIST"
  std::size_t end = 0;             ///< Offset of the first byte after the blank line.
};

/// Names of fields are compared without case and blanks: "data file" is the same as "datafile".
std::string field_key(std::string_view name) {
  std::string key;
  for (const char c : lower_case(name)) {
    if (c != ' ' && c != '\t') key += c;
  }
  return key;
}

bool is_known_field(std::string_view key) {
  static constexpr std::string_view kKnownFields[] = {
      "dimension",   "type",       "sizes",
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
  for (const std::string_view name : kKnownFields) {
    if (key == name) return true;
  }
  return false;
}

Header parse_header(const VolumeInput& input, std::string_view text) {
  Header header;
  bool is_closed = false;  // True if an empty line ends the header
  HeaderLines lines(text);
  const auto place = [&lines] { return "line " + std::to_string(lines.number()); };
  const auto first = lines.next().value_or("");
  if (!first.starts_with("NRRD000") || first.size() != 8 || first[7] < '1' || first[7] > '5') {
    input.fail("line 1", "the file does not start with \"NRRD0001\" to \"NRRD0005\"",
               "Check that it is a NRRD file; export the volume again.");
  }
  while (const auto line = lines.next()) {
    if (line->empty()) {
      is_closed = true;
      break;
    }
    if (line->front() == '#') continue;
    const std::size_t colon = line->find(':');
    if (colon == line->npos) {
      input.fail(place(), "\"" + printable(*line) + "\" is neither a field nor a comment",
                 kCorrectHeader);
    }
    if (line->substr(colon).starts_with(":=")) continue;  // A key/value pair, not a field
    HeaderField field{lines.number(), field_key(line->substr(0, colon)),
                      printable(line->substr(0, colon)),
                      std::string(trimmed(line->substr(colon + 1)))};
    if (!is_known_field(field.key)) {
      input.fail(place(), "\"" + field.written_name + "\" is not a field of NRRD",
                 "Correct it, or remove the line.");
    }
    const bool list = field.key == "datafile" && (field.value + " ").starts_with("LIST ");
    add_field(input, std::move(field), header.fields);
    if (!list) continue;
    // The remaining lines of the header are file names.
    while (const auto name = lines.next()) {
      if (!trimmed(*name).empty()) header.files.emplace_back(trimmed(*name));
    }
  }
  if (!is_closed && text.size() == kHeaderLimit) {
    input.fail("header", "it has no blank line at its end within its first MiB", kCorrectHeader);
  }
  if (!is_closed && header.fields.find("datafile") == nullptr) {
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
  return voxel_type_in(input, field, kTypes);
}

VoxelPlace voxel_place(const VolumeInput& input, const HeaderFields& fields, VoxelType type) {
  VoxelPlace place;
  const HeaderField& encoding = require_field(input, fields, "encoding", "encoding: raw");
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
                 kCorrectHeader);
    }
    place.order = order == "big" ? ByteOrder::big : ByteOrder::little;
  } else if (size_of(type) > 1 && place.encoding != VoxelEncoding::text) {
    require_field(input, fields, "endian", "endian: little");
  }
  return place;
}

/// Applies `line skip` and `byte skip`, whose lines and bytes are counted from place.offset.
void skip(const VolumeInput& input, const HeaderFields& fields, const ByteSource& data,
          VoxelPlace& place) {
  if (const HeaderField* lines = fields.find("lineskip")) {
    std::array<char, 4096> buffer{};
    std::uint64_t left = integer(input, *lines, lines->value);
    while (left != 0) {
      const std::size_t got = data.read_at(place.offset, buffer.data(), buffer.size());
      if (got == 0) {
        input.fail(lines->place(), "the data have fewer lines than are to be skipped",
                   kCorrectHeader);
      }
      std::size_t scanned = 0;
      while (scanned < got && left != 0) left -= buffer[scanned++] == '\n';
      place.offset += scanned;
    }
  }
  const HeaderField* bytes = fields.find("byteskip");
  if (bytes == nullptr) return;
  if (bytes->value == "-1") {
    if (place.encoding != VoxelEncoding::plain) {
      input.fail(bytes->place(), "-1 is only valid for raw encoding",
                 "Give the number of bytes to skip.");
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
               kCorrectHeader);
  } else {
    place.offset += count;
  }
}

/// The file names that a line such as "slice%03d.raw 1 100 1" gives: a pattern, the first number,
/// the last number and the step.
std::vector<std::string> numbered_files(const VolumeInput& input, const HeaderField& field) {
  const auto fail = [&](const char* problem) {
    input.fail(
        field.place(), "\"" + printable(field.value) + "\" " + problem,
        "Write it as slice%03d.raw 1 100 1: a name with a number, the first, the last and the "
        "step.");
  };
  constexpr std::int64_t kMaxFiles = 1 << 20, kMaxDigits = 20;
  const auto list = words(field.value);
  if (list.size() < 4 || list.size() > 5) fail("has no valid range of file numbers");
  const std::string name_pattern(list[0]);
  const std::size_t percent = name_pattern.find('%'), end = name_pattern.find('d', percent);
  const std::string format =
      end == name_pattern.npos ? "" : name_pattern.substr(percent + 1, end - percent - 1);
  const auto digits = format.empty() ? 0 : to_integer(format);
  if (end == name_pattern.npos || !digits || *digits < 0 || *digits > kMaxDigits) {
    fail("has no placeholder for a number, such as %d or %03d");
  }
  const auto first = to_integer(list[1]), last = to_integer(list[2]), step = to_integer(list[3]);
  const auto ordinary = [](const auto& n) { return n && std::abs(*n) < std::int64_t{1} << 40; };
  if (!ordinary(first) || !ordinary(last) || !ordinary(step) || *step == 0 ||
      (*last - *first) / *step < 0 || (*last - *first) / *step >= kMaxFiles) {
    fail("has no valid range of file numbers");
  }
  std::vector<std::string> names;
  for (std::int64_t n = *first; *step > 0 ? n <= *last : n >= *last; n += *step) {
    std::string number = std::to_string(std::abs(n));
    const std::size_t width = static_cast<std::size_t>(*digits) - (n < 0 && *digits > 0 ? 1 : 0);
    if (number.size() < width)
      number.insert(0, width - number.size(), format[0] == '0' ? '0' : ' ');
    names.push_back(name_pattern.substr(0, percent) + (n < 0 ? "-" : "") + number +
                    name_pattern.substr(end + 1));
  }
  return names;
}

/// The data of several files, one after the other. Only one file is open at a time, since a scan
/// may have more slices than a process may have open files.
class JoinedFiles final : public ByteSource {
 public:
  /// \param place  start of the data in each file, before `line skip` and `byte skip`
  /// \param bytes  number of bytes of all voxels. If the files are not compressed, each contains an
  ///   equal share
  JoinedFiles(const VolumeInput& input, const HeaderFields& fields, const HeaderField& field,
              const std::vector<std::string>& names, const VoxelPlace& place, std::uint64_t bytes)
      : input_(input) {
    const bool is_packed = place.encoding == VoxelEncoding::packed;
    const std::uint64_t share = bytes / names.size();
    if (!is_packed && share * names.size() != bytes) {
      input.fail(field.place(),
                 std::to_string(bytes) + " bytes of voxels are not spread evenly over " +
                     std::to_string(names.size()) + " files",
                 "Correct the list, or export the volume again.");
    }
    std::uint64_t trailing_bytes = 0;
    for (const std::string& name : names) {
      const auto data = input.open_beside(name);
      VoxelPlace begin = place;
      skip(input, fields, *data, begin);
      if (begin.skip_unpacked != 0) {
        input.fail(field.place(),
                   "bytes are to be skipped, but the voxels are in several compressed files",
                   "Join them into one file (\"unu save -f nrrd\" does).");
      }
      if (begin.at_end && data->size() >= share) begin.offset = data->size() - share;
      std::uint64_t length = data->size() - std::min(begin.offset, data->size());
      if (!is_packed && length < share) {
        input.fail("data file " + printable(name),
                   std::to_string(share) + " bytes are its share of the voxels, but it has " +
                       std::to_string(length),
                   place.remedy);
      }
      if (!is_packed && length > share) {
        trailing_bytes += length - share;
        length = share;
      }
      file_parts_.push_back({name, begin.offset, size_});
      size_ += length;
    }
    if (trailing_bytes != 0) {
      input.warn(
          "trailing-bytes",
          std::to_string(trailing_bytes) + " bytes after the voxels of its files were ignored",
          trailing_bytes);
    }
  }

  std::uint64_t size() const override { return size_; }
  std::size_t read_at(std::uint64_t offset, void* to, std::size_t count) const override {
    std::size_t have = 0;
    while (have < count && offset + have < size_) {
      const std::uint64_t at = offset + have;
      const auto after =
          std::upper_bound(file_parts_.begin(), file_parts_.end(), at,
                           [](std::uint64_t place, const Part& part) { return place < part.at; });
      const auto part = static_cast<std::size_t>(after - file_parts_.begin()) - 1;
      const std::uint64_t end = after == file_parts_.end() ? size_ : after->at;
      if (!open_source_ || part != open_part_)
        open_source_ = input_.open_beside(file_parts_[part].name);
      open_part_ = part;
      const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(count - have, end - at));
      const std::size_t got =
          open_source_->read_at(file_parts_[part].offset + (at - file_parts_[part].at),
                                static_cast<char*>(to) + have, wanted);
      have += got;
      if (got < wanted) break;  // Another process has truncated the file
    }
    return have;
  }

 private:
  struct Part {
    std::string name;
    std::uint64_t offset;  ///< Offset of the data in its file
    std::uint64_t at;      ///< Offset of the file's data in the concatenated data of all files
  };
  const VolumeInput& input_;
  std::vector<Part> file_parts_;
  std::uint64_t size_ = 0;
  mutable std::unique_ptr<ByteSource> open_source_;  // The one file that is open
  mutable std::size_t open_part_ = 0;
};

}  // namespace

Volume read_nrrd(const VolumeInput& input) {
  const std::string text = input.source->head(kHeaderLimit);
  const Header header = parse_header(input, text);
  const HeaderFields& fields = header.fields;
  Volume volume;
  volume.type = voxel_type(input, require_field(input, fields, "type", "type: uint8"));
  const std::vector<NrrdAxis> axes = parse_axes(input, fields);
  // Sizes are checked first, so that a size of 0 is reported even if there are other errors.
  for (const NrrdAxis& axis : axes) {
    check_size(input, fields.find("sizes")->place(), {axis.size, 1, 1}, volume.type);
  }
  const auto chosen = choose_axes(input, fields, axes);
  std::array<std::uint64_t, 3> size{};
  for (std::size_t a = 0; a < 3; ++a) size[a] = axes[chosen[a]].size;
  const std::uint64_t voxel_bytes =
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
  if (!input.open_beside) {
    input.fail(file->place(), "the voxels are in a file of their own", "Save them in one file.");
  }
  place.remedy = "Check that the data file belongs to the header, or export the volume again.";
  std::vector<std::string> names = header.files;
  if (file->value.find('%') != std::string::npos) names = numbered_files(input, *file);
  if (names.empty()) {
    if ((file->value + " ").starts_with("LIST ")) {
      input.fail(file->place(), "no names of files follow", "Name them, each on a line.");
    }
    const auto data = input.open_beside(file->value);
    skip(input, fields, *data, place);
    read_voxels(input, *data, place, volume);
    return volume;
  }
  if (place.encoding == VoxelEncoding::text) {
    input.fail(file->place(), "text is spread over several files",
               "Join them into one file (\"unu save -f nrrd\" does).");
  }
  const JoinedFiles data(input, fields, *file, names, place, voxel_bytes);
  place.offset = place.skip_unpacked = 0;
  place.at_end = false;
  read_voxels(input, data, place, volume);
  return volume;
}

}  // namespace kiln
