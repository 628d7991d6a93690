#ifdef KILN_HAS_UFBX
#include "asset/fbx_smoothing.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <string>
#include <utility>

#include "asset/scene_parts.h"
#include "base/disjoint_sets.h"
#include "io/file/bounds.h"

namespace kiln {
namespace {

/// A side of a face: its two vertices in ascending order, and the face's corners at them.
struct Side {
  std::array<std::uint32_t, 2> vertices, corners;
};

void join_along_edges(const ufbx_mesh& mesh, DisjointSets& pieces) {
  using Key = std::array<std::uint32_t, 2>;
  const auto vertex = [&mesh](std::uint32_t corner) { return mesh.vertex_indices.data[corner]; };
  const auto key_of = [](std::uint32_t a, std::uint32_t b) {
    return Key{std::min(a, b), std::max(a, b)};
  };
  std::vector<Key> hard_edges;
  for (std::size_t e = 0; e < mesh.edges.count; ++e) {
    if (mesh.edge_smoothing.data[e]) continue;
    hard_edges.push_back(key_of(vertex(mesh.edges.data[e].a), vertex(mesh.edges.data[e].b)));
  }
  std::sort(hard_edges.begin(), hard_edges.end());
  std::vector<Side> sides;
  sides.reserve(mesh.num_indices);
  for (const ufbx_face& face : mesh.faces) {
    for (std::uint32_t i = 0; i < face.num_indices; ++i) {
      std::uint32_t a = face.index_begin + i;
      std::uint32_t b = face.index_begin + (i + 1) % face.num_indices;
      if (vertex(a) > vertex(b)) std::swap(a, b);
      sides.push_back({{vertex(a), vertex(b)}, {a, b}});
    }
  }
  std::stable_sort(sides.begin(), sides.end(),
                   [](const Side& a, const Side& b) { return a.vertices < b.vertices; });
  for (std::size_t i = 1; i < sides.size(); ++i) {
    const Side &last = sides[i - 1], &side = sides[i];
    if (last.vertices != side.vertices) continue;
    if (std::binary_search(hard_edges.begin(), hard_edges.end(), side.vertices)) continue;
    for (const std::size_t k : {0U, 1U}) pieces.join(last.corners[k], side.corners[k]);
  }
}

void join_faces_by_groups(const ufbx_mesh& mesh, const std::vector<std::uint32_t>& groups,
                          DisjointSets& pieces) {
  std::vector<std::array<std::uint32_t, 2>> corners;  // Pairs of vertex and corner
  corners.reserve(mesh.num_indices);
  std::vector<std::uint32_t> mask_of(mesh.num_indices);
  for (std::size_t f = 0; f < mesh.faces.count; ++f) {
    const ufbx_face& face = mesh.faces.data[f];
    for (std::uint32_t i = 0; i < face.num_indices; ++i) {
      const std::uint32_t corner = face.index_begin + i;
      corners.push_back({mesh.vertex_indices.data[corner], corner});
      mask_of[corner] = groups[f];
    }
  }
  join_by_groups(std::move(corners), mask_of, pieces);
}

const std::string_view kGroups = "LayerElementSmoothing";

/// Edge flags and smoothing groups of a geometry; in old files, of a model.
struct Geometry {
  bool is_mesh = false, is_by_polygon = false, has_groups = false;
  std::vector<std::uint32_t> groups;
};

/// Parses a binary FBX, which consists of records with an end offset, properties and nested
/// records.
class BinaryGroups {
 public:
  BinaryGroups(std::string_view bytes, std::vector<std::vector<std::uint32_t>>& result)
      : bytes_(bytes), result_(result) {
    std::uint32_t version = 0;
    std::memcpy(&version, bytes.data() + 23, 4);
    has_64_bit_offsets_ = version >= 7500;
  }

  void read() {
    for_each_record(27, bytes_.size(), [this](const Record& record) {
      if (record.name != "Objects") return;
      for_each_record(record.children, record.end, [this](const Record& object) {
        if (object.name == "Geometry" || object.name == "Model") geometry(object);
      });
    });
  }

 private:
  struct Record {
    std::string_view name;
    std::uint64_t properties = 0, count = 0, children = 0, end = 0;
  };

  std::uint64_t number(std::uint64_t at, std::size_t size) const {
    std::uint64_t value = 0;
    if (at + size <= bytes_.size()) std::memcpy(&value, bytes_.data() + at, size);
    return value;
  }

  template <typename Visit>
  void for_each_record(std::uint64_t at, std::uint64_t end, const Visit& visit) const {
    const std::size_t size = has_64_bit_offsets_ ? 8 : 4;
    const std::uint64_t head = 3 * size + 1;
    while (at + head <= end) {
      Record record;
      record.end = number(at, size);
      record.count = number(at + size, size);
      const std::uint64_t length = number(at + 2 * size, size);
      const std::uint64_t name = number(at + 3 * size, 1);
      record.properties = at + head + name;
      // A record whose end offset is 0 terminates a list.
      if (record.end <= at || record.end > end || record.properties > record.end ||
          length > record.end - record.properties) {
        return;
      }
      record.name = bytes_.substr(at + head, name);
      record.children = record.properties + length;
      visit(record);
      at = record.end;
    }
  }

  void geometry(const Record& object) const {
    Geometry found;
    for_each_record(object.children, object.end, [&](const Record& part) {
      if (part.name == "PolygonVertexIndex") found.is_mesh = true;
      if (part.name != kGroups || found.has_groups) return;
      std::vector<std::uint32_t> groups;
      bool is_by_polygon = false;
      for_each_record(part.children, part.end, [&](const Record& field) {
        if (field.name == "MappingInformationType") {
          is_by_polygon = bytes_.substr(field.properties, field.children - field.properties)
                              .ends_with("ByPolygon");
        }
        if (field.name == "Smoothing") groups = numbers(field);
      });
      if (!is_by_polygon) return;
      found.has_groups = true;
      found.groups = std::move(groups);
    });
    if (found.is_mesh) result_.push_back(std::move(found.groups));
  }

  /// The numbers in a record: one array, which may be compressed; in old files, one property per
  /// number.
  std::vector<std::uint32_t> numbers(const Record& record) const {
    std::vector<std::uint32_t> values;
    std::uint64_t offset = record.properties;
    for (std::uint64_t i = 0; i < record.count && offset < record.children; ++i) {
      const char type = bytes_[offset++];
      if (type == 'I') {
        values.push_back(static_cast<std::uint32_t>(number(offset, 4)));
        offset += 4;
      } else if (type == 'i') {
        const std::uint64_t count = number(offset, 4), encoding = number(offset + 4, 4),
                            stored = number(offset + 8, 4);
        offset += 12;
        if (offset > record.children || stored > record.children - offset) return {};
        const std::uint64_t size = 4 * count;
        if (size > (encoding == 0 ? stored : max_unpacked_bytes(Packing::deflate, stored)))
          return {};
        values.resize(count);
        if (count == 0) return values;
        auto* const destination = reinterpret_cast<Bytef*>(values.data());
        const auto* const compressed = reinterpret_cast<const Bytef*>(bytes_.data() + offset);
        uLongf unpacked = size;
        if (encoding == 0) {
          std::memcpy(destination, compressed, size);
        } else if (uncompress(destination, &unpacked, compressed, stored) != Z_OK ||
                   unpacked != size) {
          return {};
        }
        return values;
      } else {
        return {};
      }
    }
    return values;
  }

  std::string_view bytes_;
  std::vector<std::vector<std::uint32_t>>& result_;
  bool has_64_bit_offsets_ = false;
};

/// Parses a text FBX, which consists of `Key: value, value { Key: ... }`. Strings and comments may
/// contain any characters.
class TextGroups {
 public:
  TextGroups(std::string_view text, std::vector<std::vector<std::uint32_t>>& result)
      : fbx_text_(text), result_(result) {}

  void read() {
    while (at_ < fbx_text_.size()) {
      const char c = fbx_text_[at_];
      if (c == ';') {
        at_ = std::min(fbx_text_.find('\n', at_), fbx_text_.size());
      } else if (c == '"') {
        string();
      } else if (c == '{') {
        open_record_keys_.push_back(key_);
        ++at_;
      } else if (c == '}') {
        ++at_;
        close_record();
      } else if (is_word(c)) {
        word();
      } else {
        ++at_;
      }
    }
  }

 private:
  static bool is_word(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '+' || c == '.' || c == '|';
  }

  bool is_in_smoothing_groups() const {
    return open_record_keys_.size() >= 3 && open_record_keys_[2] == kGroups;
  }

  void string() {
    const std::size_t end = std::min(fbx_text_.find('"', at_ + 1), fbx_text_.size());
    if (is_in_smoothing_groups() && key_ == "MappingInformationType") {
      is_by_polygon_ = fbx_text_.substr(at_ + 1, end - at_ - 1) == "ByPolygon";
    }
    at_ = std::min(end + 1, fbx_text_.size());
  }

  void word() {
    const std::size_t begin = at_;
    while (at_ < fbx_text_.size() && is_word(fbx_text_[at_])) ++at_;
    const std::string_view word = fbx_text_.substr(begin, at_ - begin);
    if (at_ < fbx_text_.size() && fbx_text_[at_] == ':') {
      key_ = word;
      ++at_;
      if (open_record_keys_.size() == 2 && key_ == "PolygonVertexIndex")
        current_geometry_.is_mesh = true;
      return;
    }
    // A number after '*' is the length of the list, not one of its values.
    if (!is_in_smoothing_groups() || (begin != 0 && fbx_text_[begin - 1] == '*')) return;
    const bool is_value =
        (open_record_keys_.size() == 3 && key_ == "Smoothing") ||
        (open_record_keys_.size() == 4 && open_record_keys_[3] == "Smoothing" && key_ == "a");
    std::int64_t value = 0;
    if (!is_value ||
        std::from_chars(word.data(), word.data() + word.size(), value).ec != std::errc())
      return;
    groups_.push_back(static_cast<std::uint32_t>(value));
  }

  void close_record() {
    if (open_record_keys_.empty()) return;
    if (open_record_keys_.size() == 3 && is_in_smoothing_groups()) {
      if (is_by_polygon_ && !current_geometry_.has_groups) {
        current_geometry_.has_groups = true;
        current_geometry_.groups = std::move(groups_);
      }
      groups_.clear();
      is_by_polygon_ = false;
    }
    if (open_record_keys_.size() == 2 && open_record_keys_[0] == "Objects") {
      if (current_geometry_.is_mesh &&
          (open_record_keys_[1] == "Geometry" || open_record_keys_[1] == "Model")) {
        result_.push_back(std::move(current_geometry_.groups));
      }
      current_geometry_ = {};
    }
    open_record_keys_.pop_back();
    key_ = {};
  }

  std::string_view fbx_text_;
  std::vector<std::vector<std::uint32_t>>& result_;
  std::size_t at_ = 0;
  std::vector<std::string_view> open_record_keys_;
  std::string_view key_;
  Geometry current_geometry_;
  std::vector<std::uint32_t> groups_;
  bool is_by_polygon_ = false;
};

}  // namespace

std::vector<std::uint32_t> smooth_pieces(const ufbx_mesh& mesh,
                                         const std::vector<std::uint32_t>& groups) {
  const bool has_edges = mesh.edge_smoothing.count != 0 && mesh.edges.count != 0 &&
                         mesh.edge_smoothing.count >= mesh.edges.count;
  if (!has_edges && groups.empty()) return {};
  DisjointSets pieces(mesh.num_indices);  // Sets of corners; each set is a smooth piece
  if (has_edges) {
    join_along_edges(mesh, pieces);
  } else {
    join_faces_by_groups(mesh, groups, pieces);
  }
  std::vector<std::uint32_t> result(mesh.num_indices);
  for (std::uint32_t i = 0; i < result.size(); ++i) result[i] = pieces.find(i);
  return result;
}

std::vector<std::vector<std::uint32_t>> fbx_smoothing_groups(std::string_view bytes) {
  std::vector<std::vector<std::uint32_t>> result;
  constexpr std::string_view kMagic = "Kaydara FBX Binary";
  if (bytes.starts_with(kMagic)) {
    if (bytes.size() > 27 && bytes[22] == 0) BinaryGroups(bytes, result).read();
  } else {
    TextGroups(bytes, result).read();
  }
  return result;
}

}  // namespace kiln
#endif
