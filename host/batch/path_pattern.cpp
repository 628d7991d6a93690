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
// Maximum number of steps of one match, including those of backtracking
constexpr std::size_t kMaxMatchSteps = 200000;
// Maximum number of folder entries that a search visits
constexpr std::size_t kMaxEntries = 2000000;
constexpr std::size_t kMaxFiles = 200000;  // Maximum number of files that match
constexpr std::size_t kMaxDepth = 64;      // Maximum depth of nested folders

/// Length in bytes of `[*]` and similar escapes at a position; 0 if there is none.
std::size_t literal_at(std::string_view text, std::size_t at) {
  if (text.size() < at + 3 || text[at] != '[' || text[at + 2] != ']') return 0;
  return std::string_view("*?{}").find(text[at + 1]) == std::string_view::npos ? 0 : 3;
}

std::size_t end_of_braces(std::string_view text, std::size_t at) {
  const std::size_t end = text.find('}', at);
  refuse_if(end == std::string_view::npos,
            "The pattern '" + std::string(text) +
                "' has { without }: to match a brace itself, write [{].");
  const std::size_t inner = text.find('{', at + 1);
  refuse_if(inner < end,
            "The pattern '" + std::string(text) + "' has nested braces, which are not supported.");
  return end;
}

/// Expands `{a,b}` to one pattern for each combination of alternatives.
void expand(std::string_view text, std::size_t from, std::vector<std::string>& all) {
  for (std::size_t at = from; at < text.size(); ++at) {
    if (const std::size_t literal = literal_at(text, at)) {
      at += literal - 1;
      continue;
    }
    if (text[at] != '{') continue;
    const std::size_t end = end_of_braces(text, at);
    const std::string_view inside = text.substr(at + 1, end - at - 1);
    if (inside.find(',') == std::string_view::npos) {
      at = end;
      continue;
    }
    std::size_t begin = 0;
    for (;;) {
      const std::size_t comma = std::min(inside.find(',', begin), inside.size());
      std::string one(text.substr(0, at));
      one += inside.substr(begin, comma - begin);
      const std::size_t next = one.size();
      one += text.substr(end + 1);
      expand(one, next, all);
      if (comma == inside.size()) return;
      begin = comma + 1;
    }
  }
  refuse_if(all.size() >= kMaxExpansions, "The pattern '" + std::string(text) + "' has more than " +
                                              std::to_string(kMaxExpansions) +
                                              " alternatives: use *.");
  all.emplace_back(text);
}

bool is_capture_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  });
}

std::string with_slashes(std::string_view text) {
  std::string path(text);
  std::replace(path.begin(), path.end(), '\\', '/');
  while (path.starts_with("./")) path.erase(0, 2);
  return path;
}

}  // namespace

PathPattern::Tokens PathPattern::tokens_of(std::string_view text) {
  Tokens tokens;
  const auto add_text = [&](std::string_view more) {
    if (tokens.empty() || tokens.back().kind != Kind::text) tokens.push_back({Kind::text, {}});
    tokens.back().text += more;
  };
  for (std::size_t at = 0; at < text.size();) {
    if (const std::size_t literal = literal_at(text, at)) {
      add_text(text.substr(at + 1, 1));
      at += literal;
    } else if (text[at] == '{') {
      const std::size_t end = end_of_braces(text, at);
      const std::string name(text.substr(at + 1, end - at - 1));
      refuse_if(!is_capture_name(name),
                "The pattern '" + std::string(text) + "' has {" + name +
                    "}: the name of a capture consists of letters, digits and _.");
      const bool folders = name == "dir" && (end + 1 == text.size() || text[end + 1] == '/') &&
                           (at == 0 || text[at - 1] == '/');
      tokens.push_back({folders ? Kind::folder_capture : Kind::capture, name});
      at = end + 1;
      // The slash belongs to the token, since the token may match no folder, and then no slash follows.
      if (folders && at < text.size()) ++at;
    } else if (text.substr(at, 3) == "**/" && (at == 0 || text[at - 1] == '/')) {
      tokens.push_back({Kind::folders, {}});
      at += 3;
    } else if (text[at] == '*') {
      while (at < text.size() && text[at] == '*') ++at;
      tokens.push_back({Kind::any, {}});
    } else if (text[at] == '?') {
      tokens.push_back({Kind::one, {}});
      ++at;
    } else {
      add_text(text.substr(at, 1));
      ++at;
    }
  }
  return tokens;
}

PathPattern::PathPattern(std::string_view text) : text_(with_slashes(text)) {
  refuse_if(text_.find('\0') != std::string::npos,
            "A pattern contains a null byte, which no path can contain.");
  std::vector<std::string> expanded;
  expand(text_, 0, expanded);
  for (const std::string& alternative : expanded) {
    expansions_.push_back(tokens_of(alternative));
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

/// The state of one match by backtracking, which tries the longest texts first.
struct PathPattern::Matching {
  const Tokens& tokens;
  std::string_view path;
  Captures captures;
  std::size_t steps = 0;

  bool from(std::size_t token, std::size_t at) {
    refuse_if(++steps > kMaxMatchSteps,
              "A pattern matches '" + std::string(path) + "' in too many ways: use fewer *.");
    if (token == tokens.size()) return at == path.size();
    const Token& one = tokens[token];
    switch (one.kind) {
      case Kind::text:
        return path.substr(at, one.text.size()) == one.text &&
               from(token + 1, at + one.text.size());
      case Kind::one:
        return at < path.size() && path[at] != '/' && from(token + 1, at + 1);
      case Kind::folders:
        return try_folders(token, at, nullptr);
      case Kind::folder_capture:
        return try_folders(token, at, &one.text);
      case Kind::any:
      case Kind::capture:
        break;
    }
    const bool capture = one.kind == Kind::capture;
    if (capture && captures.count(one.text) != 0) {
      const std::string captured_text = captures[one.text];
      return path.substr(at, captured_text.size()) == captured_text &&
             from(token + 1, at + captured_text.size());
    }
    const std::size_t end = std::min(path.find('/', at), path.size());
    // Neither wildcards nor captures match the dot at the start of a hidden name.
    if (at < path.size() && path[at] == '.' && (at == 0 || path[at - 1] == '/')) return false;
    for (std::size_t match_end = end + 1; match_end-- > at + (capture ? 1 : 0);) {
      if (capture) captures[one.text] = std::string(path.substr(at, match_end - at));
      if (from(token + 1, match_end)) return true;
    }
    if (capture) captures.erase(one.text);
    return false;
  }

  /// Matches as many folders as possible, with their slashes; at the end of a pattern, the last folder has no slash.
  bool try_folders(std::size_t token, std::size_t at, const std::string* name) {
    const bool last = token + 1 == tokens.size();
    const auto try_with = [&](std::string_view folders, std::size_t next) {
      if (name == nullptr) return from(token + 1, next);
      const auto captured_folders = captures.find(*name);
      if (captured_folders != captures.end())
        return captured_folders->second == folders && from(token + 1, next);
      captures[*name] = std::string(folders);
      if (from(token + 1, next)) return true;
      captures.erase(*name);
      return false;
    };
    if (last) return name == nullptr ? at == path.size() : try_with(path.substr(at), path.size());
    for (std::size_t slash = path.rfind('/'); slash != std::string_view::npos && slash > at;
         slash = slash == 0 ? std::string_view::npos : path.rfind('/', slash - 1)) {
      if (try_with(path.substr(at, slash - at), slash + 1)) return true;
    }
    return try_with({}, at);
  }
};

bool PathPattern::matches(std::string_view path, const Captures& known, Captures& captured) const {
  for (const Tokens& tokens : expansions_) {
    Matching match{tokens, path, known};
    if (match.from(0, 0)) {
      captured = std::move(match.captures);
      return true;
    }
  }
  return false;
}

bool PathPattern::covers(std::string_view path) const {
  Captures no_captures;
  for (std::size_t end = path.size(); end != std::string_view::npos;
       end = end == 0 ? std::string_view::npos : path.rfind('/', end - 1)) {
    if (matches(path.substr(0, end), {}, no_captures)) return true;
  }
  return false;
}

bool PathPattern::selects(std::string_view name) const {
  if (covers(name)) return true;
  Captures no_captures;
  return text_.find_first_of("/\\") == std::string::npos &&
         matches(name.substr(name.rfind('/') + 1), {}, no_captures);
}

std::string PathPattern::path(const Captures& captures) const {
  const PathPattern filled = with(captures);
  if (!filled.is_plain()) {
    for (const std::string& name : filled.captures_) {
      fail_usage("'" + text_ + "' has {" + name + "}, which is not captured.");
    }
    fail_usage("'" + text_ + "' has * or ?, but must be a single path.");
  }
  return filled.expansions_[0].empty() ? std::string() : filled.expansions_[0][0].text;
}

PathPattern PathPattern::with(const Captures& captures) const {
  if (captures.empty()) return *this;
  std::string text;
  for (std::size_t at = 0; at < text_.size();) {
    if (const std::size_t literal = literal_at(text_, at)) {
      text += text_.substr(at, literal);
      at += literal;
      continue;
    }
    const std::size_t end = text_[at] == '{' ? text_.find('}', at) : std::string::npos;
    const auto captured = end == std::string::npos
                              ? captures.end()
                              : captures.find(text_.substr(at + 1, end - at - 1));
    if (captured == captures.end()) {
      text += text_[at++];
      continue;
    }
    text += escape_pattern(captured->second);
    at = end + 1;
    // A capture of no folders is followed by no slash.
    if (captured->second.empty() && at < text_.size() && text_[at] == '/') ++at;
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
  const fs::path folder = path.empty() ? base_ : os::join(base_, path);
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
    // Ignoring the error would skip the folder's files silently.
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
  if (!fs::is_directory(os::join(base_, folder), error)) return no_names;
  return list_folder(folder).files;
}

void FileLister::walk(const std::string& folder, std::size_t depth, std::size_t deepest,
                      const PathPattern& pattern, const Captures& known,
                      std::vector<Found>& found) {
  // A link to a parent folder would recurse without end.
  refuse_if(depth > kMaxDepth, "'" + os::join(base_, folder).string() + "' lies more than " +
                                   std::to_string(kMaxDepth) +
                                   " folders deep: check for a link to a parent folder.");
  const Folder& folder_entries = list_folder(folder);
  for (const std::string& name : folder_entries.files) {
    const std::string path =
        folder.empty() || folder.ends_with('/') ? folder + name : folder + "/" + name;
    Captures captures;
    if (!pattern.matches(path, known, captures)) continue;
    refuse_if(found.size() >= kMaxFiles, "The pattern '" + pattern.text() + "' matches more than " +
                                             std::to_string(kMaxFiles) +
                                             " files, the limit of one job file.");
    found.push_back({path, std::move(captures)});
  }
  if (depth >= deepest) return;
  for (const std::string& name : folder_entries.folders) {
    if (name.starts_with('.')) continue;
    walk(folder.empty() || folder.ends_with('/') ? folder + name : folder + "/" + name, depth + 1,
         deepest, pattern, known, found);
  }
}

std::vector<FileLister::Found> FileLister::find(const PathPattern& given, const Captures& known) {
  const PathPattern pattern = given.with(known);
  std::vector<Found> found;
  for (const PathPattern::Tokens& tokens : pattern.expansions_) {
    // The search starts in the last folder before the first wildcard, and descends as deep as the pattern has levels.
    std::string fixed;
    std::size_t at = 0;
    for (; at < tokens.size() && tokens[at].kind == PathPattern::Kind::text; ++at)
      fixed += tokens[at].text;
    if (at == tokens.size()) {
      std::error_code error;
      if (fs::is_regular_file(os::join(base_, fixed), error)) found.push_back({fixed, known});
      continue;
    }
    const std::size_t slash = fixed.rfind('/');
    std::string folder = slash == std::string::npos ? "" : fixed.substr(0, slash);
    // A root needs its slash: "C:" is the current folder of a drive.
    if (slash != std::string::npos && fs::path(folder) == fs::path(folder).root_name())
      folder += '/';
    std::size_t deepest = 0;
    for (std::size_t i = 0; i < tokens.size(); ++i) {
      if (tokens[i].kind == PathPattern::Kind::folders ||
          tokens[i].kind == PathPattern::Kind::folder_capture) {
        deepest = kMaxDepth + 1;
        break;
      }
      if (tokens[i].kind != PathPattern::Kind::text) continue;
      const std::string& text = tokens[i].text;
      const std::size_t from = i == 0 && slash != std::string::npos ? slash + 1 : 0;
      deepest += static_cast<std::size_t>(
          std::count(text.begin() + static_cast<std::ptrdiff_t>(std::min(from, text.size())),
                     text.end(), '/'));
    }
    PathPattern one = pattern;
    one.expansions_ = {tokens};
    std::error_code error;
    if (!fs::is_directory(os::join(base_, folder), error)) continue;
    walk(folder, 0, deepest, one, known, found);
  }
  std::sort(found.begin(), found.end(),
            [](const Found& a, const Found& b) { return a.path < b.path; });
  found.erase(std::unique(found.begin(), found.end(),
                          [](const Found& a, const Found& b) { return a.path == b.path; }),
              found.end());
  return found;
}

}  // namespace kiln
