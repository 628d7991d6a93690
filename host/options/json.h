// A JSON value, used for reports and job files. It hides nlohmann/json: only json.cpp includes its headers, which add
// seconds to compile times.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace kiln {

/// A range of values convertible to Json, such as a vector or a set; strings are excluded.
template <typename List>
concept JsonList = !std::convertible_to<const List&, std::string> && requires(const List& list) {
  list.begin();
  list.end();
};

/// A null, boolean, number, string, list, or object whose keys keep their order.
class Json {
 public:
  /// An element of a braced list. {value} within such a list is a list of one element, not the value itself.
  struct Element;

  /// Creates null.
  Json();
  Json(std::nullptr_t);
  /// Creates a boolean.
  template <std::same_as<bool> Truth>
  Json(Truth value) : Json(Number{.kind = Kind::boolean, .integer_bits = value ? 1U : 0U}) {}
  /// Creates an integer.
  template <std::integral Integer>
  requires(!std::same_as<Integer, bool>) Json(Integer value)
      : Json(Number{
            .kind = std::is_signed_v<Integer> ? Kind::signed_integer : Kind::unsigned_integer,
            .integer_bits = static_cast<std::uint64_t>(value)}) {}
  /// Creates a number. dump() writes null if it is not finite.
  Json(double value);
  /// Creates a string from UTF-8 text.
  Json(const char* text);
  Json(std::string text);
  Json(std::string_view text);
  /// Creates the JSON value of what an optional contains, or null if it is empty.
  template <typename Value>
  Json(const std::optional<Value>& value) : Json(value ? Json(*value) : Json()) {}
  /// Creates a list of the elements of a range.
  template <JsonList List>
  Json(const List& list) : Json(array()) {
    for (const auto& element : list) push_back(element);
  }
  /// Creates an object if every element is a pair of a string and a value, else a list.
  Json(std::initializer_list<Element> elements);

  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(const Json& other);
  Json& operator=(Json&& other) noexcept;
  ~Json();

  /// Creates a list. Unlike the constructor, does so even if all elements are pairs of key and value, which would make
  /// an object.
  static Json array();
  static Json array(std::initializer_list<Element> elements);
  /// Creates an object without keys.
  static Json object();
  /// Parses a text.
  /// \returns null if the text is not valid JSON, or nested deeper than kMaxJsonDepth.
  static Json parse(std::string_view text);

  bool is_null() const { return kind_ == Kind::null; }
  bool is_string() const { return kind_ == Kind::text; }
  bool is_number() const {
    return kind_ == Kind::signed_integer || kind_ == Kind::unsigned_integer || kind_ == Kind::real;
  }
  bool is_array() const { return kind_ == Kind::list; }
  bool is_object() const { return kind_ == Kind::object; }

  /// Number of elements of a list or an object; null has 0.
  std::size_t size() const { return elements_.size(); }
  bool empty() const { return elements_.empty(); }
  /// Elements of a list.
  const std::vector<Json>& elements() const { return elements_; }
  template <std::integral Index>
  const Json& operator[](Index index) const {
    return elements_.at(static_cast<std::size_t>(index));
  }
  template <std::integral Index>
  Json& operator[](Index index) {
    return elements_.at(static_cast<std::size_t>(index));
  }
  const Json& back() const;
  /// Appends to this list. If this value is null, it becomes an empty list first.
  void push_back(Json element);

  /// Returns the value of a key, which is added with null if it is missing. If this value itself is null, it becomes an
  /// empty object first.
  Json& operator[](std::string_view key);
  /// Keys of an object, in insertion order.
  const std::vector<std::string>& keys() const { return keys_; }
  /// The value at a path of keys separated by dots, such as "seconds.total"; null if there is none.
  const Json& at(std::string_view path) const;
  /// Adds all keys of another object, overwriting existing ones.
  void update(const Json& other);

  /// The value of a number as double.
  double number() const;
  /// The characters of a string.
  const std::string& text() const { return text_; }

  /// Returns a copy in which every string and key is replaced by the result of change().
  Json with_texts(std::string (*change)(std::string_view)) const;
  /// Serialises with `indent` spaces per level, or on one line if negative.
  std::string dump(int indent = -1) const;

 private:
  enum class Kind : std::uint8_t {
    null,
    boolean,
    signed_integer,
    unsigned_integer,
    real,
    text,
    list,
    object
  };
  struct Number {
    Kind kind;
    std::uint64_t integer_bits;
  };
  explicit Json(Number number);
  struct Library;  // Conversion from and to nlohmann::json

  Kind kind_ = Kind::null;
  std::uint64_t integer_bits_ =
      0;  // A boolean or an integer; negative integers in two's complement
  double real_ = 0;
  std::string text_;
  std::vector<Json>
      elements_;  // The elements of a list, or the values of an object in the order of its keys
  std::vector<std::string> keys_;  // Keys of an object
};

struct Json::Element : Json {
  using Json::Json;
  Element(const Json& value) : Json(value) {}
  Element(Json&& value) noexcept : Json(std::move(value)) {}
};

/// Length in bytes of the UTF-8 character at the start; 0 if it is invalid (RFC 3629: no overlong forms, no surrogates,
/// nothing beyond U+10FFFF).
/// \param text  must not be empty
std::size_t utf8_length(std::string_view text);

/// Encodes arbitrary bytes, such as a path's, as UTF-8. Each byte that is not part of valid UTF-8 becomes a
/// backslash, x
/// and two hexadecimal digits (\xNN). A backslash before such a sequence becomes \x5c, so that the encoding is
/// reversible. Other text is unchanged.
std::string escape_bytes(std::string_view bytes);

/// Restores the bytes that escape_bytes() encoded.
std::string unescape_bytes(std::string_view text);

/// Serialises with two spaces per level and a final newline. All strings and keys pass escape_bytes().
std::string to_text(const Json& json);

}  // namespace kiln
