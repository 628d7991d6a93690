// The command line: commands, their options and what these accept. The library behind it (CLI11, in
// command_line.cpp alone) has headers that take compilers seconds for each file that includes them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace kiln::cli {

/// What was wrong with the words of a command line.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What a value is checked by.
class Check {
 public:
  /// \param function  returns what is wrong with a value; empty: nothing. It may put another in its place
  /// \param words  what help says of values
  Check(const std::function<std::string(std::string&)>& function, std::string_view words);

  /// What is wrong with a value; empty: nothing.
  std::string operator()(std::string& value) const;
  /// What help says of values.
  std::string words() const;

 private:
  friend class Option;
  friend Check range(double, double);
  friend Check range(int, int);
  friend Check range(unsigned, unsigned);
  friend Check positive_number();
  explicit Check(const CLI::Validator& validator);

  std::shared_ptr<const CLI::Validator> validator_;
};

/// Numbers of a range, whole ones where its ends are.
Check range(double low, double high);
Check range(int low, int high);
Check range(unsigned low, unsigned high);
/// Numbers above 0.
Check positive_number();
/// Names, capital letters or not, blanks around them or not. The value becomes the name.
Check one_of(const std::vector<std::string>& names);

/// An option, flag or position of a command. Its command owns it.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  /// One more check of values.
  Option* check(const Check& check);
  /// The heading of help that it stands below.
  Option* group(std::string_view name);
  /// Help says the variable's value, as it is now.
  Option* capture_default_str();
  /// Parsing fails without it.
  Option* required();
  /// True if it takes the words that follow its first value, too.
  Option* allow_extra_args(bool allow);
  /// What separates several values of one word.
  Option* delimiter(char between);
  /// Parsing fails where it is given without the other.
  Option* needs(const Option* other);
  /// Parsing fails where it is given with the other.
  Option* excludes(const Option* other);
  /// What help says of values.
  Option* type_name(std::string_view words);
  /// Called with each value.
  Option* each(const std::function<void(std::string)>& function);

  /// As help says it: "--size", or "HIGH" of a position.
  std::string get_name() const;
  /// Its names without dashes.
  const std::vector<std::string>& get_lnames() const;
  /// What help says of it.
  std::string get_help() const;
  /// How often it was given.
  std::size_t count() const;
  /// The values that were given.
  const std::vector<std::string>& results() const;
  /// True if it is given without a value.
  bool is_flag() const;

 private:
  friend class Command;
  CLI::Option* option_;
};

/// A command, or the program with its commands.
class Command {
 public:
  /// The program, which needs one of its commands. \param footer  what help ends with
  Command(std::string_view description, std::string_view name, const std::string& version,
          const std::string& footer);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// Adds an option of a name that starts with dashes, or a position. The value's type: text, number, list of
  /// texts, or an optional number. \param value  outlives the parsing
  template <typename Value>
  Option* add_option(std::string_view name, Value& value, std::string_view help);
  /// Adds a flag.
  Option* add_flag(std::string_view name, bool& value, std::string_view help);
  /// Adds a flag that may have a value after =; NAME{VALUE}: what it stands for alone.
  Option* add_flag(std::string_view name, std::string& value, std::string_view help);
  /// Adds an option whose values are only checked.
  Option* add_checked_option(std::string_view name, const Check& check, std::string_view help);
  void remove_option(Option* option);

  std::string get_name() const;
  /// With --help.
  std::vector<Option*> get_options();
  std::vector<const Option*> get_options() const;
  /// nullptr: there is none of that name.
  const Option* find_option(const std::string& name) const;

  /// Of the program: adds a command.
  Command* add_command(std::string_view name, std::string_view description);
  /// Of the program: all commands.
  std::vector<Command*> commands() const;
  /// Of the program: the command that was given; nullptr: none.
  Command* chosen() const;
  /// Of the program: sets variables. \returns whether a command is to run: not after --help and --version,
  /// which it answers. \throws UsageError
  bool parse(std::vector<std::string> words);
  /// Words that parsing did not understand.
  std::vector<std::string> not_understood() const;

 private:
  explicit Command(CLI::App* app);
  Option* wrapped(CLI::Option* option) const;

  std::unique_ptr<CLI::App> owned_;  ///< Of the program
  CLI::App* app_;
  std::vector<std::unique_ptr<Command>> commands_;
  mutable std::vector<std::unique_ptr<Option>> options_;
};

}  // namespace kiln::cli
