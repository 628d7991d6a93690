// Checked access to the JSON of a glTF file. Errors name the element.
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asset/mesh_reader.h"

namespace kiln {

/// A value in a glTF file, which may be missing, and its path, such as "accessors[3].count". Each
/// function throws Error(input) if the value has another type.
class GltfValue {
 public:
  GltfValue(const MeshInput& input, const nlohmann::json* value, std::string place)
      : input_(&input), value_(value), place_(std::move(place)) {}

  bool exists() const { return value_ != nullptr; }
  const std::string& place() const { return place_; }
  /// The member of this object that has a key; missing if the object or the member is missing.
  GltfValue operator[](std::string_view key) const;
  /// The element of this list at an index, which must be less than size().
  GltfValue at(std::size_t index) const;
  /// Number of elements of this list; 0 if it is missing.
  std::size_t size() const;

  /// Names of the members of this object; empty if it is missing.
  std::vector<std::string> names() const;

  std::string text() const;  ///< The string; empty if missing
  bool flag() const;         ///< The boolean; false if missing
  double number(double otherwise) const;
  std::uint64_t count(std::uint64_t otherwise) const;
  /// An index into a list of the file; nullopt if it is missing.
  std::optional<std::size_t> index_into(const GltfValue& list) const;
  /// A list of N numbers; `otherwise` if it is missing.
  template <std::size_t N>
  std::array<double, N> numbers(const std::array<double, N>& otherwise) const {
    if (!exists()) return otherwise;
    if (size() != N)
      fail("it has " + std::to_string(size()) + " numbers and not " + std::to_string(N));
    std::array<double, N> result;
    for (std::size_t k = 0; k < N; ++k) result[k] = at(k).number(0);
    return result;
  }
  /// This value as JSON text; empty if it is missing.
  std::string dump() const;

  [[noreturn]] void fail(const std::string& problem,
                         const Message& remedy = "Export the file again.") const;

 private:
  const MeshInput* input_;
  const nlohmann::json* value_;
  std::string place_;
};

}  // namespace kiln
