// Reads the container of glTF 2.0: JSON, buffers and accessors. Every size is checked before it is
// used.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asset/gltf_json.h"

namespace kiln {

/// The values of an accessor.
struct GltfNumbers {
  std::size_t width = 0;       ///< Number of components per element
  std::vector<double> values;  ///< The numbers; normalised integers are converted to fractions

  std::size_t count() const { return width == 0 ? 0 : values.size() / width; }
  const double* at(std::size_t element) const { return &values[element * width]; }
};

class GltfFile {
 public:
  /// Parses the container and the JSON. Buffers are read when they are first used. The input must
  /// outlive the object.
  /// \throws Error(input), as do all functions of this class
  explicit GltfFile(const MeshInput& input);
  ~GltfFile();
  GltfFile(const GltfFile&) = delete;
  GltfFile& operator=(const GltfFile&) = delete;

  const MeshInput& input() const { return input_; }
  GltfValue root() const;
  /// A top-level list of the JSON, such as "meshes".
  GltfValue list(std::string_view name) const { return root()[name]; }

  /// Reads the values of an accessor.
  /// \param width  number of components per element; kColor: 3 or 4; kMatrix: a MAT4 in column-major
  ///   order
  GltfNumbers numbers(std::size_t accessor, std::size_t width) const;
  static constexpr std::size_t kColor = 34, kMatrix = 16;
  /// True if an accessor stores integers, normalised or not.
  bool holds_integers(std::size_t accessor) const;
  /// The integer that stands for 1 in a normalised accessor.
  static double integer_of_one(const GltfValue& accessor);
  /// Reads indices. Each must be less than `below`, which excludes the index for primitive restart,
  /// too.
  std::vector<std::uint32_t> indices(std::size_t accessor, std::size_t below) const;
  /// Number of elements of an accessor. It is checked against the size of the buffer view, which is
  /// not decompressed for this.
  std::size_t count(std::size_t accessor) const;

  /// The bytes of a buffer view after decompression.
  std::string_view view(std::size_t index) const;
  /// Decodes a data URI to `bytes`.
  /// \returns false if the URI is not a data URI
  static bool decode_data_uri(const GltfValue& uri, std::string& bytes);
  /// Path of the file that a URI names. Unless LoadMeshOptions::outside is set, rejects absolute
  /// paths and paths that lead out of the folder, also by symbolic links.
  std::filesystem::path path_of(const GltfValue& uri) const;

 private:
  struct Elements;
  /// The fields of EXT_meshopt_compression in a view. Views with equal fields have the same bytes.
  struct CompressedView {
    std::size_t buffer = 0;
    std::uint64_t offset = 0, length = 0, count = 0, step = 0;
    std::string mode, filter;

    auto operator<=>(const CompressedView&) const = default;
  };
  std::string_view buffer(std::size_t index) const;
  std::string_view part_of_buffer(const GltfValue& view) const;
  std::shared_ptr<const std::string> read_buffer(const GltfValue& uri) const;
  CompressedView compressed_view_of(const GltfValue& packed) const;
  std::size_t view_size(std::size_t index) const;
  void check_packed() const;
  std::string unpack(const GltfValue& packed, const CompressedView& part) const;
  Elements check_elements(const GltfValue& accessor, const GltfValue& place_of_view,
                          std::size_t count, std::uint64_t offset, std::uint64_t component_type,
                          std::size_t width, std::size_t row_step) const;
  std::optional<Elements> check_elements(const GltfValue& accessor) const;
  const char* first_of(const Elements& elements) const;
  GltfNumbers read(std::size_t accessor, std::size_t width, bool indices) const;

  const MeshInput& input_;
  std::unique_ptr<nlohmann::json> json_;
  std::string_view binary_;
  bool has_binary_ = false;
  // Cached bytes of buffers, except for binary_, and of files, which several buffers may share
  mutable std::map<std::size_t, std::shared_ptr<const std::string>> buffers_;
  mutable std::map<std::filesystem::path, std::shared_ptr<const std::string>> files_;
  // Cached bytes of decompressed views
  mutable std::map<CompressedView, std::string> unpacked_;
  // True once check_packed() has accepted all compressed views
  mutable bool are_compressed_views_checked_ = false;
};

}  // namespace kiln
