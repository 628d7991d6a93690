#include "io/volume/volume_header.h"

namespace kiln {

void add_field(const VolumeInput& input, HeaderField field, HeaderFields& fields) {
  if (fields.find(field.key) != nullptr) {
    input.fail("line " + std::to_string(field.line),
               "field \"" + field.written_name + "\" occurs twice", "Remove one of the lines.");
  }
  fields.all.push_back(std::move(field));
}

const HeaderField& require_field(const VolumeInput& input, const HeaderFields& fields,
                                 std::string_view key, const char* example) {
  const HeaderField* field = fields.find(key);
  if (field == nullptr) {
    const std::string line(example);
    input.fail("header", "there is no field \"" + line.substr(0, line.find_first_of(" :")) + "\"",
               "Add a line such as \"" + line + "\", or export the volume again.");
  }
  return *field;
}

std::uint64_t integer(const VolumeInput& input, const HeaderField& field, std::string_view word) {
  const auto value = to_integer(word);
  if (!value || *value < 0) {
    input.fail(field.place(), "\"" + printable(word) + "\" is not a whole number of 0 or more",
               kCorrectHeader);
  }
  return static_cast<std::uint64_t>(*value);
}

void check_count(const VolumeInput& input, const HeaderField& field, std::size_t found,
                 std::size_t expected) {
  if (found == expected) return;
  input.fail(field.place(),
             "there are " + std::to_string(found) + " entries for " + std::to_string(expected) +
                 " dimensions",
             kCorrectHeader);
}

VoxelType voxel_type_in(const VolumeInput& input, const HeaderField& field,
                        std::span<const std::pair<std::string_view, VoxelType>> names) {
  const std::string name = lower_case(field.value);
  for (const auto& [known, type] : names) {
    if (name == known) return type;
  }
  input.fail(field.place(), "Kiln does not read voxels of type \"" + printable(field.value) + "\"",
             "Save the volume with 8, 16 or 32-bit integers, float or double.");
}

}  // namespace kiln
