/// Command lines, read and refused.
#include "common/options/Options.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <exception>
#include <limits>
#include <new>
#include <stdexcept>

#include "common/base/Error.h"

namespace tessera {
namespace {

using Words = std::vector<std::string>;

/// A program with an option of each type.
struct Program {
    std::string text = "unset";
    int whole = 7;
    unsigned natural = 7;
    std::uint64_t large = 7;
    double number = 7;
    std::vector<std::string> texts;
    std::vector<int> wholes;
    std::vector<double> numbers;
    bool yes = false;
    Options options{"tessera-x", "Does a thing.", "tessera-x 1"};
    Option textOption = options.option("--text", text, "A text").typeName("T");
    Option wholeOption = options.option("--whole", whole);
    Option naturalOption = options.option("--natural", natural);
    Option largeOption = options.option("--large", large);
    Option numberOption = options.option("--number", number);
    Option textsOption = options.option("--texts", texts);
    Option wholesOption = options.option("--wholes", wholes);
    Option numbersOption = options.option("--numbers", numbers);
    Option yesOption = options.flag("-y,--yes", yes);

    /// What is wrong with the words; empty: nothing.
    std::string fault(const Words& words) {
        const Expected<std::optional<std::string>> read = options.read(words);
        if (read) return {};
        EXPECT_EQ(read.error().code, ErrorCode::kUsage);
        return read.error().message;
    }
};

std::string faultOf(const Words& words) {
    return Program().fault(words);
}

TEST(Options, KeepWhatTargetsHadWhereNothingIsGiven) {
    Program program;
    const Expected<std::optional<std::string>> read = program.options.read({});
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, std::nullopt);
    EXPECT_EQ(program.text, "unset");
    EXPECT_EQ(program.large, 7u);
    EXPECT_FALSE(program.yes);
    EXPECT_FALSE(program.textOption.given());
}

TEST(Options, ReadEachType) {
    Program program;
    ASSERT_EQ(
        program.fault(
            {"--text",    "a b",    "--whole", "-3",   "--natural", "4000000000", "--large", "18446744073709551615",
             "--number",  "2.5e-3", "--texts", "a",    "b",         "--wholes",   "1",       "-2",
             "--numbers", "1",      ".5",      "--yes"}),
        "");
    EXPECT_EQ(program.text, "a b");
    EXPECT_EQ(program.whole, -3);
    EXPECT_EQ(program.natural, 4'000'000'000u);
    EXPECT_EQ(program.large, std::numeric_limits<std::uint64_t>::max());
    EXPECT_EQ(program.number, 2.5e-3);
    EXPECT_EQ(program.texts, (Words{"a", "b"}));
    EXPECT_EQ(program.wholes, (std::vector<int>{1, -2}));
    EXPECT_EQ(program.numbers, (std::vector<double>{1, 0.5}));
    EXPECT_TRUE(program.yes);
    EXPECT_TRUE(program.textOption.given());
    EXPECT_EQ(program.textOption.name(), "--text");
}

TEST(Options, ReadValuesBehindAnEqualsSignAndShortNames) {
    Program program;
    ASSERT_EQ(program.fault({"--text=a=b", "--whole=1", "-y"}), "");
    EXPECT_EQ(program.text, "a=b");
    EXPECT_EQ(program.whole, 1);
    EXPECT_TRUE(program.yes);
}

TEST(Options, RefuseWhatIsNotOfTheirType) {
    EXPECT_EQ(faultOf({"--whole", "1.5"}), "Could not convert: --whole = 1.5");
    EXPECT_EQ(faultOf({"--whole", "x"}), "Could not convert: --whole = x");
    EXPECT_EQ(faultOf({"--natural", "-1"}), "Could not convert: --natural = -1");
    EXPECT_EQ(faultOf({"--large", "1e3"}), "Could not convert: --large = 1e3");
    EXPECT_EQ(faultOf({"--number", "1,5"}), "Could not convert: --number = 1,5");
    EXPECT_EQ(faultOf({"--numbers", "1", "x"}), "Could not convert: --numbers = 1,x");
    EXPECT_EQ(faultOf({"--wholes", "1", "2.5"}), "Could not convert: --wholes = 1,2.5");
    EXPECT_EQ(faultOf({"--yes=perhaps"}), "Could not convert: --yes = perhaps");
}

TEST(Options, RefuseWhatTheyDoNotKnow) {
    EXPECT_EQ(faultOf({"--no-such"}), "The following argument was not expected: --no-such");
    EXPECT_EQ(faultOf({"place"}), "The following argument was not expected: place");
}

TEST(Options, RefuseAValueThatIsMissingOrGivenTwice) {
    EXPECT_EQ(faultOf({"--text"}), "--text: 1 required T missing");
    EXPECT_EQ(faultOf({"--text", "a", "--text", "b"}), "--text: At Most 1 required but received 2");
    EXPECT_EQ(faultOf({"--text", "a", "b"}), "The following argument was not expected: b");
}

TEST(Options, TakeAFlagTwiceAndAListInParts) {
    Program program;
    ASSERT_EQ(program.fault({"--yes", "--texts", "a", "--yes", "--texts", "b"}), "");
    EXPECT_TRUE(program.yes);
    EXPECT_EQ(program.texts, (Words{"a", "b"}));
}

// Who wants neither an empty text nor 0 for an empty number says so with a check or a range.
TEST(Options, TakeAnEmptyValue) {
    Program program;
    ASSERT_EQ(program.fault({"--text", "", "--texts", "", "--number", "", "--whole", ""}), "");
    EXPECT_EQ(program.number, 0);
    EXPECT_EQ(program.whole, 0);
    EXPECT_EQ(program.text, "");
    EXPECT_EQ(program.texts, (Words{""}));
    EXPECT_TRUE(program.textOption.given());
}

TEST(Options, HoldValuesToWhatIsAllowed) {
    const auto fault = [](const Words& words) {
        Program program;
        program.textOption.oneOf({"y", "z"});
        program.wholeOption.oneOf({1, 4});
        program.naturalOption.range(1, 256);
        program.largeOption.range(std::uint64_t{1}, std::numeric_limits<std::uint64_t>::max());
        program.numberOption.range(0.0, 1000.0).check([](const std::string& text) {
            return text == "13" ? "unlucky" : "";
        });
        program.textsOption.number();
        return program.fault(words);
    };
    EXPECT_EQ(
        fault({"--text", "z", "--whole", "4", "--natural", "256", "--large", "1", "--number", "0.5", "--texts", "1e3"}),
        "");
    EXPECT_EQ(fault({"--text", "x"}), "--text: x not in {y,z}");
    EXPECT_EQ(fault({"--text", ""}), "--text:  not in {y,z}");
    EXPECT_EQ(fault({"--whole", "2"}), "--whole: 2 not in {1,4}");
    EXPECT_EQ(fault({"--natural", "0"}), "--natural: Value 0 not in range 1 to 256");
    EXPECT_EQ(fault({"--natural", ""}), "--natural: Value  not in range 1 to 256");
    EXPECT_EQ(fault({"--large", "0"}), "--large: Value 0 not in range 1 to 18446744073709551615");
    EXPECT_EQ(fault({"--number", "1001"}), "--number: Value 1001 not in range 0.000000 to 1000.000000");
    for (const char* none : {"nan", "-nan", "NaN(7)"}) EXPECT_NE(fault({"--number", none}), "") << none;
    EXPECT_EQ(fault({"--number", "13"}), "--number: unlucky");
    EXPECT_EQ(fault({"--texts", "x"}), "--texts: Failed parsing x as a FLOAT");
}

TEST(Options, CountTheirValues) {
    const auto fault = [](const Words& words) {
        Program program;
        program.numbersOption.expected(3);
        program.textsOption.expected(0, 2);
        return program.fault(words);
    };
    EXPECT_EQ(fault({"--numbers", "1", "2", "3"}), "");
    EXPECT_EQ(fault({"--texts"}), "");
    EXPECT_EQ(fault({"--numbers", "1", "2"}), "--numbers: At least 3 required but received 2");
    EXPECT_EQ(fault({"--texts", "a", "b", "c"}), "--texts: At Most 2 required but received 3");
}

TEST(Options, TakeAListApart) {
    Program program;
    std::vector<std::string> places;
    program.options.option("places", places);
    program.textsOption.delimiter(',').oneEach();
    ASSERT_EQ(program.fault({"--texts", "a,b", "c", "--texts", "d"}), "");
    EXPECT_EQ(program.texts, (Words{"a", "b", "d"}));
    EXPECT_EQ(places, (Words{"c"}));
}

TEST(Options, StandForAndAgainstEachOther) {
    const auto fault = [](const Words& words) {
        Program program;
        program.wholeOption.needs(program.yesOption);
        program.numberOption.excludes(program.yesOption);
        program.textOption.required();
        return program.fault(words);
    };
    EXPECT_EQ(fault({"--text", "a", "--whole", "1", "--yes"}), "");
    EXPECT_EQ(fault({"--text", "a", "--whole", "1"}), "--whole requires --yes");
    EXPECT_EQ(fault({"--text", "a", "--number", "1", "--yes"}), "--number excludes --yes");
    EXPECT_EQ(fault({"--yes"}), "--text is required");
}

TEST(Options, SayWhatThereIs) {
    std::string file, up = "y", secret, kind;
    int threads = 1;
    Options options("tessera-x", "Does a thing,\nand another.", "tessera-x 1");
    options.option("file", file, "To read").typeName("FILE").required();
    options.option("--up", up, "Which axis is up")
        .typeName("y|z")
        .oneOf({"y", "z"}, ShowValues::kInErrorsAlone)
        .showDefault();
    options.option("--threads", threads, "How many").typeName("N").range(1, 256);
    options.option("--kind", kind, "Of the thing").check([](const std::string&) { return std::string(); }, "good");
    options.option("--secret", secret).hidden();
    const Expected<std::optional<std::string>> read = options.read({"--help"});
    ASSERT_TRUE(read);
    ASSERT_TRUE(*read);
    EXPECT_EQ(**read,
              "Does a thing,\nand another.\n"
              "Usage: tessera-x [OPTIONS] file\n"
              "\n"
              "Positionals:\n"
              "  file FILE REQUIRED          To read\n"
              "\n"
              "Options:\n"
              "  -h,--help                   Print this help message and exit\n"
              "  --version                   Display program version information and exit\n"
              "  --completion bash|zsh|fish  Print the script by which a shell completes\n"
              "                              these words\n"
              "  --up y|z=y                  Which axis is up\n"
              "  --threads N:INT in [1 - 256]\n"
              "                              How many\n"
              "  --kind TEXT:good            Of the thing\n"
              "\n\n");
}

TEST(Options, SayTheVersionWhereThereIsOne) {
    const Expected<std::optional<std::string>> read = Program().options.read({"--version"});
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, "tessera-x 1\n");
    EXPECT_EQ(Options("tessera-x", "").read({"--version"}).error().message,
              "The following argument was not expected: --version");
}

TEST(Options, EndAProgramWithTextOrFault) {
    const auto parse = [](std::vector<const char*> argv) {
        return Program().options.parse(static_cast<int>(argv.size()), argv.data());
    };
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    EXPECT_EQ(parse({"x", "--yes"}), std::nullopt);
    EXPECT_EQ(parse({"x", "--version"}), 0);
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "tessera-x 1\n");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    EXPECT_EQ(parse({"x", "--whole", "x"}), exitCode(ErrorCode::kUsage));
    EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "tessera-x: Could not convert: --whole = x; see --help\n");
}

TEST(OptionsDeathTest, OutOfMemoryIsSaid) {
    const Options options("tessera-x", "does something");
    const auto endWith = [](const auto& thrown) {
        try {
            throw thrown;
        } catch (...) {
            std::terminate();
        }
    };
    EXPECT_EXIT(endWith(std::bad_alloc()), testing::ExitedWithCode(1), "^tessera-x: out of memory\n$");
    EXPECT_DEATH(endWith(std::runtime_error("our fault")), "our fault");
}

}  // namespace
}  // namespace tessera
