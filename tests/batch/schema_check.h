// Whether JSON fits a JSON Schema, as far as Kiln's schemas use it.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

namespace kiln::test {

/// \returns why it does not fit; empty: it does
inline std::string misfit(const nlohmann::json& schema, const nlohmann::json& value) {
  using nlohmann::json;
  if (schema.contains("anyOf")) {
    for (const json& one : schema["anyOf"]) {
      if (misfit(one, value).empty()) return {};
    }
    return value.dump() + " fits none of " + schema["anyOf"].dump();
  }
  if (schema.contains("type")) {
    const auto is = [&](const std::string& type) {
      return (type == "string" && value.is_string()) || (type == "number" && value.is_number()) ||
             (type == "integer" && value.is_number_integer()) ||
             (type == "boolean" && value.is_boolean()) || (type == "array" && value.is_array()) ||
             (type == "object" && value.is_object()) || (type == "null" && value.is_null());
    };
    const json types = schema["type"].is_array() ? schema["type"] : json::array({schema["type"]});
    if (std::none_of(types.begin(), types.end(), is))
      return value.dump() + " is no " + types.dump();
  }
  if (schema.contains("enum") &&
      std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end()) {
    return value.dump() + " is none of " + schema["enum"].dump();
  }
  if (value.is_number() && schema.contains("minimum") && value < schema["minimum"])
    return value.dump() + " is too little";
  if (value.is_array() && schema.contains("items")) {
    for (const json& element : value) {
      if (const std::string why = misfit(schema["items"], element); !why.empty()) return why;
    }
  }
  if (!value.is_object()) return {};
  for (const json& key : schema.value("required", json::array())) {
    if (!value.contains(key)) return "no " + key.dump();
  }
  const json properties = schema.value("properties", json::object());
  for (const auto& [key, member] : value.items()) {
    if (!properties.contains(key) && schema.contains("additionalProperties") &&
        schema["additionalProperties"] == false)
      return "no key " + key;
    const json& of = properties.contains(key)
                         ? properties[key]
                         : schema.value("additionalProperties", json::object());
    if (!of.is_object()) continue;
    if (const std::string why = misfit(of, member); !why.empty()) return key + ": " + why;
  }
  return {};
}

}  // namespace kiln::test
