// Patterns of paths with captures: "assets/{dir}/{name}_low.*".
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kiln {

/// Values of captures by name.
using Captures = std::map<std::string, std::string>;

/// A pattern of paths. `*` is any text within a name, `?` one character, `**/` any folders, or none. `{a,b}` is one of
/// several texts. `{name}` is any text within a name, not empty, which is captured; `{dir}/` likewise any folders, or
/// none. A capture that occurs twice is the same text both times. `[*]`, `[?]`, `[{]` and `[}]` are the characters
/// themselves. `\` is `/`. Of several ways to match the one decides whose earlier captures are longer.
class PathPattern {
 public:
  PathPattern() = default;
  /// \throws Error(usage) for braces without an end, and for too many alternatives
  explicit PathPattern(std::string_view text);

  const std::string& text() const { return text_; }
  /// Names of captures, in the order of the pattern.
  const std::vector<std::string>& captures() const { return captures_; }
  /// True if it has captures, or matches more than one path.
  bool is_plain() const;
  /// \param known     values that captures must have \param captured  out: those of all captures, where it matches
  bool matches(std::string_view path, const Captures& known, Captures& captured) const;
  /// True if it matches the path, or a folder that the path lies in.
  bool covers(std::string_view path) const;
  /// The path of a plain pattern, or with these values for captures. \throws Error(usage) where something is left open
  std::string path(const Captures& captures) const;
  /// The same with values for captures that are known: others, and wildcards, stay.
  PathPattern with(const Captures& captures) const;
  /// Its last name ends in a wildcard, such as "{name}_low.*".
  bool has_open_ending() const;

 private:
  friend class FileLister;
  enum class Kind : unsigned char { text, any, one, folders, capture, folder_capture };
  struct Token {
    Kind kind;
    std::string text;  ///< Of a text; the name of a capture
  };
  using Tokens = std::vector<Token>;
  struct Matching;

  static Tokens tokens_of(std::string_view text);

  std::string text_;
  std::vector<Tokens> ways_;  ///< One for each choice of alternatives
  std::vector<std::string> captures_;
};

/// A text without characters that patterns take for their own.
std::string escape_pattern(std::string_view text);

/// Files by patterns. What a folder holds is read once.
class FileLister {
 public:
  /// \param base  where relative patterns begin; empty: the current folder
  explicit FileLister(std::filesystem::path base)
      : base_(base.empty() ? std::filesystem::path(".") : std::move(base)) {}

  struct Found {
    std::string path;  ///< With / alone; below the base where the pattern is relative
    Captures captures;
  };
  /// All regular files that match, by name. Names that begin with a dot only match patterns that do.
  /// \throws Error(usage) for too many files, Error(input) for folders that cannot be read
  std::vector<Found> find(const PathPattern& pattern, const Captures& known = {});
  /// Names of regular files of a folder, sorted; none where there is no such folder.
  const std::vector<std::string>& files_of(const std::string& folder);

 private:
  struct Folder {
    std::vector<std::string> files, folders;  ///< Sorted
  };
  const Folder& folder_at(const std::string& path);
  void walk(const std::string& folder, std::size_t depth, std::size_t deepest,
            const PathPattern& pattern, const Captures& known, std::vector<Found>& found);

  std::filesystem::path base_;
  std::map<std::string, Folder> folders_;
  std::size_t entries_ = 0;
};

}  // namespace kiln
