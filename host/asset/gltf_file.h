// A glTF 2.0 file: its JSON, buffers and accessors, with every size checked before it is used.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "asset/gltf_json.h"

namespace kiln {

/// Values of an accessor.
struct GltfNumbers {
  std::size_t width = 0;       ///< Numbers per element
  std::vector<double> values;  ///< Normalised integers as fractions

  std::size_t count() const { return width == 0 ? 0 : values.size() / width; }
  const double* at(std::size_t element) const { return &values[element * width]; }
};

class GltfFile {
 public:
  /// Parses the container and the JSON; buffers are read at first use. The input must outlive this.
  /// \throws Error(input), as all functions here
  explicit GltfFile(const MeshInput& input);
  ~GltfFile();
  GltfFile(const GltfFile&) = delete;
  GltfFile& operator=(const GltfFile&) = delete;

  const MeshInput& input() const { return input_; }
  GltfValue root() const;
  /// A top-level list, such as "meshes".
  GltfValue list(std::string_view name) const { return root()[name]; }

  /// \param width  numbers per element; kColor: 3 or 4; kMatrix: a MAT4, column-major
  GltfNumbers numbers(std::size_t accessor, std::size_t width) const;
  static constexpr std::size_t kColor = 34, kMatrix = 16;
  /// True if an accessor's numbers are integers, normalised or not.
  bool holds_integers(std::size_t accessor) const;
  /// The integer that stands for 1 in a normalised accessor.
  static double largest_of(const GltfValue& accessor);
  /// Indices, each below `below`, so that primitive-restart indices are refused, too.
  std::vector<std::uint32_t> indices(std::size_t accessor, std::size_t below) const;
  /// Number of an accessor's elements, checked against the file's size before it is read.
  std::size_t count(std::size_t accessor) const;

  /// The bytes of a buffer view.
  std::string_view view(std::size_t index) const;
  /// True for a data URI, whose decoded bytes are stored in `bytes`.
  static bool decode_data_uri(const GltfValue& uri, std::string& bytes);
  /// The file of a URI. Absolute paths, and paths out of the folder, also by symbolic links, are refused without
  /// LoadMeshOptions::outside.
  std::filesystem::path path_of(const GltfValue& uri) const;

 private:
  struct Elements;
  /// Fields of EXT_meshopt_compression. Views with equal fields have the same bytes.
  struct Packed {
    std::size_t buffer = 0;
    std::uint64_t offset = 0, length = 0, count = 0, step = 0;
    std::string mode, filter;

    auto operator<=>(const Packed&) const = default;
  };
  std::string_view buffer(std::size_t index) const;
  std::string_view part_of_buffer(const GltfValue& view) const;
  std::shared_ptr<const std::string> read_buffer(const GltfValue& uri) const;
  Packed packed_of(const GltfValue& packed) const;
  void check_packed() const;
  std::string unpack(const GltfValue& view, const GltfValue& packed, const Packed& part) const;
  Elements elements(const GltfValue& accessor, const GltfValue& place_of_view, std::size_t count,
                    std::uint64_t offset, std::uint64_t component_type, std::size_t width,
                    std::size_t row_step) const;
  Elements locate(const GltfValue& accessor) const;
  GltfNumbers read(std::size_t accessor, std::size_t width, bool indices) const;

  const MeshInput& input_;
  std::unique_ptr<nlohmann::json> json_;
  std::string_view binary_;
  bool has_binary_ = false;
  // Caches: buffers except binary_, and files that several buffers may share.
  mutable std::map<std::size_t, std::shared_ptr<const std::string>> buffers_;
  mutable std::map<std::filesystem::path, std::shared_ptr<const std::string>> files_;
  mutable std::map<Packed, std::string> unpacked_;  // cached decompressed views
  mutable bool packed_fit_ = false;                 // result of check_packed()
};

}  // namespace kiln
