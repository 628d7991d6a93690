// glTF files made by a test.
#pragma once

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace kiln::test {

/// A file under construction: `json` is changed at will, and buffer 0 grows by what is added.
class GltfMaker {
 public:
  nlohmann::json json{{"asset", {{"version", "2.0"}}}};

  /// Adds bytes as a buffer view. \returns its index
  template <typename T>
  std::size_t add_view(const std::vector<T>& values) {
    binary_.resize((binary_.size() + 3) / 4 * 4, '\0');
    const std::size_t bytes = values.size() * sizeof(T);
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes}});
    binary_.append(reinterpret_cast<const char*>(values.data()), bytes);
    return json["bufferViews"].size() - 1;
  }

  /// Adds an accessor over values of its own. \returns its index
  template <typename T>
  std::size_t add(const std::string& type, const std::vector<T>& values, bool normalized = false) {
    const std::size_t width = type == "SCALAR" ? 1
                              : type == "MAT4" ? 16
                                               : static_cast<std::size_t>(type[3] - '0');
    nlohmann::json accessor{{"bufferView", add_view(values)},
                            {"componentType", component_type(T())},
                            {"count", values.size() / width},
                            {"type", type}};
    if (normalized) accessor["normalized"] = true;
    json["accessors"].push_back(accessor);
    return json["accessors"].size() - 1;
  }

  /// A mesh of one primitive, and a node for it where asked.
  std::size_t add_mesh(const nlohmann::json& primitive, bool node = true) {
    json["meshes"].push_back({{"primitives", {primitive}}});
    const std::size_t mesh = json["meshes"].size() - 1;
    if (node) json["nodes"].push_back({{"mesh", mesh}});
    return mesh;
  }

  std::string glb() const {
    nlohmann::json whole = json;
    std::string binary = binary_;
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    if (!whole.contains("buffers")) whole["buffers"] = {{{"byteLength", binary_.size()}}};
    std::string text = whole.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string result = "glTF";
    put(result, 2);
    put(result, static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + binary.size()));
    put(result, static_cast<std::uint32_t>(text.size()));
    result += "JSON" + text;
    put(result, static_cast<std::uint32_t>(binary.size()));
    result += std::string("BIN\0", 4) + binary;
    return result;
  }
  const std::string& binary() const { return binary_; }

 private:
  static int component_type(std::int8_t) { return 5120; }
  static int component_type(std::uint8_t) { return 5121; }
  static int component_type(std::int16_t) { return 5122; }
  static int component_type(std::uint16_t) { return 5123; }
  static int component_type(std::uint32_t) { return 5125; }
  static int component_type(float) { return 5126; }
  static void put(std::string& to, std::uint32_t value) {
    char bytes[4];
    std::memcpy(bytes, &value, 4);
    to.append(bytes, 4);
  }
  std::string binary_;
};

/// The unit square in z = 0, facing +z, of two triangles.
inline GltfMaker gltf_square() {
  GltfMaker maker;
  const std::size_t positions = maker.add<float>("VEC3", {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  const std::size_t uvs = maker.add<float>("VEC2", {0, 1, 1, 1, 1, 0, 0, 0});
  const std::size_t indices = maker.add<std::uint16_t>("SCALAR", {0, 1, 2, 0, 2, 3});
  maker.add_mesh(
      {{"attributes", {{"POSITION", positions}, {"TEXCOORD_0", uvs}}}, {"indices", indices}});
  return maker;
}

}  // namespace kiln::test
