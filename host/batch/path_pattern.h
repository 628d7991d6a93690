// Path patterns with captures, such as "assets/{dir}/{name}_low.*".
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

/// A pattern of paths. `*` matches any text within a name, `?` one character, `**/` any number of folders. `{a,b}`
/// matches either text. `{name}` captures a non-empty text within a name; `{dir}/` captures any number of folders. A
/// capture that occurs twice must match the same text both times. `[*]`, `[?]`, `[{]` and `[}]` match the literal
/// characters. `\` is read as `/`. If a path matches in several ways, the way with the longest captures is used; an
/// earlier capture has priority over a later one.
class PathPattern {
 public:
  PathPattern() = default;
  /// Parses a pattern. \throws Error(usage) for unclosed braces, and for too many alternatives
  explicit PathPattern(std::string_view text);

  const std::string& text() const { return text_; }
  /// Returns the names of the captures, in the order in which the pattern has them.
  const std::vector<std::string>& captures() const { return captures_; }
  /// True if the pattern has no captures and no wildcards, so that it matches a single path.
  bool is_plain() const;
  /// True if the pattern matches a path.
  /// \param known     required values of captures
  /// \param captured  receives the values of all captures if the pattern matches
  bool matches(std::string_view path, const Captures& known, Captures& captured) const;
  /// True if the pattern matches the path, or a folder that contains the path.
  bool matches_path_or_parent(std::string_view path) const;
  /// True if the pattern selects an asset by its name: it matches the name or one of its parent folders, or the pattern
  /// has no `/` and matches the part of the name after the last `/`, as patterns of .gitignore do.
  bool selects_asset(std::string_view name) const;
  /// Substitutes all captures by their values, which must give a path.
  /// \throws Error(usage) if a capture or wildcard remains
  std::string path(const Captures& captures) const;
  /// Returns the pattern in which the given captures are substituted by their values. Other captures and wildcards
  /// remain.
  PathPattern substitute(const Captures& captures) const;
  /// True if the last name in the pattern ends in a wildcard, such as "{name}_low.*".
  bool has_open_ending() const;

 private:
  friend class FileLister;
  enum class Kind : unsigned char {
    text,
    any_text,
    any_character,
    any_folders,
    capture,
    folder_capture
  };
  struct Token {
    Kind kind;
    std::string text;  ///< The literal text, or the name of a capture
  };
  using Tokens = std::vector<Token>;
  struct Matcher;

  static Tokens tokenize(std::string_view text);

  std::string text_;
  std::vector<Tokens>
      expansions_;  ///< The tokens of one pattern for each combination of alternatives in braces
  std::vector<std::string> captures_;
};

/// Escapes the special characters of patterns in a text.
std::string escape_pattern(std::string_view text);

/// Finds files by patterns. Each folder is read once.
class FileLister {
 public:
  /// Creates a lister. \param base  folder of relative patterns; empty: the current folder
  explicit FileLister(std::filesystem::path base)
      : base_folder_(base.empty() ? std::filesystem::path(".") : std::move(base)) {}

  struct FoundFile {
    /// The path with `/` as separator; relative to the base if the pattern is relative
    std::string path;
    Captures captures;
  };
  /// Finds all regular files that match a pattern, sorted by path. A name that begins with a dot only matches if the
  /// name in the pattern begins with a dot, too.
  /// \throws Error(usage) for too many files, Error(input) for folders that cannot be read
  std::vector<FoundFile> find(const PathPattern& pattern, const Captures& known = {});
  /// Returns the sorted names of a folder's regular files; empty if the folder does not exist.
  const std::vector<std::string>& files_of(const std::string& folder);

 private:
  struct Folder {
    std::vector<std::string> files, folders;  ///< Sorted names in the folder
  };
  const Folder& list_folder(const std::string& path);
  void walk(const std::string& folder, std::size_t depth, std::size_t max_depth,
            const PathPattern& pattern, const Captures& known, std::vector<FoundFile>& found);

  std::filesystem::path base_folder_;
  std::map<std::string, Folder> folders_;
  std::size_t entries_ = 0;
};

}  // namespace kiln
