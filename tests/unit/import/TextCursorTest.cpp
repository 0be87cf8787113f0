/// Numbers of texts: short decimals beside the library's, which rounds once.
#include "server/import/reader/TextCursor.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <charconv>
#include <random>
#include <string>

namespace tessera {
namespace {

TEST(TextCursor, DecimalsAreRoundedOnce) {
    std::mt19937_64 random(7);
    for (int i = 0; i < 1'000'000; ++i) {
        const int digits = 1 + static_cast<int>(random() % 11), point = static_cast<int>(random() % 12);
        std::string text = random() % 4 == 0 ? "-" : "";
        for (int digit = 0; digit < digits; ++digit) {
            if (digit == point) text += '.';
            text += static_cast<char>('0' + random() % 10);
        }
        if (point == digits) text += '.';
        float expected = 0, read = 0;
        ASSERT_EQ(std::from_chars(text.data(), text.data() + text.size(), expected).ec, std::errc());
        TextCursor cursor(text.data(), text.data() + text.size(), false);
        ASSERT_TRUE(cursor.number(read)) << text;
        ASSERT_EQ(std::bit_cast<std::uint32_t>(read), std::bit_cast<std::uint32_t>(expected)) << text;
    }
}

TEST(TextCursor, WordsThatAreNoNumbersAreNone) {
    for (const std::string text :
         {"", "-", ".", "-.", "1.2.3", "1-", "--1", "+-1", "1,5", "0x10", "1e", "12a", "1e99"}) {
        float read = 0;
        EXPECT_FALSE(TextCursor(text.data(), text.data() + text.size(), false).number(read)) << text;
    }
    const std::string row = "+1.5 -.25\t7. 1e2 inf -0 3#4";
    TextCursor cursor(row.data(), row.data() + row.size(), true);
    for (const float expected : {1.5f, -0.25f, 7.0f, 100.0f, std::numeric_limits<float>::infinity(), -0.0f, 3.0f}) {
        float read = -1;
        EXPECT_TRUE(cursor.number(read)) << expected;
        EXPECT_EQ(std::bit_cast<std::uint32_t>(read), std::bit_cast<std::uint32_t>(expected)) << expected;
    }
    float none = 0;
    EXPECT_FALSE(cursor.number(none)) << "a remark is no number";
}

}  // namespace
}  // namespace tessera
