// JSON as a value: what reports are made of. A type of its own: the library behind it (nlohmann, in
// json.cpp alone) takes compilers seconds for each file that includes its headers.
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

/// A list of numbers, texts and the like, such as a vector or a set.
template <typename List>
concept JsonList = !std::convertible_to<const List&, std::string> && requires(const List& list) {
  list.begin();
  list.end();
};

/// Null, a truth value, a number, a text, a list, or an object whose keys keep their order.
class Json {
 public:
  /// One of a list in braces: {value} in there is a list of one, not the value.
  struct Element;

  /// Null.
  Json();
  Json(std::nullptr_t);
  /// A truth value.
  template <std::same_as<bool> Truth>
  Json(Truth value) : Json(Number{.kind = Kind::truth, .whole = value ? 1U : 0U}) {}
  /// A whole number.
  template <std::integral Whole>
  requires(!std::same_as<Whole, bool>) Json(Whole value)
      : Json(Number{.kind = std::is_signed_v<Whole> ? Kind::whole : Kind::natural,
                    .whole = static_cast<std::uint64_t>(value)}) {}
  /// A number; null in texts where it is not finite.
  Json(double value);
  /// A text, bytes of UTF-8.
  Json(const char* text);
  Json(std::string text);
  Json(std::string_view text);
  /// The value, or null.
  template <typename Value>
  Json(const std::optional<Value>& value) : Json(value ? Json(*value) : Json()) {}
  /// A list, element by element.
  template <JsonList List>
  Json(const List& list) : Json(array()) {
    for (const auto& element : list) push_back(element);
  }
  /// An object where every element is a list of two of which the first is a text, else a list.
  Json(std::initializer_list<Element> elements);

  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(const Json& other);
  Json& operator=(Json&& other) noexcept;
  ~Json();

  /// A list, whatever its elements are.
  static Json array();
  static Json array(std::initializer_list<Element> elements);
  /// An object without keys.
  static Json object();
  /// Null where the text is no JSON, or nested deeper than kMostJsonDepth.
  static Json parse(std::string_view text);

  bool is_null() const { return kind_ == Kind::null; }
  bool is_string() const { return kind_ == Kind::text; }
  bool is_number() const {
    return kind_ == Kind::whole || kind_ == Kind::natural || kind_ == Kind::real;
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
  /// Adds to a list; null becomes one.
  void push_back(Json element);

  /// The value of an object's key, null where it is new; null becomes an object.
  Json& operator[](std::string_view key);
  /// Keys of an object, in their order.
  const std::vector<std::string>& keys() const { return keys_; }
  /// The value at a path of keys with dots between them, such as "seconds.total"; null where there is none.
  const Json& at(std::string_view path) const;
  /// Sets every key of another object, too.
  void update(const Json& other);

  /// Value of a number.
  double number() const;
  /// Characters of a text.
  const std::string& text() const { return text_; }

  /// The same with a function of every text and key.
  Json with_texts(std::string (*change)(std::string_view)) const;
  /// As text: so many blanks a level, or one line where fewer than 0.
  std::string dump(int indent = -1) const;

 private:
  enum class Kind : std::uint8_t { null, truth, whole, natural, real, text, list, object };
  struct Number {
    Kind kind;
    std::uint64_t whole;
  };
  explicit Json(Number number);
  struct Library;  // to and from the library's own type

  Kind kind_ = Kind::null;
  std::uint64_t whole_ = 0;  // truth; whole, as two's complement; natural
  double real_ = 0;
  std::string text_;
  std::vector<Json> elements_;     // of a list, or an object's values
  std::vector<std::string> keys_;  // of an object
};

struct Json::Element : Json {
  using Json::Json;
  Element(const Json& value) : Json(value) {}
  Element(Json&& value) noexcept : Json(std::move(value)) {}
};

/// Bytes of the UTF-8 character at the start; 0 where there is none (RFC 3629: neither too long a form,
/// nor half of a surrogate, nor beyond U+10FFFF). \param text  not empty
std::size_t utf8_length(std::string_view text);

/// UTF-8 of any bytes, such as a path's: a byte that is no part of UTF-8 becomes \xNN, two hexadecimal
/// digits. So does a backslash before what would read as such (\x5c): whoever puts the byte NN for every
/// \xNN has the bytes back. Other text stays as it is.
std::string escape_bytes(std::string_view bytes);

/// The bytes that escape_bytes was given.
std::string unescape_bytes(std::string_view text);

/// Two blanks a level, and a line's end. Every string and key is escaped as above.
std::string to_text(const Json& json);

}  // namespace kiln
