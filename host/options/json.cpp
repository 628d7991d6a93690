#include "options/json.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/json_depth.h"

namespace kiln {

Json::Json() = default;
Json::Json(std::nullptr_t) {}
Json::Json(Number number) : kind_(number.kind), integer_bits_(number.integer_bits) {}
Json::Json(double value) : kind_(Kind::real), real_(value) {}
Json::Json(const char* text) : kind_(Kind::text), text_(text) {}
Json::Json(std::string text) : kind_(Kind::text), text_(std::move(text)) {}
Json::Json(std::string_view text) : kind_(Kind::text), text_(text) {}
Json::Json(const Json& other) = default;
Json::Json(Json&& other) noexcept = default;
Json& Json::operator=(const Json& other) = default;
Json& Json::operator=(Json&& other) noexcept = default;
Json::~Json() = default;

Json::Json(std::initializer_list<Element> elements) {
  const bool pairs = std::all_of(elements.begin(), elements.end(), [](const Element& element) {
    return element.is_array() && element.size() == 2 && element[0].is_string();
  });
  kind_ = pairs ? Kind::object : Kind::list;
  elements_.reserve(elements.size());
  for (const Element& element : elements) {
    if (pairs) {
      (*this)[element[0].text()] = element[1];
    } else {
      elements_.push_back(element);
    }
  }
}

Json Json::array() { return array({}); }

Json Json::array(std::initializer_list<Element> elements) {
  Json json;
  json.kind_ = Kind::list;
  json.elements_.assign(elements.begin(), elements.end());
  return json;
}

Json Json::object() {
  Json json;
  json.kind_ = Kind::object;
  return json;
}

const Json& Json::back() const { return elements_.back(); }

void Json::push_back(Json element) {
  if (kind_ == Kind::null) kind_ = Kind::list;
  elements_.push_back(std::move(element));
}

Json& Json::operator[](std::string_view key) {
  if (kind_ == Kind::null) kind_ = Kind::object;
  const auto found = std::find(keys_.begin(), keys_.end(), key);
  if (found != keys_.end()) return elements_[static_cast<std::size_t>(found - keys_.begin())];
  keys_.emplace_back(key);
  return elements_.emplace_back();
}

const Json& Json::at(std::string_view path) const {
  static const Json kNull;
  if (path.empty()) return *this;
  const std::size_t dot = path.find('.');
  const auto found = std::find(keys_.begin(), keys_.end(), path.substr(0, dot));
  if (found == keys_.end()) return kNull;
  const Json& value = elements_[static_cast<std::size_t>(found - keys_.begin())];
  return dot == path.npos ? value : value.at(path.substr(dot + 1));
}

void Json::update(const Json& other) {
  for (std::size_t i = 0; i < other.keys_.size(); ++i) (*this)[other.keys_[i]] = other.elements_[i];
}

double Json::number() const {
  if (kind_ == Kind::signed_integer)
    return static_cast<double>(static_cast<std::int64_t>(integer_bits_));
  return kind_ == Kind::real ? real_ : static_cast<double>(integer_bits_);
}

Json Json::with_texts(std::string (*change)(std::string_view)) const {
  Json json = *this;
  if (is_string()) json.text_ = change(text_);
  for (std::string& key : json.keys_) key = change(key);
  for (Json& element : json.elements_) element = element.with_texts(change);
  return json;
}

struct Json::Library {
  using Value = nlohmann::ordered_json;

  static Value to(const Json& json) {
    switch (json.kind_) {
      case Kind::boolean:
        return json.integer_bits_ != 0;
      case Kind::signed_integer:
        return static_cast<std::int64_t>(json.integer_bits_);
      case Kind::unsigned_integer:
        return json.integer_bits_;
      case Kind::real:
        return json.real_;
      case Kind::text:
        return json.text_;
      case Kind::list: {
        Value value = Value::array();
        for (const Json& element : json.elements_) value.push_back(to(element));
        return value;
      }
      case Kind::object: {
        Value value = Value::object();
        for (std::size_t i = 0; i < json.keys_.size(); ++i) {
          value[json.keys_[i]] = to(json.elements_[i]);
        }
        return value;
      }
      case Kind::null:
        break;
    }
    return {};
  }

  static Json from(const Value& value) {
    if (value.is_boolean()) return value.get<bool>();
    if (value.is_number_unsigned()) return value.get<std::uint64_t>();
    if (value.is_number_integer()) return value.get<std::int64_t>();
    if (value.is_number()) return value.get<double>();
    if (value.is_string()) return value.get_ref<const std::string&>();
    Json json;
    if (value.is_array()) json = array();
    if (value.is_object()) json = object();
    for (auto item = value.begin(); item != value.end(); ++item) {
      if (value.is_array()) json.push_back(from(*item));
      if (value.is_object()) json[item.key()] = from(*item);
    }
    return json;
  }
};

Json Json::parse(std::string_view text) {
  if (is_nested_too_deep(text)) return {};
  const Library::Value value = Library::Value::parse(text, nullptr, false);
  return value.is_discarded() ? Json() : Library::from(value);
}

std::string Json::dump(int indent) const { return Library::to(*this).dump(indent); }

namespace {

bool is_escape(std::string_view text) {
  const auto digit = [&](std::size_t i) {
    return std::isxdigit(static_cast<unsigned char>(text[i])) != 0;
  };
  return text.size() >= 4 && text[0] == '\\' && text[1] == 'x' && digit(2) && digit(3);
}

unsigned value_of(char digit) {
  const auto c = static_cast<unsigned char>(digit);
  return c <= '9' ? c - '0' : static_cast<unsigned>(std::tolower(c)) - 'a' + 10U;
}

}  // namespace

std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80) return 0;
  }
  const unsigned second = byte(1);
  const bool is_invalid = (first == 0xE0 && second < 0xA0) || (first == 0xED && second > 0x9F) ||
                          (first == 0xF0 && second < 0x90) || (first == 0xF4 && second > 0x8F);
  return is_invalid ? 0 : length;
}

std::string escape_bytes(std::string_view bytes) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(bytes.size());
  while (!bytes.empty()) {
    const std::size_t length = is_escape(bytes) ? 0 : utf8_length(bytes);
    if (length == 0) {
      const auto byte = static_cast<unsigned char>(bytes[0]);
      text += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
    } else {
      text += bytes.substr(0, length);
    }
    bytes.remove_prefix(length == 0 ? 1 : length);
  }
  return text;
}

std::string unescape_bytes(std::string_view text) {
  std::string bytes;
  while (!text.empty()) {
    const bool escape = is_escape(text);
    bytes += escape ? static_cast<char>(16 * value_of(text[2]) + value_of(text[3])) : text[0];
    text.remove_prefix(escape ? 4 : 1);
  }
  return bytes;
}

std::string to_text(const Json& json) { return json.with_texts(escape_bytes).dump(2) + "\n"; }

}  // namespace kiln
