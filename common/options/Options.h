/// The options of a program's command line, and what its --help says of them.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Error.h"

namespace CLI {
class Option;
}

namespace tessera {

/// Whether --help shows which values an option takes, behind the name of its type, or only the message that refuses
/// one.
enum class ShowValues { kInHelp, kInErrorsAlone };

/// One option of an `Options`, valid as long as those are. Each call returns the same option, so that they can be
/// chained.
class Option {
public:
    /// What --help shows for the value.
    Option typeName(const std::string& name) const;
    /// Each value has to be one of these.
    Option oneOf(std::initializer_list<const char*> words, ShowValues show = ShowValues::kInHelp) const;
    Option oneOf(const std::vector<std::string>& words, ShowValues show = ShowValues::kInHelp) const;
    Option oneOf(std::initializer_list<int> numbers, ShowValues show = ShowValues::kInHelp) const;
    /// Each value has to be a number from `least` to `most`, both included.
    Option range(int least, int most, ShowValues show = ShowValues::kInHelp) const;
    Option range(std::uint64_t least, std::uint64_t most, ShowValues show = ShowValues::kInHelp) const;
    Option range(double least, double most, ShowValues show = ShowValues::kInHelp) const;
    /// Each value has to be a number; for those that are passed on as words.
    Option number() const;
    /// `fault` says what is wrong with a value, or nothing; --help shows `values` behind the name of the type.
    Option check(std::function<std::string(const std::string&)> fault, const std::string& values = {}) const;
    /// So many values behind the name.
    Option expected(int count) const;
    Option expected(int least, int most) const;
    /// One value behind each mention of the name; what follows it is not its own. For lists.
    Option oneEach() const;
    /// Parts a value at these, into several. For lists.
    Option delimiter(char between) const;
    Option required() const;
    Option needs(const Option& other) const;
    Option excludes(const Option& other) const;
    /// --help shows the value that the target has now.
    Option showDefault() const;
    /// --help does not show it.
    Option hidden() const;

    /// Whether the command line had it.
    [[nodiscard]] bool given() const;
    /// As messages call it: "--name", or the name of a place.
    [[nodiscard]] std::string name() const;

private:
    friend class Options;
    explicit Option(CLI::Option* option) : option_(option) {}
    CLI::Option* option_;
};

/// Reads a command line into a program's own variables. Made once, read once, by one thread.
///
/// `names` are "--long", "-s,--long", or without dashes the name of what is known by its place. Targets outlive the
/// Options. A name that is there already or cannot be one is our own bug, and ends the program.
class Options {
public:
    /// --help and, with a `version` to print, --version are there from the beginning.
    /// A program that runs out of memory from then on says so, and ends with 1.
    Options(const std::string& program, const std::string& description, const std::string& version = {});
    ~Options();
    Options(const Options&) = delete;
    Options& operator=(const Options&) = delete;

    /// A target keeps its value where the option is not given. A list takes one value or more, a number or text exactly
    /// one, once.
    Option option(const std::string& names, std::string& target, const std::string& help = {});
    Option option(const std::string& names, int& target, const std::string& help = {});
    Option option(const std::string& names, unsigned& target, const std::string& help = {});
    Option option(const std::string& names, std::uint64_t& target, const std::string& help = {});
    Option option(const std::string& names, double& target, const std::string& help = {});
    Option option(const std::string& names, std::vector<std::string>& target, const std::string& help = {});
    Option option(const std::string& names, std::vector<int>& target, const std::string& help = {});
    Option option(const std::string& names, std::vector<double>& target, const std::string& help = {});
    /// True where it is given, however often.
    Option flag(const std::string& names, bool& target, const std::string& help = {});

    /// The words behind the program's name. Returns what there is to print instead of running, the text of --help or
    /// --version; none: run. Errors: kUsage, what is wrong with them, with the option's name.
    [[nodiscard]] Expected<std::optional<std::string>> read(const std::vector<std::string>& words);
    /// Reads main's arguments, prints that text, or on stderr "PROGRAM: what is wrong; see --help". Returns the exit
    /// code of a program that has nothing more to do; none: run.
    [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
