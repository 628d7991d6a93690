// JSON of a glTF file, read with checks that name the place.
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

/// A value of a glTF file, or the lack of one, and what to call it: "accessors[3].count". Each function throws
/// Error(input) for a value that is of another type.
class GltfValue {
 public:
  GltfValue(const MeshInput& input, const nlohmann::json* value, std::string place)
      : input_(&input), value_(value), place_(std::move(place)) {}

  bool exists() const { return value_ != nullptr; }
  const std::string& place() const { return place_; }
  /// A member of this object; none where this is missing.
  GltfValue operator[](std::string_view key) const;
  /// An entry of this list; below size().
  GltfValue at(std::size_t index) const;
  /// Elements of this list; 0 where it is missing.
  std::size_t size() const;

  /// Names of this object's members; none where it is missing.
  std::vector<std::string> names() const;

  std::string text() const;  ///< Empty where it is missing
  bool flag() const;         ///< False where it is missing
  double number(double otherwise) const;
  std::uint64_t count(std::uint64_t otherwise) const;
  /// An index into a list of the file; nothing where it is missing.
  std::optional<std::size_t> index_into(const GltfValue& list) const;
  /// As many numbers, or `otherwise` where they are missing.
  template <std::size_t N>
  std::array<double, N> numbers(const std::array<double, N>& otherwise) const {
    if (!exists()) return otherwise;
    if (size() != N)
      fail("it has " + std::to_string(size()) + " numbers and not " + std::to_string(N));
    std::array<double, N> result;
    for (std::size_t k = 0; k < N; ++k) result[k] = at(k).number(0);
    return result;
  }
  /// As JSON; empty where it is missing.
  std::string dump() const;

  [[noreturn]] void fail(const std::string& problem,
                         const Message& remedy = "Export the file again.") const;

 private:
  const MeshInput* input_;
  const nlohmann::json* value_;
  std::string place_;
};

}  // namespace kiln
