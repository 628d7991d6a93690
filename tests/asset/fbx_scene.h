// FBX files made by tests as a tree of records, written as text or binary.
#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace kiln::test {

/// A record of FBX: its name, its values, the records within.
struct FbxRecord {
  using Value = std::variant<std::int64_t, double, std::string, std::vector<double>,
                             std::vector<std::int32_t>>;
  std::string name;
  std::vector<Value> values = {};
  std::vector<FbxRecord> children = {};
};

/// A scene: `objects` and `connections` are the file's, `settings` the properties of its GlobalSettings.
class FbxScene {
 public:
  using Numbers = std::vector<double>;
  using Integers = std::vector<std::int32_t>;

  std::vector<FbxRecord> objects, connections, settings;

  static FbxRecord property(const std::string& name, const std::string& type,
                            const Numbers& values) {
    FbxRecord record{"P", {name, type, std::string(), std::string("A")}};
    const bool whole = type == "int" || type == "enum";
    for (const double value : values) {
      whole ? record.values.emplace_back(static_cast<std::int64_t>(value))
            : record.values.emplace_back(value);
    }
    return record;
  }
  static FbxRecord vector(const std::string& name, double x, double y, double z) {
    return property(name, "Vector3D", {x, y, z});
  }

  FbxRecord& add(const char* kind, std::int64_t id, const std::string& name, const char* type,
                 std::vector<FbxRecord> properties = {}) {
    FbxRecord& record = objects.emplace_back(FbxRecord{kind, {id, name, std::string(type)}});
    if (!properties.empty()) record.children.push_back({"Properties70", {}, std::move(properties)});
    return record;
  }
  /// \param corners  ends of polygons as FBX has them: -1 - index
  FbxRecord& mesh(std::int64_t id, const Numbers& vertices, const Integers& corners) {
    FbxRecord& record = add("Geometry", id, "Geometry::g", "Mesh");
    record.children.push_back({"Vertices", {vertices}});
    record.children.push_back({"PolygonVertexIndex", {corners}});
    return record;
  }
  FbxRecord& model(std::int64_t id, const std::string& name, std::int64_t parent,
                   std::vector<FbxRecord> properties = {}, const char* type = "Mesh") {
    connect(id, parent);
    return add("Model", id, "Model::" + name, type, std::move(properties));
  }
  void connect(std::int64_t child, std::int64_t parent) {
    connections.push_back({"C", {std::string("OO"), child, parent}});
  }
  /// A mesh of one unit square in the node's xy plane.
  void square(std::int64_t id, std::int64_t model) {
    mesh(id, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 1, 2, -4});
    connect(id, model);
  }

  std::string text() const {
    std::string result = "; FBX 7.4.0 project file\n";
    for (const FbxRecord& record : records(7400)) write_text(record, 0, result);
    return result;
  }

  /// \param packed  whether arrays are deflated
  std::string binary(std::uint32_t version, bool packed) const {
    std::string result("Kaydara FBX Binary  \0\x1a\0", 23);
    put(result, version, 4);
    for (const FbxRecord& record : records(version)) write_binary(record, version, packed, result);
    result.append(version >= 7500 ? 25 : 13, '\0');
    return result;
  }

 private:
  std::vector<FbxRecord> records(std::int64_t version) const {
    std::vector<FbxRecord> properties = settings;
    if (properties.empty()) {
      for (const auto& [name, axis] : {std::pair("Up", 1.0), {"Front", 2.0}, {"Coord", 0.0}}) {
        properties.push_back(property(std::string(name) + "Axis", "int", {axis}));
        properties.push_back(property(std::string(name) + "AxisSign", "int", {1}));
      }
      properties.push_back(property("UnitScaleFactor", "double", {100}));
    }
    return {{"FBXHeaderExtension", {}, {{"FBXVersion", {version}}}},
            {"GlobalSettings",
             {},
             {{"Version", {std::int64_t{1000}}}, {"Properties70", {}, properties}}},
            {"Objects", {}, objects},
            {"Connections", {}, connections}};
  }

  static std::string number(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", value);
    return text;
  }

  static void write_text(const FbxRecord& record, int depth, std::string& to) {
    const std::string indent(static_cast<std::size_t>(depth), '\t');
    to += indent + record.name + ": ";
    std::vector<FbxRecord> within = record.children;
    bool first = true;
    for (const FbxRecord::Value& value : record.values) {
      if (!first) to += ", ";
      first = false;
      const auto array = [&](const auto& list, const auto& spell) {
        to += "*" + std::to_string(list.size()) + " {\n" + indent + "\ta: ";
        for (std::size_t i = 0; i < list.size(); ++i) to += (i == 0 ? "" : ",") + spell(list[i]);
        to += "\n" + indent + "}";
      };
      if (const auto* integer = std::get_if<std::int64_t>(&value)) {
        to += std::to_string(*integer);
      } else if (const auto* real = std::get_if<double>(&value)) {
        to += number(*real);
      } else if (const auto* string = std::get_if<std::string>(&value)) {
        to += "\"" + *string + "\"";
      } else if (const auto* reals = std::get_if<Numbers>(&value)) {
        array(*reals, [](double v) { return number(v); });
      } else {
        array(std::get<Integers>(value), [](std::int32_t v) { return std::to_string(v); });
      }
    }
    if (!record.children.empty()) {
      to += " {\n";
      for (const FbxRecord& child : record.children) write_text(child, depth + 1, to);
      to += indent + "}";
    }
    to += "\n";
  }

  static void put(std::string& to, std::uint64_t value, std::size_t bytes) {
    to.append(reinterpret_cast<const char*>(&value), bytes);
  }

  static void put_array(std::string& to, char type, const void* data, std::size_t count,
                        std::size_t size, bool packed) {
    std::string bytes(static_cast<const char*>(data), count * size);
    if (packed) {
      uLongf length = compressBound(bytes.size());
      std::string small(length, '\0');
      compress(reinterpret_cast<Bytef*>(small.data()), &length,
               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
      bytes = small.substr(0, length);
    }
    to += type;
    put(to, count, 4);
    put(to, packed ? 1 : 0, 4);
    put(to, bytes.size(), 4);
    to += bytes;
  }

  static void write_binary(const FbxRecord& record, std::uint32_t version, bool packed,
                           std::string& to) {
    const std::size_t size = version >= 7500 ? 8 : 4, head = to.size();
    to.append(3 * size, '\0');
    put(to, record.name.size(), 1);
    to += record.name;
    const std::size_t first = to.size();
    for (const FbxRecord::Value& value : record.values) {
      if (const auto* integer = std::get_if<std::int64_t>(&value)) {
        to += 'L';
        put(to, static_cast<std::uint64_t>(*integer), 8);
      } else if (const auto* real = std::get_if<double>(&value)) {
        to += 'D';
        to.append(reinterpret_cast<const char*>(real), 8);
      } else if (const auto* string = std::get_if<std::string>(&value)) {
        // "Class::name" of text is "name", 0, 1, "Class".
        std::string spelt = *string;
        if (const std::size_t at = spelt.find("::"); at != std::string::npos) {
          spelt = spelt.substr(at + 2) + std::string("\0\1", 2) + spelt.substr(0, at);
        }
        to += 'S';
        put(to, spelt.size(), 4);
        to += spelt;
      } else if (const auto* reals = std::get_if<Numbers>(&value)) {
        put_array(to, 'd', reals->data(), reals->size(), 8, packed);
      } else {
        const Integers& integers = std::get<Integers>(value);
        put_array(to, 'i', integers.data(), integers.size(), 4, packed);
      }
    }
    const std::size_t length = to.size() - first;
    for (const FbxRecord& child : record.children) write_binary(child, version, packed, to);
    if (!record.children.empty()) to.append(3 * size + 1, '\0');
    const std::array<std::uint64_t, 3> header{to.size(), record.values.size(), length};
    for (std::size_t k = 0; k < 3; ++k) std::memcpy(to.data() + head + k * size, &header[k], size);
  }
};

}  // namespace kiln::test
