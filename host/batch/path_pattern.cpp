#include "batch/path_pattern.h"

#include <algorithm>
#include <system_error>

#include "base/file.h"
#include "kiln/error.h"
#include "options/parse.h"
#include "options/values.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

// Maximum number of combinations of alternatives in braces
constexpr std::size_t kMaxExpansions = 256;
// Maximum number of steps when a path is compared with a pattern, including backtracking
constexpr std::size_t kMaxPatternSteps = 200000;
// Maximum number of folder entries that a search visits
constexpr std::size_t kMaxEntries = 2000000;
constexpr std::size_t kMaxFiles = 200000;  // Maximum number of files that match
constexpr std::size_t kMaxDepth = 64;      // Maximum depth of nested folders

/// Returns the length in bytes of the escape, such as `[*]`, that begins at a position; 0 if there is none.
std::size_t escape_length(std::string_view text, std::size_t position) {
  if (text.size() < position + 3 || text[position] != '[' || text[position + 2] != ']') return 0;
  return std::string_view("*?{}").find(text[position + 1]) == std::string_view::npos ? 0 : 3;
}

std::size_t find_closing_brace(std::string_view text, std::size_t position) {
  const std::size_t end = text.find('}', position);
  refuse_if(end == std::string_view::npos,
            "The pattern '" + std::string(text) +
                "' has { without }: to match a brace itself, write [{].");
  const std::size_t inner = text.find('{', position + 1);
  refuse_if(inner < end,
            "The pattern '" + std::string(text) + "' has nested braces, which are not supported.");
  return end;
}

/// Expands `{a,b}` to one pattern for each combination of alternatives.
void expand_alternatives(std::string_view text, std::size_t from,
                         std::vector<std::string>& expansions) {
  for (std::size_t position = from; position < text.size(); ++position) {
    if (const std::size_t literal = escape_length(text, position)) {
      position += literal - 1;
      continue;
    }
    if (text[position] != '{') continue;
    const std::size_t end = find_closing_brace(text, position);
    const std::string_view choices = text.substr(position + 1, end - position - 1);
    if (choices.find(',') == std::string_view::npos) {
      position = end;
      continue;
    }
    std::size_t begin = 0;
    for (;;) {
      const std::size_t comma = std::min(choices.find(',', begin), choices.size());
      std::string expansion(text.substr(0, position));
      expansion += choices.substr(begin, comma - begin);
      const std::size_t next = expansion.size();
      expansion += text.substr(end + 1);
      expand_alternatives(expansion, next, expansions);
      if (comma == choices.size()) return;
      begin = comma + 1;
    }
  }
  refuse_if(expansions.size() >= kMaxExpansions,
            "The pattern '" + std::string(text) + "' has more than " +
                std::to_string(kMaxExpansions) + " alternatives: use *.");
  expansions.emplace_back(text);
}

bool is_capture_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

std::string normalize_slashes(std::string_view text) {
  std::string path(text);
  std::replace(path.begin(), path.end(), '\\', '/');
  while (path.starts_with("./")) path.erase(0, 2);
  return path;
}

}  // namespace

PathPattern::Tokens PathPattern::tokenize(std::string_view text) {
  Tokens tokens;
  const auto add_text = [&](std::string_view addition) {
    if (tokens.empty() || tokens.back().kind != Kind::text) tokens.push_back({Kind::text, {}});
    tokens.back().text += addition;
  };
  for (std::size_t position = 0; position < text.size();) {
    if (const std::size_t literal = escape_length(text, position)) {
      add_text(text.substr(position + 1, 1));
      position += literal;
    } else if (text[position] == '{') {
      const std::size_t end = find_closing_brace(text, position);
      const std::string name(text.substr(position + 1, end - position - 1));
      refuse_if(!is_capture_name(name),
                "The pattern '" + std::string(text) + "' has {" + name +
                    "}: the name of a capture consists of letters, digits and _.");
      const bool folders = name == "dir" && (end + 1 == text.size() || text[end + 1] == '/') &&
                           (position == 0 || text[position - 1] == '/');
      tokens.push_back({folders ? Kind::folder_capture : Kind::capture, name});
      position = end + 1;
      // The slash belongs to the token, so that a token that matches no folder needs no slash in the path.
      if (folders && position < text.size()) ++position;
    } else if (text.substr(position, 3) == "**/" && (position == 0 || text[position - 1] == '/')) {
      tokens.push_back({Kind::any_folders, {}});
      position += 3;
    } else if (text[position] == '*') {
      while (position < text.size() && text[position] == '*') ++position;
      tokens.push_back({Kind::any_text, {}});
    } else if (text[position] == '?') {
      tokens.push_back({Kind::any_character, {}});
      ++position;
    } else {
      add_text(text.substr(position, 1));
      ++position;
    }
  }
  return tokens;
}

PathPattern::PathPattern(std::string_view text) : text_(normalize_slashes(text)) {
  refuse_if(text_.find('\0') != std::string::npos,
            "A pattern contains a null byte, which no path can contain.");
  std::vector<std::string> expanded;
  expand_alternatives(text_, 0, expanded);
  for (const std::string& alternative : expanded) {
    expansions_.push_back(tokenize(alternative));
    for (const Token& token : expansions_.back()) {
      const bool capture = token.kind == Kind::capture || token.kind == Kind::folder_capture;
      if (capture && std::find(captures_.begin(), captures_.end(), token.text) == captures_.end()) {
        captures_.push_back(token.text);
      }
    }
  }
}

bool PathPattern::is_plain() const {
  return expansions_.size() == 1 &&
         std::all_of(expansions_[0].begin(), expansions_[0].end(),
                     [](const Token& token) { return token.kind == Kind::text; });
}

/// Matches one path with one pattern by backtracking. For each wildcard, the longest text is tried first.
struct PathPattern::Matcher {
  const Tokens& tokens;
  std::string_view path;
  Captures captures;
  std::size_t steps = 0;

  bool match_from(std::size_t token, std::size_t position) {
    refuse_if(++steps > kMaxPatternSteps,
              "A pattern matches '" + std::string(path) + "' in too many ways: use fewer *.");
    if (token == tokens.size()) return position == path.size();
    const Token& current = tokens[token];
    switch (current.kind) {
      case Kind::text:
        return path.substr(position, current.text.size()) == current.text &&
               match_from(token + 1, position + current.text.size());
      case Kind::any_character:
        return position < path.size() && path[position] != '/' &&
               match_from(token + 1, position + 1);
      case Kind::any_folders:
        return try_folders(token, position, nullptr);
      case Kind::folder_capture:
        return try_folders(token, position, &current.text);
      case Kind::any_text:
      case Kind::capture:
        break;
    }
    const bool capture = current.kind == Kind::capture;
    if (capture && captures.count(current.text) != 0) {
      const std::string captured_text = captures[current.text];
      return path.substr(position, captured_text.size()) == captured_text &&
             match_from(token + 1, position + captured_text.size());
    }
    const std::size_t end = std::min(path.find('/', position), path.size());
    // Neither wildcards nor captures match the dot at the start of a hidden name.
    if (position < path.size() && path[position] == '.' &&
        (position == 0 || path[position - 1] == '/'))
      return false;
    for (std::size_t match_end = end + 1; match_end-- > position + (capture ? 1 : 0);) {
      if (capture)
        captures[current.text] = std::string(path.substr(position, match_end - position));
      if (match_from(token + 1, match_end)) return true;
    }
    if (capture) captures.erase(current.text);
    return false;
  }

  /// Matches as many folders as possible, with their slashes; at the end of a pattern, the last folder has no slash.
  bool try_folders(std::size_t token, std::size_t position, const std::string* name) {
    const bool is_last = token + 1 == tokens.size();
    const auto match_rest = [&](std::string_view folders, std::size_t next) {
      if (name == nullptr) return match_from(token + 1, next);
      const auto captured_folders = captures.find(*name);
      if (captured_folders != captures.end())
        return captured_folders->second == folders && match_from(token + 1, next);
      captures[*name] = std::string(folders);
      if (match_from(token + 1, next)) return true;
      captures.erase(*name);
      return false;
    };
    if (is_last)
      return name == nullptr ? position == path.size()
                             : match_rest(path.substr(position), path.size());
    for (std::size_t slash = path.rfind('/'); slash != std::string_view::npos && slash > position;
         slash = slash == 0 ? std::string_view::npos : path.rfind('/', slash - 1)) {
      if (match_rest(path.substr(position, slash - position), slash + 1)) return true;
    }
    return match_rest({}, position);
  }
};

bool PathPattern::matches(std::string_view path, const Captures& known_captures,
                          Captures& captured) const {
  for (const Tokens& tokens : expansions_) {
    Matcher match{tokens, path, known_captures};
    if (match.match_from(0, 0)) {
      captured = std::move(match.captures);
      return true;
    }
  }
  return false;
}

bool PathPattern::matches_path_or_parent(std::string_view path) const {
  Captures no_captures;
  for (std::size_t end = path.size(); end != std::string_view::npos;
       end = end == 0 ? std::string_view::npos : path.rfind('/', end - 1)) {
    if (matches(path.substr(0, end), {}, no_captures)) return true;
  }
  return false;
}

bool PathPattern::selects_asset(std::string_view name) const {
  if (matches_path_or_parent(name)) return true;
  Captures no_captures;
  return text_.find_first_of("/\\") == std::string::npos &&
         matches(name.substr(name.rfind('/') + 1), {}, no_captures);
}

std::string PathPattern::path(const Captures& captures) const {
  const PathPattern substituted = substitute(captures);
  if (!substituted.is_plain()) {
    for (const std::string& name : substituted.captures_) {
      fail_usage("'" + text_ + "' has {" + name + "}, which is not captured.");
    }
    fail_usage("'" + text_ + "' has * or ?, but must be a single path.");
  }
  return substituted.expansions_[0].empty() ? std::string() : substituted.expansions_[0][0].text;
}

PathPattern PathPattern::substitute(const Captures& captures) const {
  if (captures.empty()) return *this;
  std::string text;
  for (std::size_t position = 0; position < text_.size();) {
    if (const std::size_t literal = escape_length(text_, position)) {
      text += text_.substr(position, literal);
      position += literal;
      continue;
    }
    const std::size_t end = text_[position] == '{' ? text_.find('}', position) : std::string::npos;
    const auto captured = end == std::string::npos
                              ? captures.end()
                              : captures.find(text_.substr(position + 1, end - position - 1));
    if (captured == captures.end()) {
      text += text_[position++];
      continue;
    }
    text += escape_pattern(captured->second);
    position = end + 1;
    // If the capture contains no folder, the slash after it is dropped.
    if (captured->second.empty() && position < text_.size() && text_[position] == '/') ++position;
  }
  return PathPattern(text);
}

bool PathPattern::has_open_ending() const {
  return std::any_of(expansions_.begin(), expansions_.end(), [](const Tokens& tokens) {
    return !tokens.empty() && tokens.back().kind != Kind::text;
  });
}

std::string escape_pattern(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    const bool is_special = std::string_view("*?{}").find(c) != std::string_view::npos;
    escaped += is_special ? std::string{'[', c, ']'} : std::string(1, c);
  }
  return escaped;
}

const FileLister::Folder& FileLister::list_folder(const std::string& path) {
  const auto [entry, added] = folders_.try_emplace(path);
  if (!added) return entry->second;
  const fs::path folder = path.empty() ? base_folder_ : os::join(base_folder_, path);
  std::error_code error;
  if (!fs::exists(folder, error)) return entry->second;
  for (fs::directory_iterator item(folder, error), end; !error && item != end;
       item.increment(error)) {
    refuse_if(++entries_ > kMaxEntries, "'" + folder.string() + "': more than " +
                                            std::to_string(kMaxEntries) +
                                            " files and folders lie below the patterns: start the "
                                            "patterns with a more specific folder.");
    std::error_code ignored_error;
    const std::string name = item->path().filename().string();
    if (item->is_directory(ignored_error)) {
      entry->second.folders.push_back(name);
    } else if (item->is_regular_file(ignored_error)) {
      entry->second.files.push_back(name);
    }
  }
  if (error) {
    // If the error were ignored, the folder's files would be skipped silently.
    throw Error(ErrorCode::input, "The folder '" + folder.string() + "' cannot be read (" +
                                      error.message() + "): check its permissions.");
  }
  std::sort(entry->second.files.begin(), entry->second.files.end());
  std::sort(entry->second.folders.begin(), entry->second.folders.end());
  return entry->second;
}

const std::vector<std::string>& FileLister::files_of(const std::string& folder) {
  std::error_code error;
  static const std::vector<std::string> no_names;
  if (!fs::is_directory(os::join(base_folder_, folder), error)) return no_names;
  return list_folder(folder).files;
}

void FileLister::walk(const std::string& folder, std::size_t depth, std::size_t max_depth,
                      const PathPattern& pattern, const Captures& known_captures,
                      std::vector<FoundFile>& found) {
  // The limit ends the search if a link to a parent folder makes the folders infinitely deep.
  refuse_if(depth > kMaxDepth, "'" + os::join(base_folder_, folder).string() + "' lies more than " +
                                   std::to_string(kMaxDepth) +
                                   " folders deep: check for a link to a parent folder.");
  const Folder& folder_entries = list_folder(folder);
  for (const std::string& name : folder_entries.files) {
    const std::string path =
        folder.empty() || folder.ends_with('/') ? folder + name : folder + "/" + name;
    Captures captures;
    if (!pattern.matches(path, known_captures, captures)) continue;
    refuse_if(found.size() >= kMaxFiles, "The pattern '" + pattern.text() + "' matches more than " +
                                             std::to_string(kMaxFiles) +
                                             " files, the limit of one job file.");
    found.push_back({path, std::move(captures)});
  }
  if (depth >= max_depth) return;
  for (const std::string& name : folder_entries.folders) {
    if (name.starts_with('.')) continue;
    walk(folder.empty() || folder.ends_with('/') ? folder + name : folder + "/" + name, depth + 1,
         max_depth, pattern, known_captures, found);
  }
}

std::vector<FileLister::FoundFile> FileLister::find(const PathPattern& given,
                                                    const Captures& known_captures) {
  const PathPattern pattern = given.substitute(known_captures);
  std::vector<FoundFile> found;
  for (const PathPattern::Tokens& tokens : pattern.expansions_) {
    // The search starts in the last folder before the first wildcard, and descends as deep as the pattern has levels.
    std::string literal_prefix;
    std::size_t position = 0;
    for (; position < tokens.size() && tokens[position].kind == PathPattern::Kind::text; ++position)
      literal_prefix += tokens[position].text;
    if (position == tokens.size()) {
      std::error_code error;
      if (fs::is_regular_file(os::join(base_folder_, literal_prefix), error))
        found.push_back({literal_prefix, known_captures});
      continue;
    }
    const std::size_t slash = literal_prefix.rfind('/');
    std::string folder = slash == std::string::npos ? "" : literal_prefix.substr(0, slash);
    // A drive's root needs its slash, since "C:" is the current folder of the drive.
    if (slash != std::string::npos && fs::path(folder) == fs::path(folder).root_name())
      folder += '/';
    std::size_t max_depth = 0;
    for (std::size_t i = 0; i < tokens.size(); ++i) {
      if (tokens[i].kind == PathPattern::Kind::any_folders ||
          tokens[i].kind == PathPattern::Kind::folder_capture) {
        max_depth = kMaxDepth + 1;
        break;
      }
      if (tokens[i].kind != PathPattern::Kind::text) continue;
      const std::string& text = tokens[i].text;
      const std::size_t from = i == 0 && slash != std::string::npos ? slash + 1 : 0;
      max_depth += static_cast<std::size_t>(
          std::count(text.begin() + static_cast<std::ptrdiff_t>(std::min(from, text.size())),
                     text.end(), '/'));
    }
    PathPattern expansion_pattern = pattern;
    expansion_pattern.expansions_ = {tokens};
    std::error_code error;
    if (!fs::is_directory(os::join(base_folder_, folder), error)) continue;
    walk(folder, 0, max_depth, expansion_pattern, known_captures, found);
  }
  std::sort(found.begin(), found.end(),
            [](const FoundFile& a, const FoundFile& b) { return a.path < b.path; });
  found.erase(std::unique(found.begin(), found.end(),
                          [](const FoundFile& a, const FoundFile& b) { return a.path == b.path; }),
              found.end());
  return found;
}

}  // namespace kiln
