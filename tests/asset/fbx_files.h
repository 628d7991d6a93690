// Text FBX made by a test.
#pragma once

#include <string>
#include <vector>

namespace kiln::test {

/// A triangle mesh with the settings of an FBX.
struct FbxMaker {
  int up = 1, up_sign = 1, front = 2, front_sign = 1, coord = 0, coord_sign = 1;
  double centimetres = 1;
  std::vector<double> vertices;
  std::vector<int> corners;  // three a triangle
  /// Sets of UVs, each two a corner.
  struct Set {
    std::string name;
    std::vector<double> uvs;
  };
  std::vector<Set> sets;
  std::string picture;  // of the material's colour; empty: no material
  std::string placing;  // lines of the picture's Properties70

  std::string text() const {
    const auto setting = [](const char* name, double value, bool whole) {
      return std::string("\t\tP: \"") + name + "\", \"" + (whole ? "int" : "double") + "\", \"" +
             (whole ? "Integer" : "Number") + "\", \"\"," +
             (whole ? std::to_string(static_cast<int>(value)) : number(value)) + "\n";
    };
    std::string result =
        "; FBX 7.3.0 project file\nFBXHeaderExtension:  {\n\tFBXVersion: 7300\n}\n"
        "GlobalSettings:  {\n\tVersion: 1000\n\tProperties70:  {\n" +
        setting("UpAxis", up, true) + setting("UpAxisSign", up_sign, true) +
        setting("FrontAxis", front, true) + setting("FrontAxisSign", front_sign, true) +
        setting("CoordAxis", coord, true) + setting("CoordAxisSign", coord_sign, true) +
        setting("UnitScaleFactor", centimetres, false) +
        "\t}\n}\nObjects:  {\n\tGeometry: 10, \"Geometry::g\", \"Mesh\" {\n\t\tVertices: " +
        list(vertices) + "\t\tPolygonVertexIndex: ";
    std::vector<double> ends;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      ends.push_back(i % 3 == 2 ? -corners[i] - 1 : corners[i]);
    }
    result += list(ends);
    std::string layers;
    for (std::size_t i = 0; i < sets.size(); ++i) {
      const std::string index = std::to_string(i);
      result += "\t\tLayerElementUV: " + index + " {\n\t\t\tVersion: 101\n\t\t\tName: \"" +
                sets[i].name +
                "\"\n\t\t\tMappingInformationType: \"ByPolygonVertex\"\n"
                "\t\t\tReferenceInformationType: \"Direct\"\n\t\t\tUV: " +
                list(sets[i].uvs) + "\t\t}\n";
      layers += "\t\tLayer: " + index +
                " {\n\t\t\tVersion: 100\n\t\t\tLayerElement:  {\n"
                "\t\t\t\tType: \"LayerElementUV\"\n\t\t\t\tTypedIndex: " +
                index + "\n\t\t\t}\n\t\t}\n";
    }
    if (!picture.empty()) {
      result +=
          "\t\tLayerElementMaterial: 0 {\n\t\t\tVersion: 101\n\t\t\tName: \"\"\n"
          "\t\t\tMappingInformationType: \"AllSame\"\n"
          "\t\t\tReferenceInformationType: \"IndexToDirect\"\n\t\t\tMaterials: *1 {\n"
          "\t\t\t\ta: 0\n\t\t\t}\n\t\t}\n";
      layers +=
          "\t\tLayer: 0 {\n\t\t\tVersion: 100\n\t\t\tLayerElement:  {\n"
          "\t\t\t\tType: \"LayerElementMaterial\"\n\t\t\t\tTypedIndex: 0\n\t\t\t}\n\t\t}\n";
    }
    result += layers + "\t}\n\tModel: 20, \"Model::part\", \"Mesh\" {\n\t\tVersion: 232\n\t}\n";
    std::string connections = "\tC: \"OO\",20,0\n\tC: \"OO\",10,20\n";
    if (!picture.empty()) {
      result +=
          "\tMaterial: 30, \"Material::skin\", \"\" {\n\t\tVersion: 102\n\t}\n"
          "\tTexture: 40, \"Texture::t\", \"\" {\n\t\tFileName: \"" +
          picture + "\"\n\t\tRelativeFilename: \"" + picture + "\"\n\t\tProperties70:  {\n" +
          placing + "\t\t}\n\t}\n";
      connections += "\tC: \"OO\",30,20\n\tC: \"OP\",40,30, \"DiffuseColor\"\n";
    }
    return result + "}\nConnections:  {\n" + connections + "}\n";
  }

 private:
  static std::string number(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.9g", value);
    return text;
  }
  static std::string list(const std::vector<double>& values) {
    std::string text = "*" + std::to_string(values.size()) + " {\n\t\t\ta: ";
    for (std::size_t i = 0; i < values.size(); ++i) text += (i == 0 ? "" : ",") + number(values[i]);
    return text + "\n\t\t}\n";
  }
};

}  // namespace kiln::test
