/// What a person is told while a wall runs, and what only those who ask for it.
#include "deploy/wall/Console.h"
#include "tests/support/words/Words.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>

namespace tessera {
namespace {

/// What a console says in that manner.
template <class Say>
std::string saidBy(Console::Manner manner, Say say) {
    char* text = nullptr;
    std::size_t size = 0;
    std::FILE* const stream = ::open_memstream(&text, &size);
    {
        Console console(stream, stream, manner);
        say(console);
    }
    std::fclose(stream);
    std::string said(text, size);
    std::free(text);
    return said;
}

void aShortRun(Console& console) {
    console.fact("tessera-wall: pid 1 role server host -");
    console.preparing("getting ready");
    for (int frame = 1; frame <= 60; ++frame) console.progress(frame, 60, "frames");
    console.finishProgress();
    console.note("60 frames");
}

TEST(Console, SaysTheResultOfAShortRunAlone) {
    EXPECT_EQ(saidBy({}, aShortRun), "tessera-wall: 60 frames\n");
}

TEST(Console, SaysFactsAndTenthsToThoseWhoWantThem) {
    const std::string said = saidBy({.verbose = true}, aShortRun);
    EXPECT_WORDS(said);
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 13) << said;
}

TEST(Console, RewritesOneLineOfATerminal) {
    const std::string said = saidBy({.bar = true}, aShortRun);
    EXPECT_WORDS(said);
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    EXPECT_TRUE(said.ends_with("\r\x1b[Ktessera-wall: 60 frames\n")) << said;
}

TEST(Console, TakesNoCommandsToTheTerminalFromAnybody) {
    const std::string said = saidBy({}, [](Console& console) { console.passOn(true, "tessera-client[a]: \x1b[2J"); });
    EXPECT_EQ(said, "tessera-client[a]: ?[2J\n");
}

}  // namespace
}  // namespace tessera
