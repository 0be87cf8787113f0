/// Hashes, errors, strong ids, the log and nearest names.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <functional>
#include <new>
#include <set>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "common/base/Error.h"
#include "common/base/Hash.h"
#include "common/base/Log.h"
#include "common/base/LowerCase.h"
#include "common/base/Nearest.h"
#include "common/base/RunProgram.h"
#include "common/base/StrongId.h"
#include "common/base/Utf8.h"
#include "tests/support/words/Words.h"

namespace tessera {
namespace {

TEST(Hash, IsTheSameOnEveryMachine) {
    // XXH3's reference values: the name of a blob must not depend on processor or build.
    EXPECT_EQ(toHex(hash64({})), "2d06800538d394c2");
    EXPECT_EQ(toHex(hash128({})), "99aa06d3014798d86001c324468d497f");
}

TEST(Hash, SeesEveryByteAndTheSeed) {
    std::set<std::uint64_t> seen;
    Bytes bytes(300, std::byte{7});
    seen.insert(hash64(bytes));
    for (std::byte& b : bytes) {
        b ^= std::byte{1};
        EXPECT_TRUE(seen.insert(hash64(bytes)).second);
        b ^= std::byte{1};
    }
    EXPECT_TRUE(seen.insert(hash64(bytes, 1)).second);
    EXPECT_TRUE(seen.insert(hash64(ByteSpan(bytes).first(299))).second);
}

TEST(Utf8, IsCutBetweenCharacters) {
    const std::string_view text = "a\u00e9\u20ac";  // 1, 2 and 3 bytes
    EXPECT_EQ(cutUtf8(text, 6), text);
    EXPECT_EQ(cutUtf8(text, 5), "a\u00e9");
    EXPECT_EQ(cutUtf8(text, 3), "a\u00e9");
    EXPECT_EQ(cutUtf8(text, 2), "a");
    EXPECT_EQ(cutUtf8(text, 0), "");
    EXPECT_EQ(cutUtf8("\x80\x80\x80", 2), "") << "what is no text ends somewhere";
}

TEST(LowerCase, LeavesAllButLettersOfAscii) {
    EXPECT_EQ(lowerCase("DP-1.PNG"), "dp-1.png");
    EXPECT_EQ(lowerCase("@[`{ \xc3\x84\xff"), "@[`{ \xc3\x84\xff");
}

TEST(Hash, PrintsAllDigits) {
    EXPECT_EQ(toHex(std::uint64_t{0xab}), "00000000000000ab");
    EXPECT_EQ(toHex(Hash128{.low = 1, .high = 2}), "00000000000000020000000000000001");
    EXPECT_FALSE(Hash128());
    EXPECT_TRUE((Hash128{.low = 0, .high = 1}));
}

TEST(Errors, BecomeTheDocumentedExitCodes) {
    EXPECT_EQ(exitCode(ErrorCode::kFailed), 1);
    EXPECT_EQ(exitCode(ErrorCode::kRefused), 1);
    EXPECT_EQ(exitCode(ErrorCode::kUnsupported), 1);
    EXPECT_EQ(exitCode(ErrorCode::kUsage), 2);
    EXPECT_EQ(exitCode(ErrorCode::kBadInput), 3);
    EXPECT_EQ(exitCode(ErrorCode::kNotFound), 3);
    EXPECT_EQ(exitCode(ErrorCode::kLimit), 3);
    EXPECT_EQ(exitCode(ErrorCode::kNetwork), 4);
}

TEST(Errors, GainContextOnTheirWayUp) {
    const Expected<int> inner = fail(ErrorCode::kLimit, "too many");
    const Expected<int> outer = failWith("scene.glb", inner.error());
    EXPECT_EQ(outer.error().message, "scene.glb: too many");
    EXPECT_EQ(outer.error().code, ErrorCode::kLimit);
}

TEST(Errors, ChecksAreAlwaysOn) {
    EXPECT_DEATH(TESSERA_CHECK(1 + 1 == 3, "arithmetic"),
                 "internal error at .*BaseTest.cpp:.*1 \\+ 1 == 3.*arithmetic");
}

TEST(StrongId, IsComparableAndHashable) {
    using Id = StrongId<struct TestTag>;
    EXPECT_FALSE(Id());
    EXPECT_TRUE(Id(3));
    EXPECT_LT(Id(3), Id(4));
    EXPECT_EQ(std::hash<Id>()(Id(5)), std::hash<std::uint64_t>()(5));
}

TEST(Log, WritesWholeLinesFromManyThreads) {
    std::string path = testing::TempDir() + "tessera-log-XXXXXX";
    const int handle = ::mkstemp(path.data());
    ASSERT_GE(handle, 0);
    std::FILE* out = ::fdopen(handle, "w");
    {
        Log log("tessera-test", out);
        std::vector<std::jthread> threads;
        for (int t = 0; t < 4; ++t) {
            threads.emplace_back([&log, t] {
                for (int i = 0; i < 100; ++i) log.warning(std::string(200, static_cast<char>('a' + t)));
            });
        }
    }
    std::fclose(out);
    std::ifstream in(path);
    int lines = 0;
    for (std::string line; std::getline(in, line); ++lines) {
        ASSERT_EQ(line.substr(0, 23), "tessera-test: warning: ");
        EXPECT_EQ(line.substr(23), std::string(200, line.back()));
    }
    EXPECT_EQ(lines, 400);
    std::filesystem::remove(path);
}

TEST(NearestName, FindsWhatWasMeant) {
    const std::vector<std::string> known{"lower_left", "lower_right", "upper_left", "grid", "name"};
    EXPECT_EQ(nearestName("lower_rigth", known), "lower_right");
    EXPECT_EQ(nearestName("LowerLeft", known), "lower_left");
    EXPECT_EQ(nearestName("gird", known), "grid");
    EXPECT_EQ(nearestName("nam", known), "name");
    EXPECT_EQ(nearestName("grid", known), "grid");
}

TEST(NearestName, KeepsQuietWhereNothingIsNear) {
    const std::vector<std::string> known{"lower_left", "ab"};
    EXPECT_EQ(nearestName("zzzzzzz", known), "");
    EXPECT_EQ(nearestName("xy", known), "") << "two edits make any two letters of any two others";
    EXPECT_EQ(nearestName("", known), "");
    EXPECT_EQ(nearestName("grid", {}), "");
    EXPECT_EQ(nearestName(std::string(100'000, 'a'), known), "") << "hostile lengths cost nothing";
}

TEST(RunProgram, SaysWhatTheMachineRefusesAndEndsWithTheCodeOfAFailure) {
    const auto said = [](const std::function<int()>& run) {
        testing::internal::CaptureStderr();
        const int code = runProgram("tessera-test", run);
        return std::pair(code, testing::internal::GetCapturedStderr());
    };
    const auto refused = [](int number) {
        return [number]() -> int { throw std::system_error(number, std::generic_category(), "a call"); };
    };
    EXPECT_EQ(said([] { return 7; }), std::pair(7, std::string()));
    const std::vector<std::function<int()>> runs{refused(EMFILE), refused(EAGAIN), refused(EPIPE),
                                                 []() -> int { throw std::bad_alloc(); },
                                                 []() -> int { throw std::runtime_error("a library's words"); }};
    for (const std::function<int()>& run : runs) {
        const auto [code, words] = said(run);
        EXPECT_EQ(code, exitCode(ErrorCode::kFailed));
        EXPECT_WORDS(words);
    }
}

}  // namespace
}  // namespace tessera
