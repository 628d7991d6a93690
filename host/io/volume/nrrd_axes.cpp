#include "io/volume/nrrd_axes.h"

#include <utility>

namespace kiln {
namespace {

/// Splits a text into words, where a vector "(x,y,z)" is one word and may contain blanks.
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
  std::string inner_text = word;
  bool good = inner_text.size() >= 2 && inner_text.front() == '(' && inner_text.back() == ')';
  if (good) {
    inner_text = inner_text.substr(1, inner_text.size() - 2);
    for (char& c : inner_text) c = c == ',' ? ' ' : c;
    const auto numbers = to_doubles(inner_text);
    good = numbers && numbers->size() == 3;
    for (std::size_t c = 0; good && c < 3; ++c) result[c] = (*numbers)[c];
  }
  if (!good) {
    input.fail(field.place(), "\"" + printable(word) + "\" is not a vector of three numbers",
               "Write it as (x,y,z): Kiln reads spaces of three dimensions.");
  }
  return result;
}

}  // namespace

std::vector<NrrdAxis> parse_axes(const VolumeInput& input, const HeaderFields& fields) {
  const HeaderField& dimension = require_field(input, fields, "dimension", "dimension: 3");
  const std::uint64_t count = integer(input, dimension, dimension.value);
  if (count < 3 || count > 16) {
    input.fail(dimension.place(), "it has " + std::to_string(count) + " dimensions",
               "Kiln reads volumes of three dimensions; further dimensions must have the size 1.");
  }
  std::vector<NrrdAxis> axes(count);
  const HeaderField& sizes = require_field(input, fields, "sizes", "sizes: 256 256 128");
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
    if (!list) input.fail(field->place(), "not all entries are numbers", kCorrectHeader);
    check_count(input, *field, list->size(), axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a) {
      if (std::isfinite((*list)[a])) axes[a].*member = (*list)[a];
    }
  };
  numbers("spacings", &NrrdAxis::spacing);
  numbers("axismins", &NrrdAxis::minimum);
  numbers("axismaxs", &NrrdAxis::maximum);
  const HeaderField* centers = fields.find("centers");
  if (centers == nullptr) centers = fields.find("centerings");
  if (centers != nullptr) {
    const auto list = words(centers->value);
    check_count(input, *centers, list.size(), axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a) {
      axes[a].cell_centered = lower_case(list[a]) == "cell";
      axes[a].node_centered = lower_case(list[a]) == "node";
    }
  }
  std::uint64_t axes_without_direction = 0;
  for (NrrdAxis& axis : axes) {
    if (axis.spacing || !axis.minimum || !axis.maximum) continue;
    if (!axis.node_centered && !axis.cell_centered) {
      axis.cell_centered = true;
      ++axes_without_direction;
    }
    const std::uint64_t steps = axis.size - (axis.node_centered ? 1 : 0);
    const double spacing = (*axis.maximum - *axis.minimum) / static_cast<double>(steps);
    if (axis.size != 0 && steps != 0 && spacing != 0) axis.spacing = spacing;
  }
  if (axes_without_direction != 0) {
    input.warn(
        "assumed-cells",
        fields.find("axismaxs")->place() + ": " + std::to_string(axes_without_direction) +
            " axes have no \"centers\" to state whether samples are at cells or nodes: cells are "
            "assumed, as in Teem",
        axes_without_direction);
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

std::array<std::size_t, 3> choose_axes(const VolumeInput& input, const HeaderFields& fields,
                                       const std::vector<NrrdAxis>& axes) {
  const bool has_directions = fields.find("spacedirections") != nullptr;
  const std::string place = fields.find("sizes")->place();
  std::vector<std::size_t> kept_axes;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const std::string& kind = axes[a].kind;
    const bool may_be_spatial = kind.empty() || kind == "domain" || kind == "space" ||
                                kind == "time" || kind == "???" || kind == "none";
    if (kind == "time" && axes[a].size > 1) {
      input.fail(place, "there are " + std::to_string(axes[a].size) + " time steps",
                 "Save one time step as a volume of three dimensions.");
    }
    if (may_be_spatial && (!has_directions || axes[a].has_direction || kind == "time")) {
      kept_axes.push_back(a);
    } else if (axes[a].size > 1) {
      input.fail(place,
                 "there are " + std::to_string(axes[a].size) + " values a voxel (dimension " +
                     std::to_string(a) + (kind.empty() ? "" : ", kind " + printable(kind)) + ")",
                 "Save one component as a separate volume.");
    }
  }
  const auto drop_axes_of_size_1 = [&](bool time_only) {
    for (std::size_t i = kept_axes.size(); i-- > 0 && kept_axes.size() > 3;) {
      const NrrdAxis& axis = axes[kept_axes[i]];
      if (axis.size == 1 && (!time_only || axis.kind == "time")) {
        kept_axes.erase(kept_axes.begin() + static_cast<std::ptrdiff_t>(i));
      }
    }
  };
  drop_axes_of_size_1(true);
  drop_axes_of_size_1(false);
  if (kept_axes.size() > 3) {
    input.fail(place,
               std::to_string(kept_axes.size()) +
                   " dimensions have more than one sample, as in a series " + "over time",
               "Save one time step or component as a volume of three dimensions.");
  }
  if (kept_axes.size() < 3) {
    input.fail(
        place, "only " + std::to_string(kept_axes.size()) + " dimensions are of space",
        "Kiln reads volumes of three dimensions; correct \"kinds\" or \"space directions\".");
  }
  return {kept_axes[0], kept_axes[1], kept_axes[2]};
}

namespace {

/// True if the named space has a left-handed basis.
bool is_left_handed(const VolumeInput& input, const HeaderFields& fields) {
  static constexpr std::pair<std::string_view, bool> kSpaces[] = {
      {"right-anterior-superior", false},
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
                 "Kiln reads spaces of three dimensions; save one time step.");
    }
  }
  const HeaderField* space = fields.find("space");
  if (space == nullptr) return false;
  const std::string name = lower_case(space->value);
  for (const auto& [known, left] : kSpaces) {
    if (name == known) return left;
  }
  input.fail(space->place(), "Kiln does not know the space \"" + printable(space->value) + "\"",
             "It knows right-anterior-superior, left-anterior-superior, left-posterior-superior, "
             "scanner-xyz, 3D-right-handed and 3D-left-handed.");
}

}  // namespace

void place_in_space(const VolumeInput& input, const HeaderFields& fields,
                    const std::vector<NrrdAxis>& axes, const std::array<std::size_t, 3>& chosen,
                    Volume& volume) {
  std::uint64_t missing = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const NrrdAxis& axis = axes[chosen[a]];
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
  if (is_left_handed(input, fields)) {
    volume.origin[0] = -volume.origin[0];
    for (auto& axis : volume.axes) axis[0] = -axis[0];
  }
  const HeaderField* field = fields.find("spacedirections");
  if (field == nullptr) field = fields.find("spacings");
  check_geometry(input, field == nullptr ? "header" : field->place(), volume);
}

}  // namespace kiln
