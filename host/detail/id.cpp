// Colours of the parts, materials, groups or objects of the high poly.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <unordered_map>

#include "base/disjoint_sets.h"
#include "base/formatted.h"
#include "detail/id_colors.h"
#include "detail/point_map.h"
#include "detail/vertex_colors.h"
#include "mesh/kernels_shared.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Connected components, numbered by their lowest triangle. Triangles are connected if they share a position.
std::vector<std::uint32_t> find_connected_parts(const Source::Impl& source, std::uint32_t& parts) {
  std::vector<std::uint32_t> part(source.triangles.size());
  const std::vector<std::uint32_t> place = weld_vertices(source.positions);
  DisjointSets sets(source.positions.size());
  for (const Triangle& t : source.triangles) {
    sets.join(place[t[0]], place[t[1]]);
    sets.join(place[t[0]], place[t[2]]);
  }
  std::vector<std::uint32_t> number(source.positions.size(), KILN_NO_TRIANGLE);
  for (std::size_t t = 0; t < part.size(); ++t) {
    std::uint32_t& component = number[sets.find(place[source.triangles[t][0]])];
    if (component == KILN_NO_TRIANGLE) component = parts++;
    part[t] = component;
  }
  return part;
}

/// Maximum number of entries in the legend. If there are more, the rest is left out, and a warning
/// says so.
constexpr std::size_t kMaxLegendEntries = 4096;

class IdMap : public PointFunction {
 public:
  IdMap(const Source::Impl& source, IdBy by) : source_(source), id_by_(by) {
    if (by == IdBy::color) {
      check_vertex_colors(source, "id",
                          "give a mesh that has them, or assign colours to connected parts.");
      number_colors();
    } else if (by != IdBy::part) {
      const char* const kind = by == IdBy::material ? "materials"
                               : by == IdBy::group  ? "groups"
                                                    : "objects";
      const Source::Impl::Names& names = by == IdBy::material ? source.materials
                                         : by == IdBy::group  ? source.groups
                                                              : source.objects;
      if (names.of.size() != source.triangles.size() || names.names.empty()) {
        throw Error(
            ErrorCode::input,
            std::string("The high poly has no ") + kind +
                ", to which the map id assigns colours: give an OBJ that has them, or assign "
                "colours to connected parts.");
      }
      part_of_triangle_ = names.of;
      const std::vector<std::array<float, 3>> colors = name_colors(names.names);
      for (std::size_t i = 0; i < colors.size(); ++i) {
        color_legend_.push_back({names.names[i], colors[i], 0});
      }
      count_triangles();
    }
  }

  /// Connected parts are found anew if vertices moved, since parts may have merged or split.
  void prepare(std::uint64_t source_version) override {
    if (id_by_ != IdBy::part || source_version_ == source_version) return;
    source_version_ = source_version;
    std::uint32_t parts = 0;
    part_of_triangle_ = find_connected_parts(source_, parts);
    color_legend_.clear();
    for (std::uint32_t part = 0; part < parts; ++part) {
      color_legend_.push_back({"part " + std::to_string(part), part_color(part), 0});
    }
    count_triangles();
  }

  PointNeeds needs() const override {
    return {.position = false, .normal = false, .distance = false};
  }
  void operator()(const HighPoint& point, float* value) const override {
    if (!point.found) return;  // Missed samples stay black
    const std::array<float, 3> color = id_by_ == IdBy::color
                                           ? fraction(source_.colors[nearest_corner(point)])
                                           : color_legend_[part_of_triangle_[point.triangle]].color;
    std::copy(color.begin(), color.end(), value);
  }

  void report(BakedMap& map, std::vector<Warning>& warnings) const override {
    const std::size_t count = std::min(color_legend_.size(), kMaxLegendEntries);
    map.ids.assign(color_legend_.begin(),
                   color_legend_.begin() + static_cast<std::ptrdiff_t>(count));
    if (count == color_legend_.size()) return;
    warnings.push_back({"id-legend",
                        "The map " + std::string(map.kind.name) + " has " +
                            std::to_string(color_legend_.size()) +
                            " ids; its legend lists only the first " + std::to_string(count) +
                            (id_by_ == IdBy::color ? "." : ", and colours repeat."),
                        color_legend_.size()});
  }

 private:
  using Color = std::array<std::uint8_t, 4>;

  static std::array<float, 3> fraction(const Color& color) {
    return {static_cast<float>(color[0]) / 255, static_cast<float>(color[1]) / 255,
            static_cast<float>(color[2]) / 255};
  }

  std::uint32_t nearest_corner(const HighPoint& point) const {
    const double weights[3] = {1.0 - point.u - point.v, point.u, point.v};
    const auto nearest = std::max_element(std::begin(weights), std::end(weights)) - weights;
    return source_.triangles[point.triangle][static_cast<std::size_t>(nearest)];
  }

  /// Builds the legend of vertex colours, in the order of triangles. A triangle has the colour of its first
  /// corner.
  void number_colors() {
    std::unordered_map<std::uint32_t, std::uint32_t> number_of_color;
    const auto number_of_color_at = [&](std::uint32_t vertex) {
      const Color& c = source_.colors[vertex];
      const auto key = std::uint32_t{c[0]} << 16U | std::uint32_t{c[1]} << 8U | c[2];
      const auto [entry, added] =
          number_of_color.try_emplace(key, static_cast<std::uint32_t>(color_legend_.size()));
      if (added) color_legend_.push_back({formatted("#%06x", key), fraction(c), 0});
      return entry->second;
    };
    for (const Triangle& t : source_.triangles) {
      part_of_triangle_.push_back(number_of_color_at(t[0]));
      number_of_color_at(t[1]);
      number_of_color_at(t[2]);
    }
    count_triangles();
  }

  void count_triangles() {
    for (const std::uint32_t number : part_of_triangle_) {
      if (number >= color_legend_.size()) {
        throw Error(ErrorCode::input,
                    "The index of a triangle's name is outside of the high poly's list of names.");
      }
      ++color_legend_[number].triangles;
    }
  }

  const Source::Impl& source_;
  IdBy id_by_;
  std::optional<std::uint64_t> source_version_;
  std::vector<std::uint32_t> part_of_triangle_;  // For each triangle, the index of its part or name
  std::vector<IdEntry> color_legend_;
};

}  // namespace

MapRow id_map() {
  MapRow row;
  row.info = {MapKind{"id"},
              3,
              MapType::id,
              "one colour for each connected part, material, group, object or vertex colour of the "
              "high poly",
              0,
              1};
  row.info.options = "id_by";
  row.follows_positions = true;
  row.info.other_names = "material_id object_id";
  row.make = [](const MapRequest& request) {
    return make_point_map(request, id_map().info,
                          std::unique_ptr<PointFunction>(
                              std::make_unique<IdMap>(request.source, request.options.id_by)));
  };
  return row;
}

}  // namespace kiln
