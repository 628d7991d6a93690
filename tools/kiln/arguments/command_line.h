// Defines commands and their options. CLI11 assigns words to options; the rows of the option table parse and check the
// values. Only command_line.cpp includes CLI11, whose headers would add seconds to the compile time of every other
// file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "options/values.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace kiln::cli {

/// A syntax error in a command line.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An option, flag or positional argument. Its command owns it.
class Option {
 public:
  using Words = OptionWords;
  /// Callback that receives the given values, at least one. \throws UsageError, Error(usage)
  using ValueCallback = std::function<void(const Words&)>;

  /// Sets the heading under which help lists the option.
  Option* group(std::string_view name);
  /// Sets the default value that help shows.
  Option* default_text(const std::string& text);
  /// Makes the option required: parsing fails without it.
  Option* required();
  /// Sets the names that the error about a missing value lists.
  Option* choices(std::vector<std::string> names);
  /// Allows several occurrences; a positional argument then takes several words.
  Option* repeats();
  /// Sets the separator of several values in one word.
  Option* delimiter(char between);
  /// Requires another option: parsing fails if only this one is given.
  Option* needs(const Option* other);
  /// Excludes another option: parsing fails if both are given.
  Option* excludes(Option* other);
  /// Sets the placeholder for the value in help.
  Option* type_name(std::string_view words);

  /// Returns the option's name in help: "--size", or "HIGH" for a positional argument.
  std::string get_name() const;
  /// Returns the option's names without dashes.
  const std::vector<std::string>& get_lnames() const;
  /// Returns the option's help text.
  std::string get_help() const;
  /// Returns how often the option occurs on the command line.
  std::size_t count() const;
  /// True if the option takes no value.
  bool is_flag() const;

 private:
  friend class Command;
  void take(const Words& words) const;

  CLI::Option* option_ = nullptr;
  ValueCallback receive_values_;
  std::vector<std::string> value_names_;
  std::vector<const Option*> needs_, excludes_;
  bool repeats_ = false, required_ = false;
};

/// A command with its options, or the program with its commands.
class Command {
 public:
  /// Creates the program, which requires one of its commands. \param footer  last lines of help
  Command(std::string_view description, std::string_view name, const std::string& version,
          const std::string& footer);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// Adds an option if the name starts with dashes, else a positional argument.
  /// \param take  receives the values
  Option* add_option(std::string_view name, Option::ValueCallback take, std::string_view help);
  /// Adds a flag with an optional value after `=`. Without a value, `take` receives "true".
  Option* add_flag(std::string_view name, Option::ValueCallback take, std::string_view help);
  /// Adds a flag that prints a text and exits.
  void add_text_flag(std::string_view name, std::function<std::string()> text,
                     const std::string& help);

  std::string get_name() const;
  /// Returns all options except --help.
  std::vector<const Option*> get_options() const;
  /// Finds the option with this name; null if there is none.
  const Option* find_option(std::string_view name) const;

  /// Adds a command to the program.
  Command* add_command(std::string_view name, std::string_view description);
  /// Returns all commands of the program.
  std::vector<Command*> commands() const;
  /// Returns the command that the user gave; null if there was none.
  Command* given_command() const;
  /// Parses the program's words, and passes values to the options. \returns false if nothing remains to be run, as
  /// after --help and --version
  /// \throws UsageError
  bool parse(std::vector<std::string> words);
  /// Returns the words that neither an option nor a command accepted.
  std::vector<std::string> unaccepted_words() const;

 private:
  explicit Command(CLI::App* app);
  Option* add(std::string_view name, Option::ValueCallback take, std::string_view help);
  std::string missing_options_message() const;
  void join_choices(std::vector<std::string>& words) const;

  std::unique_ptr<CLI::App> owned_app_;  ///< The parser that the program owns; null in commands
  CLI::App* app_;
  std::vector<std::unique_ptr<Command>> commands_;
  std::vector<std::unique_ptr<Option>> options_;
};

}  // namespace kiln::cli
