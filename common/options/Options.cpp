#include "common/options/Options.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <utility>

#include "common/options/Completion.h"

namespace tessera {
namespace {

/// "PROGRAM: out of memory", made beforehand: there may be no memory for it then.
std::array<char, 128> outOfMemory{};
std::size_t outOfMemoryBytes = 0;

/// Whatever else ends a program without a word is a fault of ours, and leaves a core.
[[noreturn]] void endInWords() {
    try {
        if (const std::exception_ptr why = std::current_exception()) std::rethrow_exception(why);
    } catch (const std::bad_alloc&) {
        (void)!::write(STDERR_FILENO, outOfMemory.data(), outOfMemoryBytes);
        ::_exit(1);
    } catch (...) {
        __gnu_cxx::__verbose_terminate_handler();
    }
    std::abort();
}

CLI::Validator shown(CLI::Validator validator, ShowValues show) {
    return show == ShowValues::kInHelp ? validator : validator.description("");
}

}  // namespace

Option Option::typeName(const std::string& name) const {
    option_->type_name(name);
    return *this;
}

Option Option::oneOf(std::initializer_list<const char*> words, ShowValues show) const {
    return oneOf(std::vector<std::string>(words.begin(), words.end()), show);
}

Option Option::oneOf(const std::vector<std::string>& words, ShowValues show) const {
    option_->check(shown(CLI::IsMember(words), show));
    return *this;
}

Option Option::oneOf(std::initializer_list<int> numbers, ShowValues show) const {
    option_->check(shown(CLI::IsMember(std::vector<int>(numbers)), show));
    return *this;
}

Option Option::range(int least, int most, ShowValues show) const {
    option_->check(shown(CLI::Range(least, most), show));
    return *this;
}

Option Option::range(std::uint64_t least, std::uint64_t most, ShowValues show) const {
    option_->check(shown(CLI::Range(least, most), show));
    return *this;
}

Option Option::range(double least, double most, ShowValues show) const {
    option_->check(shown(CLI::Range(least, most), show));
    // No comparison with NaN holds, so the range alone lets it pass.
    return check([](const std::string& text) {
        return std::string(std::isnan(std::strtod(text.c_str(), nullptr)) ? "not a number" : "");
    });
}

Option Option::number() const {
    option_->check(shown(CLI::Number, ShowValues::kInErrorsAlone));
    return *this;
}

Option Option::check(std::function<std::string(const std::string&)> fault, const std::string& values) const {
    option_->check(std::move(fault), values);
    return *this;
}

Option Option::expected(int count) const {
    option_->expected(count);
    return *this;
}

Option Option::expected(int least, int most) const {
    option_->expected(least, most);
    return *this;
}

Option Option::oneEach() const {
    option_->allow_extra_args(false);
    return *this;
}

Option Option::delimiter(char between) const {
    option_->delimiter(between);
    return *this;
}

Option Option::required() const {
    option_->required();
    return *this;
}

Option Option::needs(const Option& other) const {
    option_->needs(other.option_);
    return *this;
}

Option Option::excludes(const Option& other) const {
    option_->excludes(other.option_);
    return *this;
}

Option Option::showDefault() const {
    option_->capture_default_str();
    return *this;
}

Option Option::hidden() const {
    option_->group("");
    return *this;
}

bool Option::given() const {
    return option_->count() > 0;
}

std::string Option::name() const {
    return option_->get_name();
}

struct Options::Impl {
    std::string program;
    CLI::App app;
};

Options::Options(const std::string& program, const std::string& description, const std::string& version)
    : impl_(new Impl{program, CLI::App(description, program)}) {
    if (!version.empty()) {
        impl_->app.set_version_flag("--version", version);
        if (program.find(' ') == std::string::npos) addCompletion(impl_->app);  // of a verb it is the program's
    }
    const auto end = fmt::format_to_n(outOfMemory.data(), outOfMemory.size(), "{}: out of memory\n", program);
    outOfMemoryBytes = std::min(end.size, outOfMemory.size());
    std::set_terminate(endInWords);
}

Options::~Options() = default;

Option Options::option(const std::string& names, std::string& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::option(const std::string& names, int& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::option(const std::string& names, unsigned& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::option(const std::string& names, std::uint64_t& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::option(const std::string& names, double& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::option(const std::string& names, std::vector<std::string>& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::option(const std::string& names, std::vector<int>& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::option(const std::string& names, std::vector<double>& target, const std::string& help) {
    return Option(impl_->app.add_option(names, target, help));
}

Option Options::flag(const std::string& names, bool& target, const std::string& help) {
    return Option(impl_->app.add_flag(names, target, help));
}

Expected<std::optional<std::string>> Options::read(const std::vector<std::string>& words) {
    try {
        std::vector<std::string> reversed(words.rbegin(), words.rend());  // as CLI11 wants them
        impl_->app.parse(std::move(reversed));
    } catch (const CLI::CallForHelp&) {
        return impl_->app.help();
    } catch (const CLI::CallForVersion& version) {
        return std::string(version.what()) + "\n";
    } catch (const CLI::ParseError& wrong) {
        return fail(ErrorCode::kUsage, wrong.what());
    }
    return std::nullopt;
}

std::optional<int> Options::parse(int argc, const char* const* argv) {
    std::vector<std::string> words;
    for (int i = 1; i < argc; ++i) words.emplace_back(argv[i]);
    const Expected<std::optional<std::string>> instead = read(words);
    if (!instead) {
        fmt::print(stderr, "{}: {}; see --help\n", impl_->program, instead.error().message);
        return exitCode(instead.error().code);
    }
    if (!*instead) return std::nullopt;
    fmt::print("{}", **instead);
    return 0;
}

}  // namespace tessera
