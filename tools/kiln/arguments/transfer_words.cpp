// The words of --transfer, before any file is read.
#include <algorithm>
#include <climits>
#include <filesystem>
#include <system_error>

#include "arguments/transfers.h"

namespace kiln::cli {
namespace {

namespace fs = std::filesystem;

constexpr Word<TextureKind> kTextureKinds[] = {
    {"linear", TextureKind::linear}, {"normal", TextureKind::normal}, {"srgb", TextureKind::srgb}};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool is_name(const std::string& text) {
  return !text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), [](char c) {
    return is_letter(c) || c == '_' || (c >= '0' && c <= '9');
  });
}

/// A name of a file's stem.
std::string name_of_file(const std::string& file) {
  std::string name = fs::path(file).stem().string();
  for (char& c : name) {
    if (!is_letter(c) && !(c >= '0' && c <= '9')) c = '_';
  }
  return is_name(name) ? name : "t_" + name;
}

/// Takes the part after the last colon off a text, where there is one.
std::optional<std::string> last_part(std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  std::string part = text.substr(colon + 1);
  text.resize(colon);
  return part;
}

/// No name that is too long is a file's; to ask for each of its parts would take the square of its length.
bool is_there(const std::string& file) {
  if (file.size() >= PATH_MAX) return false;
  std::error_code ignored;
  return fs::exists(file, ignored);
}

/// If there is no such file, but one before a colon: the words after it are wrong. \throws Error(usage)
void check_words(const std::string& text, const std::string& file) {
  if (is_there(file)) return;
  if (file.starts_with("mtl:")) {
    throw Error(ErrorCode::usage, "--transfer '" + text + "': '" +
                                      text.substr(text.rfind(':') + 1) +
                                      "' is no colour space, and pictures of materials keep their "
                                      "names. Give mtl:SLOT or mtl:SLOT:SPACE, where SPACE is "
                                      "srgb, linear or normal.");
  }
  for (std::string rest = file; last_part(rest);) {
    if (!is_there(rest)) continue;
    throw Error(ErrorCode::usage, "--transfer '" + text + "': '" +
                                      text.substr(text.rfind(':') + 1) +
                                      "' is no colour space. Give FILE, FILE:NAME or "
                                      "FILE:NAME:SPACE, where SPACE is srgb, linear or normal.");
  }
}

}  // namespace

TransferArgument parse_transfer(const std::string& text) {
  TransferArgument transfer;
  transfer.file = text;
  std::string rest = text;
  if (std::optional<std::string> part = last_part(rest)) {
    if (const TextureKind* const kind = Words(kTextureKinds).find(*part)) {
      transfer.kind = *kind;
      transfer.file = rest;
      part = last_part(rest);
    }
    if (part && is_name(*part)) {
      transfer.name = *part;
      transfer.file = rest;
    }
  }
  if (transfer.materials()) {
    if (!Words(kMaterialSlots).contains(transfer.name)) {
      throw Error(ErrorCode::usage,
                  "--transfer '" + text +
                      "': of materials it takes mtl:color, opacity, normals, roughness, metallic "
                      "or emission.");
    }
    return transfer;
  }
  check_words(text, transfer.file);
  if (transfer.name.empty()) transfer.name = name_of_file(transfer.file);
  return transfer;
}

std::vector<TransferArgument> parse_transfers(const BakeJob& arguments) {
  std::vector<TransferArgument> transfers;
  for (const std::string& text : arguments.transfers) transfers.push_back(parse_transfer(text));
  return transfers;
}

}  // namespace kiln::cli
