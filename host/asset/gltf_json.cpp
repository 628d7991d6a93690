#include "asset/gltf_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/counted.h"

namespace kiln {

void GltfValue::fail(const std::string& problem, const Message& remedy) const {
  input_->fail(place_, problem, remedy);
}

GltfValue GltfValue::operator[](std::string_view key) const {
  std::string place = place_.empty() ? std::string(key) : place_ + "." + std::string(key);
  if (!exists()) return {*input_, nullptr, std::move(place)};
  if (!value_->is_object()) fail("it is not an object");
  const auto found = value_->find(key);
  return {*input_, found == value_->end() ? nullptr : &*found, std::move(place)};
}

GltfValue GltfValue::at(std::size_t index) const {
  return {*input_, &(*value_)[index], place_ + "[" + std::to_string(index) + "]"};
}

std::size_t GltfValue::size() const {
  if (!exists()) return 0;
  if (!value_->is_array()) fail("it is not a list");
  return value_->size();
}

std::vector<std::string> GltfValue::names() const {
  if (!exists()) return {};
  if (!value_->is_object()) fail("it is not an object");
  std::vector<std::string> names;
  for (const auto& [name, value] : value_->items()) names.push_back(name);
  return names;
}

std::string GltfValue::text() const {
  if (!exists()) return {};
  if (!value_->is_string()) fail("it is not a text");
  return value_->get<std::string>();
}

bool GltfValue::flag() const {
  if (!exists()) return false;
  if (!value_->is_boolean()) fail("it is neither true nor false");
  return value_->get<bool>();
}

double GltfValue::number(double otherwise) const {
  if (!exists()) return otherwise;
  if (!value_->is_number()) fail("it is not a number");
  const auto number = value_->get<double>();
  if (!std::isfinite(number)) fail("it is not a finite number");
  return number;
}

std::uint64_t GltfValue::count(std::uint64_t otherwise) const {
  if (!exists()) return otherwise;
  // Up to this number, doubles represent every integer
  constexpr double kMaxExactInteger = 9007199254740992;
  const double value = number(0);  // Some exporters write integers as 3.0
  if (!(value >= 0 && value <= kMaxExactInteger) || value != std::floor(value)) {
    fail("it is not a non-negative integer");
  }
  return static_cast<std::uint64_t>(value);
}

std::optional<std::size_t> GltfValue::index_into(const GltfValue& list) const {
  if (!exists()) return std::nullopt;
  const std::uint64_t index = count(0);
  if (index >= list.size()) {
    fail("it is " + std::to_string(index) + ", but " + there_are_only(list.size()) + " in " +
         list.place());
  }
  return static_cast<std::size_t>(index);
}

std::string GltfValue::dump() const {
  // With this error handler, invalid UTF-8 is replaced instead of an exception being thrown.
  return exists() ? value_->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)
                  : std::string();
}

}  // namespace kiln
